// One self-contained HTML page that shows what trainings did: no network, opens from disk, readable
// on a telephone.
#pragma once

#include <string>
#include <vector>

#include "experiments/sweep/compare.h"

namespace restage::report {

struct Section {
  std::string title;
  std::string text;          ///< paragraphs and tables as our commands print them (Markdown)
  std::string picture = {};  ///< an SVG document of ours, shown below the text
  /// Shown as they are, folded open: titles and texts.
  std::vector<std::pair<std::string, std::string>> quoted = {};
};

/// A sequence that can be played: a page of infer/render/page.h.
struct Play {
  std::string title, page;
};

struct Report {
  std::string title;
  std::vector<Section> before = {}, after = {};  ///< of the curves and the sequences
  std::vector<tables::Compared> runs = {};       ///< whose curves are drawn
  std::vector<Play> plays = {};
  std::vector<std::pair<std::string, std::string>> files =
      {};                   ///< shown whole, folded: name and text
  bool unfinished = false;  ///< a sweep with trials that run or are to come
  int refresh = 0;          ///< seconds after which a browser reads the page again; 0: never
};

/// The page as text. Curves with more than 1,000 points are thinned evenly, and it says so. Equal
/// curves of several runs, such as those of a stage that they share, are drawn once.
std::string page(const Report& report);

}  // namespace restage::report
