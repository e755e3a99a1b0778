// Wrong arguments, explained in one line.
#pragma once

#include <CLI/App.hpp>

#include "autograd/base/error.h"

namespace restage::cli {

/// What was wrong with the arguments that `app` just refused, with the nearest known name.
InputError usage_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace restage::cli
