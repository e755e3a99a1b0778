// Whether the HDF5 library can read a file without falling over.
#pragma once

#include <string>

namespace restage::h5 {

/// The older file layouts (most programs write them) carry no checksums over their structure, and
/// the library trusts it: a damaged file can crash the process that reads it. Such a file is first
/// read by a child process, every object, attribute and value (of very large data sets the ends).
/// False if the child did not survive. Files of the newest layout (ours) are checksummed
/// throughout: true at once. Call it under the Lock.
bool survives_reading(const std::string& path);

}  // namespace restage::h5
