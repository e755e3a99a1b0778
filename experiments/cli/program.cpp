#include "experiments/cli/program.h"

#include <fcntl.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <map>
#include <new>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/nearest.h"
#include "autograd/base/parallel.h"
#include "autograd/base/words.h"
#include "datasets/hdf5/file.h"
#include "datasets/readers/text/text.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"

#ifndef RESTAGE_VERSION
#define RESTAGE_VERSION "unknown"
#endif

namespace restage::cli {
namespace {

constexpr int kMaxThreads = 1024;

/// "512MB", "4GB", "2GiB" or plain bytes.
uint64_t parse_memory(const std::string& text) {
  static const std::map<std::string, double> units = {
      {"", 1.0},   {"b", 1.0},      {"kb", 1e3},        {"mb", 1e6},
      {"gb", 1e9}, {"kib", 1024.0}, {"mib", 1048576.0}, {"gib", 1073741824.0},
      {"k", 1e3},  {"m", 1e6},      {"g", 1e9}};
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const auto factor = units.find(lower_case({end, text.data() + text.size()}));
  const double bytes = factor == units.end() ? 0 : value * factor->second;
  if (error != std::errc() || !(bytes >= 1e6 && bytes <= 1e15))
    throw InputError("", "--max-memory '" + text.substr(0, 40) + "' is no size",
                     "give 1MB or more, such as 512MB or 4GB");
  return static_cast<uint64_t>(bytes);
}

std::string with_heading(const std::string& examples) {
  std::string text = "Examples:\n  ";
  for (const char c : examples) text += c == '\n' ? std::string("\n  ") : std::string(1, c);
  return text;
}

/// What with_heading() had been given.
std::string without_indent(const std::string& text) {
  std::string out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    out += (out.empty() ? "" : "\n") + (line.starts_with("  ") ? line.substr(2) : line);
  return out;
}

/// The command that was chosen, or was being read.
const CLI::App& innermost(const CLI::App& app) {
  return app.get_subcommands().empty() ? app : innermost(*app.get_subcommands().back());
}

/// The words that name a command: "restage data import".
std::string words_of(const CLI::App& command) {
  const CLI::App* group = command.get_parent();
  return (group == nullptr ? "" : words_of(*group) + " ") + command.get_name();
}

/// What add_option() and add_flag() know of it; nothing of those that the parser adds (--help).
const OptionFacts& facts_of(const OptionTable& table, const CLI::Option* option) {
  static const OptionFacts nothing;
  const auto found = table.find(option);
  return found == table.end() ? nothing : found->second;
}

/// What may be proposed for an option that is not known: the command's own before those of every
/// command, which were added first. What switches checks off is never proposed.
std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames())
      if (name != "force") names.insert(names.begin(), "--" + name);
  return names;
}

/// The command that the words name, as far as they go.
const CLI::App* command_named(const CLI::App* app, std::span<const std::string> words) {
  for (const std::string& word : words)
    for (const CLI::App* sub : app->get_subcommands([](const CLI::App*) { return true; }))
      if (sub->get_name() == word) {
        app = sub;
        break;
      }
  return app;
}

/// Writes older names of options as they are called now; a remark on each.
std::vector<std::string> rename_options(const CLI::App& app, const OptionTable& table,
                                        std::vector<std::string>& words) {
  std::vector<std::string> remarks;
  const CLI::App* command = command_named(&app, words);
  for (const CLI::Option* option : command->get_options())
    for (const std::string& old : facts_of(table, option).formerly)
      for (std::string& word : words) {
        if (word != old && !word.starts_with(old + "=")) continue;
        word.replace(0, old.size(), option->get_name());
        remarks.push_back(old + " of '" + words_of(*command) + "' is called " + option->get_name() +
                          " now");
      }
  return remarks;
}

std::vector<std::string> command_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* sub : command.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(sub->get_name());
  return names;
}

