// paper.yaml: what a paper prints about one experiment, and what it claims from it, beside the
// sweep.yaml that runs the experiment here (docs/reproduction.md).
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace restage::reproduce {

/// A row of a printed table.
struct PaperRow {
  std::string row;                             ///< label of the sweep's row, mostly its case
  std::string printed_as;                      ///< its name in the paper
  std::vector<std::optional<double>> printed;  ///< in the order of the metrics, in their units
  std::string not_run;                         ///< why there is no such row here; empty: there is
};

struct PaperTable {
  std::string set;  ///< of sequences, as the sweep's results name it
  std::vector<PaperRow> rows;
};

/// A sentence of the paper as comparisons: on each metric and set, `better` has less than `than`.
struct Claim {
  std::string says;   ///< in the paper's words
  std::string where;  ///< in the paper
  std::string better, than;
  std::vector<std::string> metrics;  ///< empty: those of the tables
  // Other claims than an order; a margin is in the metrics' unit. At most one of the two is given.
  std::optional<double> within;        ///< the two differ by less than this, either way
  std::optional<double> no_better_by;  ///< `better` gains less than this; it may be worse
  bool most = false;                   ///< "almost all": three quarters of the comparisons will do
  std::string reading;                 ///< which of several readings of the sentence this is
  std::string tried;                   ///< what was tried where it does not hold
};

/// What rows make of sequences of the benchmark, at the same moments (pictures.h).
struct Picture {
  std::string says;               ///< the line under it
  std::string set;                ///< of the benchmark: naked, clothed or scans
  std::string sequence;           ///< of the set
  int worst = 0;                  ///< in its place: those on which the first row is farthest off
  std::vector<double> moments;    ///< seconds; empty: six, evenly spread
  std::vector<std::string> rows;  ///< of the tables
  double azimuth = 32;            ///< degrees from the front towards the body's left
};

/// What a budget adds to the sweep.
struct Budget {
  std::string sweep = "sweep.yaml";  ///< its file in the folder, where rows are not those of others
  std::vector<std::string> words;    ///< as `restage sweep run` takes them
  std::string set;                   ///< measured in the place of the paper's sets; empty: those
  std::string note;                  ///< what a reader of its figures must know
};

inline constexpr const char* kBudgets[] = {"smoke", "lite", "paper"};

struct PaperFile {
  std::string paper;  ///< such as rekik2024
  std::string table;  ///< what --table selects: "4", "section 4.4"
  std::string title;
  std::vector<std::string> metrics;  ///< METRIC; those of the printed figures
  std::vector<std::string> beside;   ///< further ones that are shown of ours
  std::vector<PaperTable> tables;
  std::vector<Claim> claims;
  std::vector<std::string> contradicted;  ///< sentences that the paper's own figures contradict
  std::vector<Picture> pictures;
  Budget smoke, lite, full;

  const Budget& budget(const std::string& name) const;
  /// Nothing of it runs here.
  bool none_runs() const;
};

/// InputError at file and line: unknown keys and metrics, rows with too many or too few figures,
/// rows that stand twice, claims about rows and pictures of rows that are not there.
PaperFile read_paper_file(const std::string& path);

}  // namespace restage::reproduce
