// The program `restage`: options that every command has, errors as one line and an exit code.
// A command is one file with one function `void add_x(Program&)` and a line in commands.cpp.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "datasets/readers/byte_stream.h"

namespace restage::cli {

/// Options of every command.
struct Common {
  int threads = 0;  ///< 0: all cores; already handed to base/parallel.h
  uint64_t seed = 0;
  bool quiet = false, verbose = false;  ///< already handed to base/log.h
  bool json = false;
  uint64_t max_memory = kMaxMemory;  ///< what unpacking one compressed file may take, bytes
};

class Program {
 public:
  Program();

  /// Adds a command that runs `action` (its result is the exit code) once all arguments are read.
  /// `examples` ends the help page, one example a line. The command's own options are added to the
  /// CLI::App that comes back; it lives as long as the program.
  CLI::App& add(const std::string& name, const std::string& help, const std::string& examples,
                std::function<int()> action);
  /// A command of commands, such as `data`; and its parts.
  CLI::App& add_group(const std::string& name, const std::string& help);
  CLI::App& add(CLI::App& group, const std::string& name, const std::string& help,
                const std::string& examples, std::function<int()> action);

  const Common& common() const { return common_; }
  /// All words that the program was called with, its own name first.
  const std::vector<std::string>& command_line() const { return command_line_; }

  /// Reads the arguments and runs the chosen command. Throws.
  int run(int argc, char** argv);

 private:
  void add_common_options(CLI::App& app);

  CLI::App app_;
  Common common_;
  std::vector<std::string> command_line_;
  std::function<int()> action_;
};

/// The whole program: never throws, prints at most one line on standard error for an error.
int run(int argc, char** argv);

}  // namespace restage::cli