/// A file of bone names that was given to --profile, which means timings beside --bones; "": none.
std::string bones_for_profile(const CLI::App& command, const std::vector<std::string>& extras) {
  const CLI::Option* profile = command.get_option_no_throw("--profile");
  const CLI::Option* bones = command.get_option_no_throw("--bones");
  if (profile == nullptr || bones == nullptr || profile == bones || profile->count() == 0)
    return "";
  std::vector<std::string> words = profile->results();
  words.insert(words.end(), extras.begin(), extras.end());
  for (const std::string& word : words)
    if (text::ends_in(word, {".yaml", ".yml"})) return word;
  return "";
}

/// "TEXT:{smoke,lite}" -> smoke, lite
std::vector<std::string> choices_of(const std::string& type) {
  std::vector<std::string> out;
  const size_t open = type.find('{'), close = type.rfind('}');
  if (open == std::string::npos || close == std::string::npos || close < open) return out;
  std::istringstream words(type.substr(open + 1, close - open - 1));
  for (std::string word; std::getline(words, word, ',');) out.push_back(word);
  return out;
}

CommandTree::Option described(const CLI::Option& option, const OptionFacts& facts,
                              const std::string& name) {
  return {name,
          option.get_description(),
          option.get_items_expected_max() > 0,
          choices_of(option.get_type_name()),
          facts.kind,
          facts.default_value,
          option.get_required(),
          option.get_items_expected_max() > 1,
          facts.formerly,
          option.get_group()};
}

CommandTree described(const CLI::App& command, const OptionTable& table) {
  constexpr std::string_view kExamples = "Examples:\n  ";
  CommandTree out;
  out.name = command.get_name();
  out.help = command.get_description();
  if (const std::string footer = command.get_footer(); footer.starts_with(kExamples))
    out.examples = without_indent(footer.substr(kExamples.size()));
  for (const CLI::Option* option : command.get_options()) {
    const OptionFacts& facts = facts_of(table, option);
    if (option->get_positional()) {
      for (const auto& words : {choices_of(option->get_type_name()), facts.suggestions})
        out.words.insert(out.words.end(), words.begin(), words.end());
      if (option->get_lnames().empty())
        out.arguments.push_back(described(*option, facts, option->get_name()));
    }
    for (const std::string& name : option->get_lnames())
      out.options.push_back(described(*option, facts, "--" + name));
  }
  for (const CLI::App* sub : command.get_subcommands([](const CLI::App*) { return true; }))
    if (!sub->get_group().empty()) out.commands.push_back(described(*sub, table));
  return out;
}

/// The option or argument that a message of the parser begins with, or null.
const CLI::Option* named_in(const CLI::App& command, const std::string& message) {
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_name();
    if (message.starts_with(name) && message.find_first_of(": ") == name.size()) return option;
  }
  return nullptr;
}

/// The parser's own message in plain words.
std::string in_plain_words(const CLI::App& command, const CLI::ParseError& error) {
  const std::string message = error.what();
  if (dynamic_cast<const CLI::ConversionError*>(&error) != nullptr) {
    const std::string rest = message.substr(std::min(message.size(), message.find("--")));
    const CLI::Option* option = named_in(command, rest);
    const size_t value = rest.find(" = ");
    if (option == nullptr || value == std::string::npos) return message;
    if (option->get_items_expected_max() == 0) return option->get_name() + " takes no value";
    const bool whole = option->get_type_name().find("INT") != std::string::npos;
    return "'" + rest.substr(value + 3) + "' is no " + (whole ? "whole " : "") + "number, and " +
           option->get_name() + " needs one";
  }
  const CLI::Option* option = named_in(command, message);
  if (option == nullptr) return message;
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr)
    return option->get_name() +
           (message.find("At Most") != std::string::npos ? " is given twice" : " needs a value");
  if (dynamic_cast<const CLI::RequiredError*>(&error) == nullptr || !option->get_positional())
    return message;
  constexpr size_t kShort = 90;
  const std::string says = option->get_description();
  return option->get_name() + " is required" + (says.size() < kShort ? ": " + says : "");
}

/// An option of several values whose last one is a file, where a word of the command is missing;
/// null: there is none.
const CLI::Option* swallowing(const CLI::App& command) {
  const std::vector<const CLI::Option*> all = command.get_options();
  const bool missing = std::any_of(all.begin(), all.end(), [](const CLI::Option* option) {
    return option->get_positional() && option->get_required() && option->count() == 0;
  });
  for (const CLI::Option* option : all) {
    std::error_code ignored;
    const bool many = option->nonpositional() && option->get_expected_max() > 1 &&
                      option->get_allow_extra_args() && option->results().size() > 1;
    if (missing && many && std::filesystem::exists(option->results().back(), ignored))
      return option;
  }
  return nullptr;
}

