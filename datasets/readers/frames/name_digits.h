// Numbers in names as digits 0 to 9 and a point, however they are written.
#pragma once

#include <string>

namespace restage::numbered {

/// The name with digits of other scripts (full-width, Arabic, Persian, Devanagari), and full-width
/// points, minuses, brackets and blanks, as those of ASCII, and with numbers in powers of ten as
/// plain decimals: 5e-05 is 0.00005, 1.5e+01 is 15.
std::string plain_numbers(const std::string& name);

}  // namespace restage::numbered
