// What `restage retarget` says it has recognised.
#pragma once

#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "datasets/importers/motions/skeleton_take.h"
#include "datasets/importers/rigs/gltf_character.h"
#include "nn/geometry/body.h"

namespace restage::cli {

/// A line on a character: "hero.vrm: VRM 1, VRM bones (55), A-pose turned into T-pose, 2 meshes, 4
/// morph targets"; of a rig that is not recognised what is missing. Then remarks; with --verbose
/// all that was found. Nothing for a plain mesh.
void say_target(const TargetMesh& target);
/// The same of a source's skeleton.
void say_take(const SkeletonTake& take);
/// A warning if the networks are unsure of most frames: `confidence` of every frame that has one.
/// Balls, boxes and furniture are told from people so; an arm or a head alone mostly is not.
void warn_if_unsure(const std::string& source, std::vector<double> confidence);

/// Readers name the options of `data import`; those of a source are called otherwise here.
std::string source_words(std::string text);
/// Does `work`, whose InputErrors get these words.
template <class Work>
auto as_source(const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    throw InputError(error.where(), source_words(error.cause()), source_words(error.mend()));
  }
}

/// Counts the points of a source's clouds, to say once whether they are too few for the confidence
/// to be believed.
class SparseWatch {
 public:
  /// Exact repeats count once.
  void add(const Points& cloud);
  size_t clouds() const { return counts_.size(); }
  /// A warning if the median is below kEnoughToTrust.
  void warn(const std::string& source) const;

 private:
  std::vector<size_t> counts_;
};

}  // namespace restage::cli