/// What was wrong with the arguments that `app` just refused, with the nearest known name.
InputError usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = innermost(app);
  const std::string words = words_of(command);
  const std::string help = "see '" + words + " --help'";
  const std::vector<std::string> known = command_names(command);
  const std::vector<std::string> extras = app.remaining(true);
  if (const std::string bones = bones_for_profile(command, extras); !bones.empty())
    return InputError("", "--profile of '" + words + "' prints timings and takes no file",
                      "name the bones with --bones " + bones);
  if (!extras.empty()) {
    const std::string word = extras.front().substr(0, extras.front().find('='));
    const bool is_option = word.size() > 1 && word[0] == '-';
    const std::string kind = is_option ? "option" : known.empty() ? "argument" : "command";
    const std::string near =
        is_option ? nearest(word, option_names(command)) : nearest(word, known);
    return InputError("", "unknown " + kind + " '" + word + "' of '" + words + "'",
                      near.empty() ? help : "did you mean '" + near + "'? (" + help + ")");
  }
  if (!known.empty() && command.get_subcommands().empty() &&
      dynamic_cast<const CLI::RequiredError*>(&error) != nullptr)
    return InputError("", "'" + words + "' needs a command", help);
  if (const CLI::Option* option = swallowing(command)) {
    const std::string name = option->get_name(), file = option->results().back();
    return InputError("", name + " takes several values, and took '" + file + "' for one of them",
                      "put '" + file + "' before " + name);
  }
  return InputError("", in_plain_words(command, error), help);
}

[[noreturn]] void refuse_empty(const std::string& option) {
  throw InputError("", option + " is empty",
                   option == "--out" ? "give the name of a file or folder to write"
                                     : "give a value, or leave it out");
}

/// The parser would take the next word for the value of "--out=".
void check_words(const std::vector<std::string>& words) {
  for (const std::string& word : words)
    if (word.starts_with("--") && word.find('=') == word.size() - 1)
      refuse_empty(word.substr(0, word.size() - 1));
}

/// No option means anything with an empty text, and results are files or folders.
void check_values(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options())
    if (option->nonpositional())
      for (const std::string& value : option->results())
        if (value.empty()) refuse_empty(option->get_name());
  const CLI::Option* out = command.get_option_no_throw("--out");
  if (out != nullptr && out->count() > 0 && out->results().back() == "-")
    throw InputError("", "--out cannot be standard output",
                     "give the name of a file or folder to write");
}

}  // namespace

Program::Program()
    : app_(std::make_unique<CLI::App>("Correspondence-free retargeting of human motion.",
                                      "restage")),
      all_(*app_, table_) {
  app_->set_version_flag("--version", "restage " RESTAGE_VERSION, "print the version");
  app_->require_subcommand(1);
  app_->footer(
      with_heading("restage COMMAND --help\n"
                   "restage eval --pred result.h5 --truth truth.h5"));
  add_common_options(all_);
}

Program::~Program() = default;

void Program::add_common_options(CommandOptions app) {
  app.app().set_help_flag("-h,--help", "print this page");
  app.app().get_formatter()->column_width(36);
  const std::string group = "Common options";
  app.add_option("--threads", common_.threads, "number of threads, 0 for all cores").group(group);
  app.add_option("--seed", common_.seed, "seed of all random numbers")
      .check([](const std::string& text) {
        if (text.starts_with("-")) return "is '" + text + "', but cannot be negative";
        uint64_t value = 0;
        const auto end = text.data() + text.size();
        return std::from_chars(text.data(), end, value).ec == std::errc::result_out_of_range
                   ? "is '" + text + "', but cannot be above 2^64 - 1"
                   : std::string();
      })
      .group(group);
  app.add_flag("--quiet", common_.quiet, "print results and errors only").group(group);
  app.add_flag("--verbose", common_.verbose, "print more about what is done").group(group);
  app.add_flag("--json", common_.json, "print one JSON document instead of text").group(group);
  app.add_text(
         "--max-memory",
         [this](const std::string& text) {
           common_.max_memory = parse_memory(text);
           h5::set_max_memory(common_.max_memory);
         },
         "most that an array of a file may take, unpacked (default: 4GB, of HDF5 16GiB)")
      .group(group);
}

