#include "experiments/reproduce/paper_file.h"

#include <algorithm>
#include <set>

#include "autograd/base/atomic_file.h"
#include "autograd/base/nearest.h"
#include "nn/config/config_reader.h"
#include "nn/metrics/metrics.h"

namespace restage::reproduce {
namespace {

Rule metric_names() {
  std::vector<std::string> names;
  for (const metrics::Metric& metric : metrics::recorded()) names.emplace_back(metric.name);
  return one_of(names);
}

}  // namespace

template <class V>
void visit(V& v, PaperRow& c) {
  v("row", c.row, "label of the sweep's row", required());
  v("printed_as", c.printed_as, "name in the paper");
  v("printed", c.printed, "figures of the paper");
  v("not_run", c.not_run, "why there is no such row here");
}

template <class V>
void visit(V& v, PaperTable& c) {
  v("set", c.set, "of sequences", required());
  v("rows", c.rows, "of the table", required());
}

template <class V>
void visit(V& v, Claim& c) {
  v("says", c.says, "the paper's words", required());
  v("where", c.where, "place in the paper", required());
  v("better", c.better, "row that has less", required());
  v("than", c.than, "row that it is compared with", required());
  v("metrics", c.metrics, "compared", metric_names());
  v("within", c.within, "they differ by less than this, either way", positive());
  v("no_better_by", c.no_better_by, "'better' gains less than this; it may be worse", positive());
  v.check("no_better_by", !c.within || !c.no_better_by, "and 'within' are two different claims",
          "give one of them");
  v("most", c.most, "three quarters of the comparisons will do");
  v("reading", c.reading, "which reading of the sentence this is");
  v("tried", c.tried, "what was tried where it does not hold");
  v.check("than", c.better != c.than, "names one row twice", "name two rows");
}

template <class V>
void visit(V& v, Picture& c) {
  v("says", c.says, "the line under it", required());
  v("set", c.set, "of the benchmark", required(one_of({"naked", "clothed", "scans"})));
  v("sequence", c.sequence, "of the set");
  v("worst", c.worst, "in its place, so many on which the first row is farthest off",
    between(0, 20));
  v("moments", c.moments, "seconds", at_least(0));
  v("rows", c.rows, "drawn between source and truth", required());
  v("azimuth", c.azimuth, "degrees from the front towards the body's left", between(-360, 360));
  v.check("sequence", c.sequence.empty() == (c.worst > 0), "and 'worst' are one or the other",
          "name a sequence, or say how many of the worst");
}

template <class V>
void visit(V& v, Budget& c) {
  v("sweep", c.sweep, "its sweep file in the folder");
  v("words", c.words, "key=value of the sweep");
  v("set", c.set, "measured in the place of the paper's");
  v("note", c.note, "what a reader must know");
}

template <class V>
void visit(V& v, PaperFile& c) {
  v("paper", c.paper, "name of the paper", required());
  v("table", c.table, "its place in the paper", required());
  v("title", c.title, "what it is about", required());
  v("metrics", c.metrics, "printed", required(metric_names()));
  v("beside", c.beside, "further metrics shown of ours", metric_names());
  v("tables", c.tables, "printed", required());
  v("claims", c.claims, "what the paper says of them");
  v("contradicted", c.contradicted, "sentences that the paper's own figures contradict");
  v("pictures", c.pictures, "of rows at the same moments");
  v("smoke", c.smoke, "minutes");
  v("lite", c.lite, "hours");
  v("full", c.full, "the paper's own schedule");
}

namespace {

/// Conditions over several values.
class Checker {
 public:
  Checker(const ConfigNode& root, const PaperFile& file) : root_(root), file_(file) {}

  void check() {
    if (file_.tables.empty())
      throw config_error(root_, "tables", "'tables' is empty", "name one set with its rows");
    for (size_t t = 0; t < file_.tables.size(); ++t) check_table(t);
    for (size_t c = 0; c < file_.claims.size(); ++c)
      for (const auto& [key, row] :
           {std::pair{"better", &file_.claims[c].better}, std::pair{"than", &file_.claims[c].than}})
        check_row("claims." + std::to_string(c) + "." + key, *row);
    for (size_t p = 0; p < file_.pictures.size(); ++p) {
      const std::string at = "pictures." + std::to_string(p) + ".rows";
      if (file_.pictures[p].rows.empty())
        throw config_error(root_, at, "'rows' is empty", "name one of the tables' rows");
      for (size_t r = 0; r < file_.pictures[p].rows.size(); ++r)
        check_row(at + "." + std::to_string(r), file_.pictures[p].rows[r]);
    }
  }

 private:
  void check_row(const std::string& at, const std::string& row) const {
    if (rows_.contains(row)) return;
    const std::string close = nearest(row, {rows_.begin(), rows_.end()});
    throw config_error(
        root_, at, in_quotes(row) + " is no row of the tables",
        close.empty() ? "name one of their rows" : "did you mean " + in_quotes(close) + "?");
  }

  void check_table(size_t t) {
    std::set<std::string> here;
    const std::string path = "tables." + std::to_string(t) + ".rows";
    for (size_t r = 0; r < file_.tables[t].rows.size(); ++r) {
      const PaperRow& row = file_.tables[t].rows[r];
      const std::string at = path + "." + std::to_string(r);
      if (!here.insert(row.row).second)
        throw config_error(root_, at + ".row", in_quotes(row.row) + " stands here twice",
                           "keep one");
      rows_.insert(row.row);
      if (!row.printed.empty() && row.printed.size() != file_.metrics.size())
        throw config_error(root_, at + ".printed",
                           "has " + std::to_string(row.printed.size()) + " figures for " +
                               std::to_string(file_.metrics.size()) + " metrics",
                           "give one for each, null where the paper has none");
    }
  }

  const ConfigNode& root_;
  const PaperFile& file_;
  std::set<std::string> rows_;
};

}  // namespace

const Budget& PaperFile::budget(const std::string& name) const {
  return name == kBudgets[0] ? smoke : name == kBudgets[1] ? lite : full;
}

bool PaperFile::none_runs() const {
  return std::all_of(tables.begin(), tables.end(), [](const PaperTable& printed) {
    return std::all_of(printed.rows.begin(), printed.rows.end(),
                       [](const PaperRow& row) { return !row.not_run.empty(); });
  });
}

PaperFile read_paper_file(const std::string& path) {
  const ConfigNode root = parse_yaml(read_file(path, kConfigMaxBytes), path);
  PaperFile out;
  read_config(root, out);
  Checker(root, out).check();
  return out;
}

}  // namespace restage::reproduce
