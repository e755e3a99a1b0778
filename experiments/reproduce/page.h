// The page of a reproduction: every table of a paper with its figures beside ours, a verdict for
// every claim, and what the paper does not ask.
#pragma once

#include <string>
#include <vector>

#include "experiments/reproduce/evidence.h"
#include "experiments/reproduce/pictures.h"
#include "experiments/reproduce/verdict.h"

namespace restage::reproduce {

struct PageOptions {
  std::string paper, budget;
  std::vector<std::string> command;  ///< that makes the page again, word by word
  uint64_t seed = 0;                 ///< of the resampling
};

/// One experiment with all that was found.
struct Found {
  Evidence evidence;
  tables::Results results;
  std::vector<Judgement> judgements = {};  ///< of its claims, in their order
  std::vector<Drawn> pictures = {};
};

/// Judges every claim and draws every picture; `folder`: where the page will be.
Found found(const Evidence& evidence, const PageOptions& options, const std::string& folder);

/// Markdown. `tables`: folder of each experiment's CSV, LaTeX and SVG, seen from the page; `home`:
/// the clone's folder, seen from the page.
std::string page_markdown(const std::vector<Found>& all, const PageOptions& options,
                          const std::string& tables, const std::string& home);
nlohmann::ordered_json page_json(const std::vector<Found>& all, const PageOptions& options);

/// Writes FOLDER/PAPER.md and FOLDER/PAPER/NAME.csv, .tex and .svg, beside the pictures. `from`:
/// where the experiments are.
void write_page(const std::vector<Found>& all, const PageOptions& options,
                const std::string& folder, const std::string& from);

}  // namespace restage::reproduce