CommandOptions Program::add(CommandOptions group, const std::string& name, const std::string& help,
                            const std::string& examples, std::function<int()> action) {
  CLI::App& command = *group.app().add_subcommand(name, help);
  add_common_options(CommandOptions(command, table_));
  command.footer(with_heading(examples));
  command.callback([this, run = std::move(action)] { action_ = run; });
  return CommandOptions(command, table_);
}

CommandOptions Program::add(const std::string& name, const std::string& help,
                            const std::string& examples, std::function<int()> action) {
  return add(all_, name, help, examples, std::move(action));
}

CommandOptions Program::add_group(const std::string& name, const std::string& help) {
  CLI::App& group = *app_->add_subcommand(name, help);
  add_common_options(CommandOptions(group, table_));
  group.require_subcommand(1);
  group.footer("More about each: restage " + name + " COMMAND --help");
  return CommandOptions(group, table_);
}

CommandTree Program::tree() const { return described(*app_, table_); }

int Program::run(int argc, char** argv) {
  common_.command_line.assign(argv, argv + argc);
  if (argc > 0) common_.command_line[0] = "restage";  // not where it lies on this machine
  std::vector<std::string> words = common_.command_line;
  renamed_ = rename_options(*app_, table_, words);
  try {
    check_words(words);
    std::vector<const char*> pointers;
    for (const std::string& word : words) pointers.push_back(word.c_str());
    app_->parse(static_cast<int>(pointers.size()), pointers.data());
  } catch (const CLI::CallForVersion& version) {
    if (std::find(words.begin(), words.end(), "--json") != words.end())
      print_json({{"version", RESTAGE_VERSION}});
    else
      print(std::string(version.what()) + "\n");
    return 0;
  } catch (const CLI::Success&) {  // --help
    print(app_->help());
    return 0;
  } catch (const CLI::ParseError& error) {
    throw usage_error(*app_, error);
  }
  if (common_.threads < 0 || common_.threads > kMaxThreads)
    throw InputError("", "--threads " + std::to_string(common_.threads) + " is out of range",
                     "give a number from 0 (all cores) to " + std::to_string(kMaxThreads));
  check_values(innermost(*app_));
  common_.seed_given = innermost(*app_).count("--seed") > 0;
  set_threads(common_.threads);
  set_log_level(common_.quiet     ? LogLevel::quiet
                : common_.verbose ? LogLevel::debug
                                  : LogLevel::info);
  const int code = action_();
  // Bad input is answered with one line: remarks come when all is done.
  for (const std::string& remark : renamed_) log_warning(remark);
  return code;
}

namespace {

int run_program(int argc, char** argv) {
  try {
    Program program;
    add_commands(program);
    const int code = program.run(argc, argv);
    finish_output();
    return code;
  } catch (const std::filesystem::filesystem_error& error) {
    // Whatever we asked the system about a place that the user named, it would not hear of it.
    throw_refused(error.path1().string(), "used", error.code().value());
  }
}

/// A program may be begun without standard streams. The next file to be opened would be taken for
/// one of them; so each becomes one that holds nothing.
void open_standard_streams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(fd, F_GETFD) < 0 && errno == EBADF && open("/dev/null", O_RDWR) < 0) return;
}

}  // namespace

int run(int argc, char** argv) {
  open_standard_streams();
  handle_signals();
  spell_settings([](std::string_view name) { return cat("--", name); });
  try {
    return run_program(argc, argv);
  } catch (const Error& error) {
    print_error(error.what());
    return error.exit_code;
  } catch (const std::bad_alloc&) {
    print_error("not enough memory; give smaller input or free some memory");
  } catch (const std::exception& error) {
    print_error(std::string("internal error: ") + error.what() + "; please report it");
  } catch (...) {
    print_error("internal error of unknown kind; please report it");
  }
  return 1;
}

}  // namespace restage::cli
