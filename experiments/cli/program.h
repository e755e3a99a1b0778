// The program `restage`: options that every command has, errors as one line and an exit code.
// A command is one file with one function `void add_x(Program&)` and a line in commands.cpp.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "datasets/readers/byte_stream.h"
#include "experiments/cli/command_options.h"
#include "experiments/cli/completion.h"

namespace restage::cli {

/// Options of every command.
struct Common {
  int threads = 0;  ///< 0: all cores; already handed to base/parallel.h
  uint64_t seed = 0;
  bool seed_given = false;              ///< behind the command's name
  bool quiet = false, verbose = false;  ///< already handed to base/log.h
  bool json = false;
  /// What an array of a file may take in memory, bytes; already handed to datasets/hdf5/file.h.
  uint64_t max_memory = kMaxMemory;
  /// All words that the program was called with, its own name first.
  std::vector<std::string> command_line;
};

/// A command, and the arguments that it is run with; both live as long as the program.
template <class A>
struct Command {
  CommandOptions app;
  A& arguments;
};

class Program {
 public:
  Program();
  ~Program();

  /// Adds a command that runs `action` (its result is the exit code) once all arguments are read.
  /// `examples` ends the help page, one example a line. The command's own options are added to the
  /// Arguments that come back; they live as long as the program.
  CommandOptions add(const std::string& name, const std::string& help, const std::string& examples,
                     std::function<int()> action);
  /// A command of commands, such as `data`; and its parts.
  CommandOptions add_group(const std::string& name, const std::string& help);
  CommandOptions add(CommandOptions group, const std::string& name, const std::string& help,
                     const std::string& examples, std::function<int()> action);

  /// The same with arguments of the command's own: runs work(arguments, common()).
  template <class A>
  Command<std::remove_cvref_t<A>> add(CommandOptions group, const std::string& name,
                                      const std::string& help, const std::string& examples,
                                      int (*work)(A, const Common&)) {
    const auto arguments = std::make_shared<std::remove_cvref_t<A>>();
    return {add(group, name, help, examples, [=, this] { return work(*arguments, common_); }),
            *arguments};
  }
  template <class A>
  Command<std::remove_cvref_t<A>> add(const std::string& name, const std::string& help,
                                      const std::string& examples, int (*work)(A, const Common&)) {
    return add(all_, name, help, examples, work);
  }
  const Common& common() const { return common_; }
  /// What was said of older names in the arguments that were read: "--input of ... is called ...".
  const std::vector<std::string>& renamed() const { return renamed_; }
  /// All commands and options, as the help pages show them.
  CommandTree tree() const;

  /// Reads the arguments and runs the chosen command. Throws.
  int run(int argc, char** argv);

 private:
  void add_common_options(CommandOptions app);

  std::unique_ptr<CLI::App> app_;
  OptionTable table_;
  CommandOptions all_;  ///< the commands themselves
  Common common_;
  std::vector<std::string> renamed_;
  std::function<int()> action_;
};

/// The whole program: never throws, prints at most one line on standard error for an error.
int run(int argc, char** argv);

}  // namespace restage::cli
