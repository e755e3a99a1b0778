// The search for motions in the tree of a file's values; estimated.h says what is found.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "datasets/importers/motions/estimated.h"
#include "datasets/readers/errors.h"

namespace restage::estimated_detail {

using Arrays = std::map<std::string, SharedArray>;

/// What an estimator calls where its camera saw somebody.
constexpr const char* kCameraNames[] = {"pred_cam", "pred_cam_t", "orig_cam", "cam"};

/// A motion that was found, and what decides which goes first.
struct Found {
  EstimatedMotion motion;
  int rank = 1;            ///< 0: in the world, 1: nobody says, 2: as a camera sees it
  bool by_frames = false;  ///< put together from values that the file has frame by frame
};

/// Arrays of one moment, and who they are of.
struct Moment {
  std::string person;
  Arrays arrays;
};

class Finder {
 public:
  Finder(const ValueTree& tree, uint64_t max_memory) : tree_(tree), max_memory_(max_memory) {}
  std::vector<Found> find();
  /// Why something that looks like a motion is none.
  const std::optional<InputError>& fault() const { return fault_; }

 private:
  using Id = ValueTree::Id;
  using Kind = ValueTree::Kind;
  /// Where the search is: what the values above say of all below.
  struct Where {
    std::string place, person;
    Arrays above;
    int depth = 0;
  };
  struct Child {
    std::string name;
    Id map;
  };

  void count_look();
  SharedArray gathered(Id id, int depth = 0);
  SharedArray list_of_numbers(Id id);
  std::map<std::string, Arrays> groups_of(Id map);
  std::vector<Child> children_of(Id id);
  void look(Id id, const Where& where);
  void look_at_children(const std::vector<Child>& children, const Where& where, const Arrays& here);
  void add_group(const std::string& prefix, const Arrays& own, const Where& where);
  void add(const std::string& person, const std::string& place, Arrays arrays, bool by_frames,
           std::vector<size_t> missing = {});
  bool split_people(const std::string& place, const Arrays& arrays);

  bool are_frames(const std::vector<Child>& children);
  std::vector<Moment> moments_of(Id frame);
  void add_frames(const std::vector<Child>& frames, const Where& where);

  const ValueTree& tree_;
  uint64_t max_memory_;
  size_t looks_ = 0;
  std::vector<Found> found_;
  std::optional<InputError> fault_;
};

/// A name as a place and a parameter's: "smpl_params_global", "body_pose".
struct NameParts {
  std::string place, name;
};
/// The ways to part it, the longest parameter's name first; none if there is no parameter's in it.
std::vector<NameParts> name_parts(const std::string& name);

/// Frames that the rotations of these arrays have; 0 without any.
int64_t frames_of(const Arrays& arrays);

/// Whether an array of this name says which frames of the video the poses are of.
bool numbers_frames(const std::string& name);
/// Where such an array leaves frames out: those are missing in `hints`, with a remark, and the pose
/// before stands in for each. InputError naming `path`: numbers too far apart.
void fill_left_out(Arrays& arrays, ParameterHints& hints, const std::string& path);

}  // namespace restage::estimated_detail
