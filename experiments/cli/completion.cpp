#include "experiments/cli/completion.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <set>

#include "autograd/base/words.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/retarget.h"

namespace restage::cli {
namespace {

/// In single quotes, as all three shells read it.
std::string shell_word(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string in_a_row(const std::vector<std::string>& words) { return joined(words, {}, " "); }

/// Calls visit(words, command) for the program (no words) and all commands ("data import").
void each_command(const CommandTree& of, const std::string& words,
                  const std::function<void(const std::string&, const CommandTree&)>& visit) {
  visit(words, of);
  for (const CommandTree& command : of.commands)
    each_command(command, words.empty() ? command.name : words + " " + command.name, visit);
}

/// The lines that find out which command a half-written line is of: `path`, from `words`, an array
/// that begins with the program.
std::string find_path(const CommandTree& program) {
  std::string patterns;
  each_command(program, "", [&](const std::string& words, const CommandTree&) {
    if (!words.empty()) patterns += (patterns.empty() ? "" : "|") + shell_word(words);
  });
  return "  local path='' word\n"
         "  for word in \"${before[@]}\"; do\n"
         "    case \"${path:+$path }$word\" in\n"
         "      " +
         patterns +
         ") path=\"${path:+$path }$word\" ;;\n"
         "    esac\n"
         "  done\n";
}

std::string for_each_path(const CommandTree& program,
                          const std::function<std::string(const CommandTree&)>& body) {
  std::string out = "  case \"$path\" in\n";
  each_command(program, "", [&](const std::string& words, const CommandTree& command) {
    out += "    " + shell_word(words) + ")\n" + body(command) + "      ;;\n";
  });
  return out + "  esac\n";
}

/// "case "$previous" in --budget) ...": what may follow an option. Where anything may, a file.
std::string for_each_value(const CommandTree& command,
                           const std::function<std::string(const std::string&)>& choose,
                           const std::string& files) {
  std::string out = "      case \"$previous\" in\n", any;
  for (const CommandTree::Option& option : command.options) {
    if (option.value && option.choices.empty()) any += (any.empty() ? "" : "|") + option.name;
    if (!option.choices.empty())
      out += "        " + option.name + ") " + choose(in_a_row(option.choices)) + "; return ;;\n";
  }
  if (!any.empty()) out += "        " + any + ") " + files + "; return ;;\n";
  return out + "      esac\n";
}

std::string script_of(const std::string& shell, const CommandTree& program) {
  return shell == "bash"   ? bash_completion(program)
         : shell == "zsh"  ? zsh_completion(program)
         : shell == "fish" ? fish_completion(program)
         : shell == "json" ? json_table(program)
                           : python_options(program);
}

}  // namespace

std::string bash_completion(const CommandTree& program) {
  // Names may hold spaces.
  const auto files_and = [](const std::vector<std::string>& words) {
    const std::string known =
        words.empty() ? "" : "compgen -W '" + in_a_row(words) + "' -- \"$current\"; ";
    return "mapfile -t COMPREPLY < <(" + known + "compgen -f -- \"$current\")";
  };
  const auto only = [](const std::string& words) {
    return "COMPREPLY=($(compgen -W '" + words + "' -- \"$current\"))";
  };
  const auto rest = [&](const CommandTree& command) {
    std::vector<std::string> commands, options;
    for (const auto& sub : command.commands) commands.push_back(sub.name);
    for (const auto& option : command.options) options.push_back(option.name);
    return for_each_value(command, only, files_and({})) + "      if [[ $current == -* ]]; then " +
           only(in_a_row(options)) + "\n      else " +
           (commands.empty() ? files_and(command.words) : only(in_a_row(commands))) + "; fi\n";
  };
  return "# restage completion bash > /usr/share/bash-completion/completions/restage\n"
         "_restage() {\n"
         "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}\n"
         "  local before=(\"${COMP_WORDS[@]:1:COMP_CWORD - 1}\")\n" +
         find_path(program) + for_each_path(program, rest) +
         "}\n"
         "complete -o filenames -F _restage restage\n";
}

std::string zsh_completion(const CommandTree& program) {
  const auto described = [](const std::string& name, const std::string& help) {
    std::string text = name + ":" + help;
    for (size_t at = name.size() + 1; (at = text.find(':', at + 1)) != std::string::npos; ++at)
      text.insert(at++, "\\");
    return " " + shell_word(text);
  };
  return "#compdef restage\n"
         "_restage() {\n"
         "  local previous=${words[CURRENT - 1]}\n"
         "  local -a before commands options known\n"
         "  before=(\"${(@)words[2,CURRENT - 1]}\")\n" +
         find_path(program) +
         for_each_path(program,
                       [&](const CommandTree& command) {
                         std::string out = for_each_value(
                             command, [](const std::string& words) { return "compadd " + words; },
                             "_files");
                         out += "      commands=(";
                         for (const auto& sub : command.commands)
                           out += described(sub.name, sub.help);
                         out += " )\n      options=(";
                         for (const auto& option : command.options)
                           out += described(option.name, option.help);
                         return out + " )\n      known=(" + in_a_row(command.words) + ")\n";
                       }) +
         "  if [[ ${words[CURRENT]} == -* ]]; then _describe option options\n"
         "  elif (( $#commands )); then _describe command commands\n"
         "  else compadd -a known; _files; fi\n"
         "}\n"
         "_restage \"$@\"\n";
}

std::string fish_completion(const CommandTree& program) {
  std::string out =
      "# restage completion fish > ~/.config/fish/completions/restage.fish\n"
      "# Whether the words without options that were typed so far are exactly these.\n"
      "function __restage_at\n"
      "  set -l typed (commandline -opc)[2..-1]\n"
      "  test (count $typed) -ge (count $argv); or return 1\n"
      "  for i in (seq (count $argv))\n"
      "    test $typed[$i] = $argv[$i]; or return 1\n"
      "  end\n"
      "end\n";
  each_command(program, "", [&](const std::string& words, const CommandTree& command) {
    const std::string at = words.empty() ? "__fish_use_subcommand" : "__restage_at " + words;
    for (const auto& sub : command.commands)
      out += "complete -c restage -f -n " +
             shell_word(at + "; and not __restage_at " + (words.empty() ? "" : words + " ") +
                        sub.name) +
             " -a " + sub.name + " -d " + shell_word(sub.help) + "\n";
    if (!command.words.empty())
      out += "complete -c restage -n " + shell_word(at) + " -a " +
             shell_word(in_a_row(command.words)) + "\n";
    for (const auto& option : command.options) {
      out += "complete -c restage -n " + shell_word(at) + " -l " + option.name.substr(2) + " -d " +
             shell_word(option.help);
      if (option.value) out += " -r";
      if (!option.choices.empty()) out += " -f -a " + shell_word(in_a_row(option.choices));
      out += "\n";
    }
  });
  return out;
}

bool is_for_shells(const std::string& name) {
  for (const char* other : {"json", "quiet", "help", "version", "threads"})
    if (name == other) return true;
  return false;
}

CommandTree system_options() {
  Program program;
  RetargetCommand c;
  add_live_options(program.add("System", "", "", [] { return 0; }), c);
  return program.tree().commands.at(0);
}

namespace {

std::string python_type(const CommandTree::Option& option) {
  std::string one = "bool";
  if (option.kind == ValueKind::text) one = "Text";
  if (option.kind == ValueKind::whole) one = "int";
  if (option.kind == ValueKind::number) one = "float";
  if (option.kind == ValueKind::number_or_unit) one = "float | str";
  if (!option.choices.empty()) {
    one.clear();
    for (const std::string& choice : option.choices)
      one += (one.empty() ? "Literal[\"" : "\", \"") + choice;
    one += "\"]";
  }
  if (option.several) one += " | Sequence[" + one + "]";
  return option.kind == ValueKind::flag ? one : one + " | None";
}

/// The options of a command, but for those that its function in Python names itself.
std::string typed_dict(const std::string& name, const CommandTree& command,
                       const std::set<std::string>& own) {
  std::string out = "\nclass " + name + "(TypedDict, total=False):\n";
  for (const CommandTree::Option& option : command.options) {
    std::string key = option.name.substr(2);
    if (own.count(key) > 0 || is_for_shells(key)) continue;
    const bool negative = option.kind == ValueKind::flag && key.starts_with("no-");
    if (negative) key = key.substr(3);
    std::replace(key.begin(), key.end(), '-', '_');
    out += "    " + key + ": " + python_type(option) + "  # " + (negative ? "False: " : "") +
           option.help + "\n";
  }
  return out;
}

const CommandTree& command_called(const CommandTree& program, const std::string& name) {
  return *std::find_if(program.commands.begin(), program.commands.end(),
                       [&](const CommandTree& command) { return command.name == name; });
}

}  // namespace

std::string python_options(const CommandTree& program) {
  return "# Made by 'restage completion python': what the functions take as keywords, which are "
         "the "
         "program's options\n# with _ for -.\n"
         "import os\nfrom typing import Literal, Sequence, TypedDict, Union\n\n"
         "Text = Union[str, bytes, os.PathLike[str], os.PathLike[bytes]]\n" +
         typed_dict("RetargetOptions", command_called(program, "retarget"),
                    {"source", "target", "weights", "out"}) +
         typed_dict("SystemOptions", system_options(), {"target", "weights"}) +
         typed_dict("DoctorOptions", command_called(program, "doctor"), {"source"}) +
         typed_dict("TrainOptions", command_called(program, "train"), {});
}

namespace {

Json option_json(const CommandTree::Option& o) {
  constexpr const char* kKinds[] = {"flag", "text", "whole", "number", "number_or_unit"};
  return {{"name", o.name},         {"help", o.help},
          {"value", o.value},       {"kind", kKinds[static_cast<int>(o.kind)]},
          {"choices", o.choices},   {"default", o.default_value},
          {"required", o.required}, {"several", o.several},
          {"formerly", o.formerly}, {"heading", o.heading}};
}

Json command_json(const CommandTree& command) {
  Json options = Json::array(), arguments = Json::array(), commands = Json::array();
  for (const auto& option : command.options) options.push_back(option_json(option));
  for (const auto& argument : command.arguments) arguments.push_back(option_json(argument));
  for (const auto& sub : command.commands) commands.push_back(command_json(sub));
  return {{"name", command.name},          {"help", command.help},
          {"examples", command.examples},  {"arguments", std::move(arguments)},
          {"options", std::move(options)}, {"commands", std::move(commands)}};
}

}  // namespace

std::string json_table(const CommandTree& program) { return command_json(program).dump(1) + "\n"; }

void add_completion(Program& program) {
  const auto shell = std::make_shared<std::string>();
  auto command =
      program.add("completion", "print a script that completes command lines in a shell",
                  "restage completion bash > ~/.local/share/bash-completion/completions/restage\n"
                  "restage completion zsh > ~/.zfunc/_restage\n"
                  "restage completion fish > ~/.config/fish/completions/restage.fish\n"
                  "restage completion python > python/restage/_options.pyi\n"
                  "restage completion json > options.json",
                  [&program, shell] {
                    const std::string script = script_of(*shell, program.tree());
                    print(program.common().json, {{"shell", *shell}, {"script", script}}, script);
                    return 0;
                  });
  command
      .add_option("SHELL", *shell,
                  "bash, zsh or fish; python: a stub of the options of its functions; json: all "
                  "commands and options as data")
      .required()
      .one_of({"bash", "zsh", "fish", "python", "json"});
}

}  // namespace restage::cli
