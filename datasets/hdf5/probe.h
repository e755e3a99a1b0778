// Whether the HDF5 library can read a file without falling over.
#pragma once

#include <string>

namespace restage::h5 {

enum class Probe {
  good,
  damaged,  ///< the library fell over, or could not walk through all of the structure
  memory,   ///< it asked for more than kProbeMemory
  time,     ///< it found no end
};

/// What reading may take: a chunk as large as we read any, 256 MiB, packed and (zlib's output grows
/// by doubling) twice that unpacked, the values themselves, 64 MiB, and the library's own caches.
inline constexpr unsigned long kProbeMemory = 1ul << 30;

/// The library trusts what a file says of itself: a damaged or hostile one can crash the process
/// that reads it, fill its memory, or keep it busy for ever. So a child process reads it first,
/// every group, object and attribute and up to 256 MiB of values (of large data sets the ends),
/// with limits on memory and time. What it could not walk to its end is refused whole: behind the
/// place where it stopped, nothing is known. A file that passed is not read again while its size
/// and times stay. Call it under the Lock. Errors as in_a_child().
Probe probe(const std::string& path);

}  // namespace restage::h5
