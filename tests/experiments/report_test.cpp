// The report page as text; tests/infer/check_outputs.sh opens it in a browser.
#include <gtest/gtest.h>

#include "experiments/report/page.h"
#include "infer/render/page.h"
#include "tests/infer/toy_clips.h"
#include "tests/support/errors.h"

namespace restage::report {
namespace {

using Curve = std::vector<std::pair<double, double>>;

Curve falling(size_t points, double from) {
  Curve out;
  for (size_t k = 0; k < points; ++k)
    out.emplace_back(10.0 * static_cast<double>(k), from / (1 + static_cast<double>(k)));
  return out;
}

/// Two runs that share a stage, a third with a curve of its own, two sequences.
Report example() {
  Report out;
  out.title = "smooth <b>& quick @DATA@";
  out.before = {{"Results",
                 "Trials: 3 done.\n\n**naked**\n\n| a | PA [m] |\n|---|---:|\n"
                 "| x \\| y | 0.01 [0.009, 0.02] |\n\nmean over\nall\n"}};
  for (const char* name : {"one", "two", "three </script>"}) {
    out.runs.emplace_back().name = name;
    out.runs.back().curves["skeleton.loss"] = falling(50, 3);
  }
  out.runs[2].curves["skeleton.loss"] = falling(1500, 4);
  out.runs[1].curves["motion.loss"] = {{0, 1}, {10, -0.5}, {20, 0.25}};
  auto clips = testing::toy_clips(6);
  clips[1].errors.assign(6, std::vector<float>(clips[1].frames[0].size(), 0.03f));
  for (const char* title : {"best", "worst"})
    out.plays.push_back({title, page_html(clips, {.title = title})});
  out.files = {{"config.yaml", "name: </pre><script>alert(1)</script>\n"}};
  return out;
}

std::string data_of(const std::string& page) {
  const size_t open = page.find("<script id=\"data\""), start = page.find('>', open) + 1;
  return page.substr(start, page.find("</script>", start) - start);
}

TEST(Report, IsOneFileThatAsksForNothing) {
  const std::string made = page(example());
  testing::keep("report.html", made);
  for (const char* word : {"https:", "src=", "href=", "@import", "url(", "fetch(", "import(",
                           "XMLHttp", "WebSocket", "<script>alert", "three </script>"})
    EXPECT_EQ(made.find(word), std::string::npos) << word;
  EXPECT_HAS(made, "smooth &lt;b&gt;&amp; quick @DATA@");
  EXPECT_EQ(made, page(example()));
}

TEST(Report, TablesOfOurCommandsAreTables) {
  const std::string made = page(example());
  EXPECT_HAS(made, "<h3>naked</h3>");
  EXPECT_HAS(made, "<tr><th>a</th><th>PA [m]</th></tr>");
  EXPECT_HAS(made, "<tr><td>x | y</td><td>0.01 [0.009, 0.02]</td></tr>");
  EXPECT_HAS(made, "<p>mean over\nall</p>");
}

TEST(Report, SharedCurvesAreDrawnOnceAndLongOnesThinned) {
  const auto data = nlohmann::json::parse(data_of(page(example())));
  ASSERT_EQ(data["curves"].size(), 2u);
  EXPECT_EQ(data["curves"][0]["name"], "motion.loss");
  const auto& shared = data["curves"][1]["series"];
  ASSERT_EQ(shared.size(), 2u);
  EXPECT_EQ(shared[0]["runs"], (std::vector<int>{0, 1}));
  const auto& thinned = shared[1]["points"];
  EXPECT_EQ(thinned[0].size(), 1000u);
  EXPECT_EQ(thinned[0].front(), 0);
  EXPECT_EQ(thinned[0].back(), 14990) << "the last point stays";
  EXPECT_EQ(thinned[1].size(), 1000u);
}

TEST(Report, WithoutCurvesAndSequencesThereAreNoSuchSections) {
  const std::string made = page({.title = "nothing"});
  EXPECT_EQ(made.find("<h2>"), std::string::npos);
}

}  // namespace
}  // namespace restage::report
