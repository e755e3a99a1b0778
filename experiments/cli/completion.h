// What a shell must know to complete a command line of ours.
#pragma once

#include <string>
#include <vector>

namespace restage::cli {

/// A command with its options and, of a group, its commands.
struct CommandTree {
  struct Option {
    std::string name, help;            ///< "--out"
    bool value = false;                ///< whether a word follows
    std::vector<std::string> choices;  ///< that this word may be; empty: any, such as a file
  };
  std::string name, help;
  std::vector<Option> options;
  std::vector<CommandTree> commands;
  std::vector<std::string> words;  ///< that may stand where files may
};

/// A script for bash, zsh or fish.
std::string bash_completion(const CommandTree& program);
std::string zsh_completion(const CommandTree& program);
std::string fish_completion(const CommandTree& program);

}  // namespace restage::cli
