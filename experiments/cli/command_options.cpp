#include "experiments/cli/command_options.h"

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdint>
#include <map>
#include <optional>
#include <type_traits>

#include "autograd/base/format.h"

namespace restage::cli {

namespace {

std::string written(const std::string& value) { return value; }
std::string written(double value) { return format("%g", value); }
std::string written(int value) { return std::to_string(value); }
std::string written(int64_t value) { return std::to_string(value); }
std::string written(uint64_t value) { return std::to_string(value); }
template <class T>
std::string written(const std::optional<T>& value) {
  return value ? written(*value) : "";
}
template <class T>
std::string written(const std::vector<T>& values) {
  std::string out;
  for (const T& value : values) out += (out.empty() ? "" : ",") + written(value);
  return out;
}

template <class T>
struct One {
  using type = T;
};
template <class T>
struct One<std::vector<T>> {
  using type = T;
};
template <class T>
struct One<std::optional<T>> {
  using type = T;
};

template <class T>
constexpr ValueKind kind_of_value() {
  using V = typename One<T>::type;
  return std::is_same_v<V, std::string> ? ValueKind::text
         : std::is_same_v<V, double>    ? ValueKind::number
                                        : ValueKind::whole;
}

/// A word without a name that may be missing needs no "(default: none)".
std::string with_default(const OptionFacts& facts, bool named) {
  if (facts.kind == ValueKind::flag || facts.help.find("(default: ") != std::string::npos)
    return facts.help;
  if (facts.default_value.empty() && !named) return facts.help;
  return facts.help + " (default: " + (facts.default_value.empty() ? "none" : facts.default_value) +
         ")";
}

}  // namespace

Option& Option::required() {
  option_->required();
  option_->description(facts_->help);
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

Option& Option::formerly(const std::string& name) {
  facts_->formerly.push_back(name);
  return *this;
}

Option& Option::one_of(std::vector<std::string> words) {
  option_->check(CLI::IsMember(std::move(words)));
  return *this;
}

Option& Option::suggest(std::vector<std::string> words) {
  facts_->suggestions = std::move(words);
  return *this;
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
  return keep(app_->add_option(names, value), {help, kind_of_value<T>(), written(value), {}, {}});
}

Option CommandOptions::add_flag(const std::string& names, bool& value, const std::string& help) {
  return keep(app_->add_flag(names, value), {help, ValueKind::flag, "", {}, {}});
}

Option CommandOptions::add_text(const std::string& name,
                                std::function<void(const std::string&)> read,
                                const std::string& help, ValueKind kind) {
  return keep(app_->add_option_function<std::string>(name, read), {help, kind, "", {}, {}});
}

Option CommandOptions::keep(CLI::Option* option, OptionFacts facts) {
  OptionFacts& kept = (*table_)[option] = std::move(facts);
  option->description(with_default(kept, option->nonpositional()));
  return {option, kept};
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
RESTAGE_OPTION_OF(std::vector<int>)
RESTAGE_OPTION_OF(std::vector<int64_t>)
RESTAGE_OPTION_OF(std::vector<double>)
#undef RESTAGE_OPTION_OF

}  // namespace restage::cli
