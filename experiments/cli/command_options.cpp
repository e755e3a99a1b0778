#include "experiments/cli/command_options.h"

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdint>
#include <map>
#include <optional>

namespace restage::cli {

Option& Option::required() {
  option_->required();
  return *this;
}

Option& Option::one_at_a_time() {
  option_->allow_extra_args(false);
  return *this;
}

Option& Option::separated_by(char separator) {
  option_->delimiter(separator);
  return *this;
}

Option& Option::count(int values) {
  option_->expected(values);
  return *this;
}

Option& Option::show_default() {
  option_->capture_default_str();
  return *this;
}

Option& Option::one_of(std::vector<std::string> words) {
  option_->check(CLI::IsMember(std::move(words)));
  return *this;
}

namespace {
std::map<const CLI::Option*, std::vector<std::string>>& all_suggestions() {
  static std::map<const CLI::Option*, std::vector<std::string>> all;
  return all;
}
}  // namespace

Option& Option::suggest(std::vector<std::string> words) {
  all_suggestions()[option_] = std::move(words);
  return *this;
}

const std::vector<std::string>& suggestions(const CLI::Option* option) {
  return all_suggestions()[option];
}

Option& Option::check(std::function<std::string(const std::string&)> fault) {
  option_->check(std::move(fault));
  return *this;
}

Option& Option::group(const std::string& heading) {
  option_->group(heading);
  return *this;
}

template <class T>
Option CommandOptions::add_option(const std::string& names, T& value, const std::string& help) {
  return Option(app_->add_option(names, value, help));
}

Option CommandOptions::add_flag(const std::string& names, bool& value, const std::string& help) {
  return Option(app_->add_flag(names, value, help));
}

Option CommandOptions::add_text(const std::string& name,
                                std::function<void(const std::string&)> read,
                                const std::string& help) {
  return Option(app_->add_option_function<std::string>(name, read, help));
}

#define RESTAGE_OPTION_OF(...) \
  template Option CommandOptions::add_option(const std::string&, __VA_ARGS__&, const std::string&);
RESTAGE_OPTION_OF(std::string)
RESTAGE_OPTION_OF(int)
RESTAGE_OPTION_OF(int64_t)
RESTAGE_OPTION_OF(uint64_t)
RESTAGE_OPTION_OF(double)
RESTAGE_OPTION_OF(std::optional<std::string>)
RESTAGE_OPTION_OF(std::optional<int64_t>)
RESTAGE_OPTION_OF(std::optional<double>)
RESTAGE_OPTION_OF(std::vector<std::string>)
RESTAGE_OPTION_OF(std::vector<int64_t>)
RESTAGE_OPTION_OF(std::vector<double>)
#undef RESTAGE_OPTION_OF

}  // namespace restage::cli
