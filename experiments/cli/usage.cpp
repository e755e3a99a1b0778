#include "experiments/cli/usage.h"

#include <utility>
#include <vector>

#include "autograd/base/nearest.h"

namespace restage::cli {
namespace {

/// The command that was being read, and the words that name it ("restage data import").
std::pair<const CLI::App*, std::string> innermost(const CLI::App& app) {
  const CLI::App* at = &app;
  std::string words = app.get_name();
  while (!at->get_subcommands().empty()) {
    at = at->get_subcommands().back();
    words += " " + at->get_name();
  }
  return {at, words};
}

/// The command's own options before those of every command, which were added first.
std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.insert(names.begin(), "--" + name);
  return names;
}

std::vector<std::string> command_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* sub : command.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(sub->get_name());
  return names;
}

}  // namespace

InputError usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const auto [command, words] = innermost(app);
  const std::string help = "see '" + words + " --help'";
  const std::vector<std::string> known = command_names(*command);
  const std::vector<std::string> extras = app.remaining(true);
  if (!extras.empty()) {
    const std::string word = extras.front().substr(0, extras.front().find('='));
    const bool is_option = word.size() > 1 && word[0] == '-';
    const std::string kind = is_option ? "option" : known.empty() ? "argument" : "command";
    const std::string near =
        is_option ? nearest(word, option_names(*command)) : nearest(word, known);
    return InputError("", "unknown " + kind + " '" + word + "' of '" + words + "'",
                      near.empty() ? help : "did you mean '" + near + "'? (" + help + ")");
  }
  if (!known.empty() && command->get_subcommands().empty() &&
      dynamic_cast<const CLI::RequiredError*>(&error) != nullptr)
    return InputError("", "'" + words + "' needs a command", help);
  return InputError("", error.what(), help);
}

}  // namespace restage::cli
