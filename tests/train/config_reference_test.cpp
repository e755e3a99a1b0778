// docs/config_reference.md is written by hand: it must name every key with its true default, and
// no other key.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>

#include "nn/config/config.h"
#include "train/stages/train_config.h"

namespace restage {
namespace {

/// Key as the page has it: what several stages share stands there once, without the stage.
std::string on_the_page(const std::string& key) {
  std::string out = std::regex_replace(key, std::regex("^\\w+\\.discriminator_adam\\."), "adam.");
  for (const char* shared : {".optimiser.", ".sizes."})
    if (const size_t at = out.find(shared); at != std::string::npos)
      out = out.substr(at + std::string(shared).size());
  return out;
}

bool same_value(const std::string& a, const std::string& b) {
  char *end_a = nullptr, *end_b = nullptr;
  const double x = std::strtod(a.c_str(), &end_a), y = std::strtod(b.c_str(), &end_b);
  const bool numbers = end_a != a.c_str() && end_b != b.c_str() && *end_a == 0 && *end_b == 0;
  return numbers ? x == y : a == b;
}

TEST(ConfigReferencePage, NamesEveryKeyWithItsDefault) {
  std::ifstream file(RESTAGE_SOURCE_DIR "/docs/config_reference.md");
  ASSERT_TRUE(file) << "docs/config_reference.md is missing";
  const std::regex row("^\\| `([^`]+)` \\| [^|]+ \\| `?([^|`]*)`? \\|.*");
  std::multimap<std::string, std::string> page;
  std::smatch found;
  for (std::string line; std::getline(file, line);)
    if (std::regex_match(line, found, row)) page.emplace(found[1], found[2]);

  std::set<std::string> keys;
  for (const ConfigReference::Row& wanted : config_reference<TrainConfig>()) {
    const std::string key = page.contains(wanted.key) ? wanted.key : on_the_page(wanted.key);
    keys.insert(key);
    if (wanted.type == "section" && page.count(key) == 0 && key != wanted.key) continue;
    EXPECT_EQ(page.count(key), 1u) << wanted.key;
    for (auto [at, end] = page.equal_range(key); at != end; ++at)
      EXPECT_TRUE(same_value(at->second, wanted.value))
          << wanted.key << ": the page says '" << at->second << "', the code '" << wanted.value
          << "'";
  }
  for (const auto& [key, value] : page) EXPECT_TRUE(keys.contains(key)) << key << " is no key";
}

}  // namespace
}  // namespace restage
