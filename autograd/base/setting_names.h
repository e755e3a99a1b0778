// How messages name a setting. The library knows no command line and no Python: it writes
// {max-memory} for a setting of that name. Who shows the message says how such a name is written
// there.
#pragma once

#include <string>
#include <string_view>

namespace restage {

using SettingSpeller = std::string (*)(std::string_view name);

/// How names are written from now on: "max-memory" as "--max-memory" in the program. Without a
/// call: as a variable of C++ and Python is named, "max_memory".
void spell_settings(SettingSpeller speller);

/// `text` with each {name} as it is written here. Names are of small letters, with hyphens.
std::string spelled(const std::string& text);

}  // namespace restage
