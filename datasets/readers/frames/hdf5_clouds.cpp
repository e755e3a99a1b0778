#include "datasets/readers/frames/hdf5_clouds.h"

#include <algorithm>

#include "datasets/readers/arrays/body_parameters.h"
#include "datasets/readers/arrays/npz.h"
#include "datasets/readers/clouds/cloud_axes.h"
#include "datasets/readers/clouds/cloud_names.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/frame_names.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

constexpr int kGroupDepth = 6;        // of groups that are looked into
constexpr size_t kMostSets = 200000;  // a frame each

/// All that has the shape of a cloud or a sequence.
class Finder {
 public:
  /// `vertices`: how many there are, if the file says it; else 0.
  explicit Finder(const h5::File& file, int64_t vertices = 0) : file_(file), vertices_(vertices) {
    walk("", 0);
  }

  bool any() const { return !found_.empty(); }

  std::vector<Hdf5Sequence> find() const {
    if (file_.has("/bodies") || file_.has("/motions"))
      throw InputError(file_.path(), "holds bodies or motions, not scans",
                       "restage data perform makes scans of them");
    std::vector<std::string> sequences, clouds, left_out = others_;
    for (const Candidate& one : found_) {
      if (one.rank > best_)
        left_out.push_back(one.name);
      else
        (one.sequence ? sequences : clouds).push_back(one.name);
    }
    std::vector<Hdf5Sequence> out;
    out.reserve(sequences.size());
    for (const std::string& name : sequences) out.push_back({{name}, {}});
    if (out.empty() && !clouds.empty()) out.push_back(series(clouds));
    if (out.empty()) throw_no_clouds();
    if (!sequences.empty()) left_out.insert(left_out.end(), clouds.begin(), clouds.end());
    if (!left_out.empty())
      out[0].remarks.push_back(cat("clouds are taken from ", text::quote(out[0].sets[0]),
                                   out.size() > 1 ? " and others" : "",
                                   "; left out: " + list_of(left_out)));
    return out;
  }

 private:
  struct Candidate {
    std::string name;
    bool sequence;
    size_t rank;  ///< cloud_rank(); of other names kUnnamed
  };
  static constexpr size_t kUnnamed = 1000;

  /// Says what the file holds instead.
  [[noreturn]] void throw_no_clouds() const {
    std::vector<std::string> last;
    for (const std::string& name : all_) last.push_back(name.substr(name.rfind('/') + 1));
    const BodyParameters parameters = body_parameters(last);
    if (parameters.moves() || !parameters.body.empty() || !parameters.orient.empty())
      throw InputError(
          file_.path(),
          cat("holds a motion of a body model (its data sets: ", list_of(all_), "), not clouds"),
          "save these data sets as an NPZ (numpy.savez) with the same names; restage "
          "data import FILE.npz --body-model MODEL --out M.h5 reads it");
    for (const std::string& name : all_)
      if (!is_no_cloud(name, true)) refuse_flat_set(file_.dataset(name));
    throw InputError(
        file_.path() + ":/points", "is missing, and so is /vertices",
        "give a file of scans (/points, /frame_offset) or surfaces (/vertices [F, V, 3])");
  }

  void walk(const std::string& group, int depth) {
    for (const std::string& child : file_.children(group.empty() ? "/" : group)) {
      const std::string name = group + "/" + child;
      if (found_.size() >= kMostSets)
        throw InputError(file_.path(), cat("holds more than ", kMostSets, " data sets of points"),
                         "split it");
      if (!file_.is_group(name))
        consider(name, child);
      else if (depth + 1 < kGroupDepth && !child.starts_with("#"))  // MATLAB's own
        walk(name, depth + 1);
    }
  }

  void consider(const std::string& name, const std::string& child) {
    try {
      const h5::Dataset set = file_.dataset(name);
      if (set.type() == h5::Type::text) return;
      if (all_.size() < kMostListed) all_.push_back(name);
      const auto axes = cloud_axes(set.shape(), vertices_);
      if (!axes) return;
      if (is_no_cloud(child, !axes->sequence)) {
        if (set.type() == h5::Type::floating) others_.push_back(name);
        return;
      }
      const size_t rank = cloud_rank(child).value_or(kUnnamed);
      found_.push_back({name, axes->sequence, rank});
      best_ = std::min(best_, rank);
    } catch (const InputError&) {
      // Nothing that can be read, so no cloud.
    }
  }

  /// Single clouds are the frames of a sequence if their names are a series.
  Hdf5Sequence series(const std::vector<std::string>& clouds) const {
    if (clouds.size() == 1) return {clouds, {}};
    std::vector<std::string> names;
    for (std::string name : clouds) {
      std::replace(name.begin(), name.end(), '/', ' ');
      names.push_back(name);
    }
    FrameList list = order_members(names, file_.path());
    if (list.files.empty())
      throw InputError(file_.path(), "holds several arrays of points: " + list_of(clouds),
                       "keep one, or name the frames' groups or data sets by numbers");
    Hdf5Sequence out{{}, list.remarks};
    for (std::string& name : list.files) {
      const auto at = std::find(names.begin(), names.end(), name);
      out.sets.push_back(clouds[static_cast<size_t>(at - names.begin())]);
    }
    return out;
  }

  static constexpr size_t kMostListed = 64;

  const h5::File& file_;
  int64_t vertices_;
  std::vector<std::string> all_;  ///< data sets of numbers, the first of them
  std::vector<Candidate> found_;
  std::vector<std::string> others_;  ///< of the shape of clouds, by their names none
  size_t best_ = kUnnamed;
};

}  // namespace

void refuse_flat_set(const h5::Dataset& set) {
  if (const auto mend = flat_mend(set.shape()))
    throw InputError(set.where(),
                     cat("is a flat data set ", shape_text(set.shape()), ", and no cloud"), *mend);
}

std::vector<Hdf5Sequence> find_clouds(const h5::File& file, int64_t vertices) {
  return Finder(file, vertices).find();
}

bool has_clouds(const h5::File& file) { return Finder(file).any(); }

}  // namespace restage
