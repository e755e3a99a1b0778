// What tells this machine, and a piece of work on it, from all others.
#pragma once

#include <string>

namespace restage {

/// The machine's name, or "unknown".
std::string host_name();
/// 16 hexadecimal digits that nobody else has: random numbers of the system, so also other threads
/// and other machines on a shared disk draw others. WorkError if the system has none.
std::string unique_token();

}  // namespace restage
