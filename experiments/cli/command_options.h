// What a command line may hold: the options of a command, read into variables. The only door to
// CLI11, whose templates take seconds to compile: only command_options.cpp and program.cpp include
// it.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace restage::cli {

/// One option of a command. The setters can be chained; a fault is told when the arguments are
/// read.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option& required();
  /// Takes one value a time: `--size a=1 --size b=2`, so that words behind the value stay words of
  /// the command.
  Option& one_at_a_time();
  Option& separated_by(char separator);
  /// Exactly so many values.
  Option& count(int values);
  /// The help page shows the variable's value of now as the default.
  Option& show_default();
  Option& one_of(std::vector<std::string> words);
  /// Words that shells offer beside files for an option without a name.
  Option& suggest(std::vector<std::string> words);
  /// `fault` says what is wrong with a value in words that follow the option's name, or nothing.
  Option& check(std::function<std::string(const std::string&)> fault);
  /// The heading under which the help page lists the option.
  Option& group(const std::string& heading);

 private:
  CLI::Option* option_;
};

/// What suggest() was given, else nothing.
const std::vector<std::string>& suggestions(const CLI::Option* option);

/// The arguments of a command or of a group of commands; refers to what Program owns.
class CommandOptions {
 public:
  explicit CommandOptions(CLI::App& app) : app_(&app) {}

  /// Reads `names` ("--out", or "FILE" for a word without a name) into `value`, which lives as long
  /// as the program. T: std::string, bool, double, int, int64_t, uint64_t, a vector of them, or
  /// std::optional of one (command_options.cpp lists them).
  template <class T>
  Option add_option(const std::string& names, T& value, const std::string& help);
  /// Is true when the option is given; "!--no-x" makes `value` false.
  Option add_flag(const std::string& names, bool& value, const std::string& help);
  /// Hands the value over as text; `read` may throw.
  Option add_text(const std::string& name, std::function<void(const std::string&)> read,
                  const std::string& help);

  CLI::App& app() const { return *app_; }

 private:
  CLI::App* app_;
};

}  // namespace restage::cli
