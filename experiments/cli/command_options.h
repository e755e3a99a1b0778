// What a command line may hold: the options of a command, read into variables. They are the one
// table of options: help pages, completion, and Python's signatures and stubs come from them
// (Program::tree()). The only door to CLI11, whose templates take seconds to compile: only
// command_options.cpp and program.cpp include it.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace restage::cli {

/// What an option is given. A flag is given nothing.
enum class ValueKind { flag, text, whole, number, number_or_unit };

/// What is known of an option beside what the parser keeps.
struct OptionFacts {
  std::string help;  ///< without its default
  ValueKind kind = ValueKind::flag;
  std::string default_value;             ///< as one would write it; empty: none
  std::vector<std::string> suggestions;  ///< Option::suggest()
  std::vector<std::string> formerly;     ///< Option::formerly()
};
using OptionTable = std::map<const CLI::Option*, OptionFacts>;

/// One option of a command. The setters can be chained; a fault is told when the arguments are
/// read.
class Option {
 public:
  Option(CLI::Option* option, OptionFacts& facts) : option_(option), facts_(&facts) {}

  Option& required();
  /// Takes one value a time: `--size a=1 --size b=2`, so that words behind the value stay words of
  /// the command.
  Option& one_at_a_time();
  Option& separated_by(char separator);
  /// Exactly so many values.
  Option& count(int values);
  /// An older name ("--input"), which goes on working; whoever uses it is told the new one.
  Option& formerly(const std::string& name);
  Option& one_of(std::vector<std::string> words);
  /// Words that shells offer beside files for an option without a name.
  Option& suggest(std::vector<std::string> words);
  /// `fault` says what is wrong with a value in words that follow the option's name, or nothing.
  Option& check(std::function<std::string(const std::string&)> fault);
  /// The heading under which the help page lists the option.
  Option& group(const std::string& heading);

 private:
  CLI::Option* option_;
  OptionFacts* facts_;
};

/// The arguments of a command or of a group of commands; refers to what Program owns.
class CommandOptions {
 public:
  CommandOptions(CLI::App& app, OptionTable& table) : app_(&app), table_(&table) {}

  /// Reads `names` ("--out", "FILE" for a word without a name, or "--source,SOURCE" for both) into
  /// `value`, which lives as long as the program. T: std::string, double, int, int64_t, uint64_t, a
  /// vector of them, or std::optional of one (command_options.cpp lists them). The help page ends
  /// with the value of now as the default, where `help` names none: "(default: ...)".
  template <class T>
  Option add_option(const std::string& names, T& value, const std::string& help);
  /// Is true when the option is given; "!--no-x" makes `value` false.
  Option add_flag(const std::string& names, bool& value, const std::string& help);
  /// Hands the value over as text; `read` may throw. The default stands in `help`.
  Option add_text(const std::string& name, std::function<void(const std::string&)> read,
                  const std::string& help, ValueKind kind = ValueKind::text);

  CLI::App& app() const { return *app_; }
  OptionTable& table() const { return *table_; }

 private:
  Option keep(CLI::Option* option, OptionFacts facts);

  CLI::App* app_;
  OptionTable* table_;
};

}  // namespace restage::cli
