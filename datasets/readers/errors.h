// InputError and WorkError, and their texts put together from words and numbers.
#pragma once

#include "autograd/base/error.h"
#include "autograd/base/words.h"
