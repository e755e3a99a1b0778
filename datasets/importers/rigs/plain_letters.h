// Letters of names as the words of dictionaries have them.
#pragma once

#include <string>
#include <string_view>

namespace restage {

/// UTF-8 text without what writers have no common habit of: "Schlüsselbein" as "Schlusselbein",
/// "tête" as "tete", Russian capitals as small letters, Latin letters and digits of Japanese width
/// as ASCII, kana of half width as those of full width.
std::string plain_letters(std::string_view name);

}  // namespace restage
