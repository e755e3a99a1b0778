// Where the running program is, and the files that come with it: trained weights, configurations,
// the papers' experiments. They lie in a clone or below share/restage of an installation.
#pragma once

#include <string>
#include <vector>

namespace restage {

/// A path that starts the running program again, also after its file was replaced; from Python the
/// program beside the module. WorkError if there is none.
std::string program_to_start();
/// The same with the words that come before the program's arguments: one, or those of
/// set_program_to_start().
std::vector<std::string> words_to_start();
/// Starts the program by these words from now on, such as python3 -m restage.
void set_program_to_start(std::vector<std::string> words);
/// The program's own file, absolute; empty if the system does not tell.
std::string own_program();

/// The file or folder that was shipped under a name such as "configs/demo.yaml", absolute; empty if
/// there is none.
std::string shipped(const std::string& name);
/// `path`, if something is there; else what was shipped under that name; else `path`.
std::string here_or_shipped(const std::string& path);

}  // namespace restage
