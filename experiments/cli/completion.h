// What a shell must know to complete a command line of ours.
#pragma once

#include <string>
#include <vector>

#include "experiments/cli/command_options.h"

namespace restage::cli {

/// A command with its options and, of a group, its commands.
struct CommandTree {
  struct Option {
    std::string name, help;                  ///< "--out"
    bool value = false;                      ///< whether a word follows
    std::vector<std::string> choices;        ///< that this word may be; empty: any, such as a file
    ValueKind kind = ValueKind::flag;        ///< of the word
    std::string default_value;               ///< OptionFacts::default_value
    bool required = false, several = false;  ///< has to be given; may be given more than once
    std::vector<std::string> formerly;       ///< OptionFacts::formerly
    std::string heading;                     ///< under which the help page lists it
  };
  std::string name, help;
  std::vector<Option> options;
  std::vector<CommandTree> commands;
  std::vector<std::string> words;  ///< that may stand where files may
  std::vector<Option> arguments;   ///< words without a name, such as "FILE"
  std::string examples;            ///< of the help page, one a line
};

/// A script for bash, zsh or fish.
std::string bash_completion(const CommandTree& program);
std::string zsh_completion(const CommandTree& program);
std::string fish_completion(const CommandTree& program);
/// The options of Python's functions as a stub (python/restage/_options.pyi).
std::string python_options(const CommandTree& program);
/// All of it as JSON, from which docs/commands.md is made (docs/make_commands.py).
std::string json_table(const CommandTree& program);
/// What Python's System takes, as a command.
CommandTree system_options();
/// Options of a shell, which mean nothing to a caller in Python.
bool is_for_shells(const std::string& name);

}  // namespace restage::cli
