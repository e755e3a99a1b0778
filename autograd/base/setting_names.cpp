#include "autograd/base/setting_names.h"

#include <algorithm>
#include <atomic>

namespace restage {
namespace {

std::string as_variable(std::string_view name) {
  std::string out(name);
  std::replace(out.begin(), out.end(), '-', '_');
  return out;
}

std::atomic<SettingSpeller> chosen{as_variable};

bool is_name(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(),
                                      [](char c) { return (c >= 'a' && c <= 'z') || c == '-'; });
}

}  // namespace

void spell_settings(SettingSpeller speller) { chosen = speller; }

std::string spelled(const std::string& text) {
  std::string out;
  size_t at = 0;
  for (size_t open = text.find('{'); open != std::string::npos; open = text.find('{', open + 1)) {
    const size_t close = text.find('}', open);
    if (close == std::string::npos) break;
    const std::string_view name = std::string_view(text).substr(open + 1, close - open - 1);
    if (!is_name(name)) continue;
    out += text.substr(at, open - at) + chosen.load()(name);
    at = close + 1;
  }
  return out + text.substr(at);
}

}  // namespace restage
