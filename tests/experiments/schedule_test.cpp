// The budget `paper` against what the papers print.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "autograd/base/atomic_file.h"
#include "experiments/reproduce/schedule.h"
#include "experiments/reproduce/verdict.h"
#include "nn/config/config_tree.h"
#include "tests/support/files.h"

namespace restage::reproduce {
namespace {

using namespace test;

const std::string kStudies = std::string(RESTAGE_SOURCE_DIR) + "/experiments/studies";

/// Rows of a paper's tables, without what its data would say of hours.
std::vector<Scheduled> planned(const std::string& paper) {
  std::vector<Scheduled> out;
  for (const Evidence& one : find_evidence(kStudies, paper, "", "nowhere")) {
    if (!one.runs()) continue;
    std::vector<std::string> words = one.asked.full.words;
    std::erase_if(words, [](const std::string& w) { return w.starts_with("data.source="); });
    for (std::string& w :
         words)  // a configuration that comes with the program, of which tests know nothing
      if (w.starts_with("base=")) w.insert(5, std::string(RESTAGE_SOURCE_DIR) + "/configs/");
    words.push_back("data.source=not-there.h5");
    for (Scheduled& row : schedule_of(one, "paper", words)) out.push_back(std::move(row));
  }
  return out;
}

/// The figure that a row must have: what is printed, or ours where that is another. Empty: none.
std::string wanted(const ConfigNode& printed, const std::string& key) {
  if (const ConfigNode* ours = printed.find("ours"))
    if (const ConfigNode* value = ours->find(key)) return value->text;
  const ConfigNode* value = printed.find(key);
  return value == nullptr || value->kind != ConfigNode::Kind::scalar ? "" : value->text;
}

TEST(Schedule, ThePapersBudgetIsThePapersSchedule) {
  const std::string file = kStudies + "/printed.yaml";
  const ConfigNode printed = parse_yaml(read_file(file), file);
  for (const ConfigNode& paper : printed.children) {
    std::map<std::string, int> seen;
    for (const Scheduled& row : planned(paper.key)) {
      SCOPED_TRACE(paper.key + ", table " + row.table + ", " + row.row + ", " + row.model);
      const ConfigNode* network = paper.find(row.model);
      ASSERT_NE(network, nullptr) << "not in printed.yaml";
      ++seen[row.model];
      ASSERT_NE(network->find("source"), nullptr);
      for (const auto& [key, value] :
           {std::pair<std::string, double>{"parameters", double(row.parameters)},
            {"steps", double(row.steps)},
            {"batch", double(row.batch)},
            {"rate", row.rate}}) {
        const std::string text = wanted(*network, key);
        // These rows of ours have half or twice of what is printed.
        const bool other = row.row.ends_with("both stages") || row.row == "without offsets";
        if (text.empty() || (other && key == "parameters")) continue;
        EXPECT_DOUBLE_EQ(value, std::stod(text)) << key;
      }
      EXPECT_FALSE(row.hours) << "there are no data to measure with";
    }
    for (const ConfigNode& network : paper.children)
      EXPECT_GT(seen[network.key], 0) << network.key << " is in no table of " << paper.key;
  }
}

/// A rule that the papers' own figures fail would be the wrong rule.
TEST(Schedule, EveryPrintedClaimHoldsByThePrintedFigures) {
  int count = 0;
  for (const char* paper : {"rekik2024", "marsot2023", "chen2023"})
    for (const Evidence& one : find_evidence(kStudies, paper, "", "nowhere")) {
      std::vector<Verdict> verdicts;
      for (const Claim& claim : one.asked.claims)
        verdicts.push_back(printed_verdict(one.asked, claim));
      for (const Sentence& sentence : sentences_of(one.asked.claims, verdicts)) {
        const Verdict verdict = best_reading(sentence);
        if (verdict == Verdict::not_run) continue;  // no figures are printed
        ++count;
        EXPECT_EQ(verdict, Verdict::holds) << one.name << ": " << sentence.says;
      }
    }
  EXPECT_GT(count, 25);
}

}  // namespace
}  // namespace restage::reproduce
