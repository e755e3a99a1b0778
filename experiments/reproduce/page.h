// The pages of a reproduction: first every claim of a paper with its verdict; then, in a file each,
// its tables with the paper's figures beside ours, and what the paper does not ask.
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
};

/// One experiment with all that was found.
struct Found {
  Evidence evidence;
  tables::Results results;
  std::vector<Judgement> judgements = {};  ///< of its claims, in their order
  std::vector<Drawn> pictures = {};
};

/// Judges every claim, all of them together, and draws every picture; `folder`: where the page will
/// be.
std::vector<Found> found(const std::vector<Evidence>& all, const PageOptions& options,
                         const std::string& folder);

/// The first page, Markdown. `tables`: folder of the experiments' files; `home`: that of the
/// experiments; both seen from the page.
std::string page_markdown(const std::vector<Found>& all, const PageOptions& options,
                          const std::string& tables, const std::string& home);
/// One experiment's file, Markdown. `page`: the first page, `home`: the folder of the experiments;
/// both seen from the file.
std::string table_markdown(const Found& one, const PageOptions& options, const std::string& page,
                           const std::string& home);
nlohmann::ordered_json page_json(const std::vector<Found>& all, const PageOptions& options);

/// Writes FOLDER/PAPER.md and FOLDER/PAPER/NAME.md, .csv, .tex and .svg, beside the pictures.
/// `from`: where the experiments are.
void write_page(const std::vector<Found>& all, const PageOptions& options,
                const std::string& folder, const std::string& from);

}  // namespace restage::reproduce
