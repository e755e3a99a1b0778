// The doctor: what a scan, a mesh or a sequence of frames is, what is wrong with it, and the
// transform that mends it. Geometry and one table of coefficients (orientation_model.h); no
// network. What cannot be told is said to be unsure, never guessed: left and right of a body look
// alike, so a mirrored scan cannot be told from a right one (check_handedness() needs joints).
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>

#include "datasets/doctor/finding.h"
#include "datasets/doctor/shape.h"
#include "datasets/readers/frames/frame_folder.h"

namespace restage {

/// Of --scale: nanometres to thousands of kilometres.
inline constexpr double kLeastScale = 1e-9, kMostScale = 1e6;

struct ExamineOptions {
  bool target = false;  ///< it is meant as a target: T-pose and facing +z are then a must
  // What the user knows better; the rest is still found.
  std::optional<double> scale;    ///< metres per unit
  std::optional<int> up, facing;  ///< indices of kDirections
  std::optional<double> fps;      ///< of a sequence
  // What the file says, which beats what its shape looks like.
  /// Of a rig, in our frame: unit, up, facing and pose are those of its joints.
  std::optional<Joints> joints;
  bool any_pose = false;  ///< a target is put into T-pose later
  bool y_up = false;      ///< it is a rigged figure of a format whose y axis is up
};

struct Diagnosis {
  std::string kind;  ///< "cloud", "mesh" or "frames"
  int64_t frames = 1, sequences = 1, faces = 0, fewest_points = 0, most_points = 0;
  int64_t shown = 0;  ///< the frame (from 0) that shows the worst of it
  double fps = 0;     ///< of a sequence
  double size = 0;  ///< median distance of a person's points from their middle, in the data's units
  UnitGuess unit;
  Orientation orientation;
  double height = 0;  ///< metres from the floor to the top in the pose (of a sequence: the tallest)
  std::vector<Finding> findings;
  /// Into our frame; nothing if up axis or units cannot be told.
  std::optional<Similarity> transform;
  double turned = 0;           ///< degrees about the vertical that it turns beyond whole quarters
  int keep_every = 1;          ///< every frame is there this many times in a row
  std::set<int64_t> repeated;  ///< frames equal to the one before (from 0)
  std::map<int64_t, int64_t> gap;  ///< before frame (from 0): so many frames are missing

  int odd_front = 0;  ///< so many first frames are of another size than the rest

  /// Whether frames without points are put where so many are missing: up to a minute of them.
  bool is_kept(int64_t missing) const { return static_cast<double>(missing) <= 60 * fps; }
  /// Settings in `what` and `fix` are named as {fps} (setting_names.h).
  void say(Finding finding) {
    finding.what = spelled(finding.what);
    finding.fix = spelled(finding.fix);
    findings.push_back(std::move(finding));
  }
  bool usable() const;  ///< no finding that makes the result nonsense
  const Finding* find(const std::string& topic) const;
};

/// One cloud or surface.
Diagnosis examine_surface(const Mesh& mesh, const ExamineOptions& options = {});

/// All frames, one at a time, in memory that grows by some hundred bytes a frame. `source` is read
/// to its end; `target` is of no consequence. InputError for a frame that cannot be read.
Diagnosis examine_frames(FrameSource& source, const ExamineOptions& options = {});

/// A frame without stray points and what is not the person, without repeated points (of a cloud),
/// and in our frame. Of a surface only whole pieces are left out; the order of the rest stays.
/// `person`: where the person was in the frame before, in the data's units and axes (nothing: this
/// is the first), which is then who is kept; where they are now is left there.
Mesh mended(const Mesh& mesh, const Diagnosis& diagnosis, std::optional<Point>* person = nullptr);

/// That the reader left points out because a coordinate is NaN or infinite, as retargeting does
/// with those of a source; it refuses those of a target. `where` is added to the sentence.
Finding non_finite(size_t points, const std::string& where, bool target = false);

/// What is said of points that are the path of one point (readers/clouds/point_path.h), and what to
/// do.
inline constexpr const char* kPath =
    "the points are places of one moving point, such as somebody's root, and no surface";
inline constexpr const char* kPathFix = "give clouds of a whole person";

/// The unit of skeletons, by the lengths of their bones, which no pose changes.
Finding examine_skeletons(const std::vector<Joints>& frames);

/// Whether the joints named left are on the left of somebody whose toes point forwards: "right",
/// "mirrored", or nothing if the feet do not tell. `up` is a unit vector.
inline constexpr const char* kMirrored = "left and right are exchanged: a mirror image";
inline constexpr const char* kMirroredBecause =
    "with toes forwards, the joints named left are on the right";
inline constexpr const char* kMirroredFix =
    "mirror it (x to -x) where it was made, or exchange the names";
std::optional<bool> is_mirrored(const Joints& joints, const Vec3& up = Vec3::UnitY());

/// How a source was read: metres per unit, and which of its axes points up (parse_axis(),
/// importers/motions/axis.h; not "auto").
struct SourceFrame {
  double scale = 1;
  std::string up = "y";
  bool up_known = false;  ///< somebody said so: what the clouds look like is then a warning
};

/// Cheap checks before retargeting. Both throw an InputError for what the doctor finds wrong: its
/// words are the doctor's, and `where` names the input. What is only perhaps wrong passes.
/// check_source() looks at the first frames of a source, which have been brought into metres, y up,
/// as `given` says. check_target() judges a target as examine_surface() does with the same options;
/// ExamineOptions::target is set there. A rig of which left and right are exchanged is refused.
/// Where the first frames look as if another axis were up, `take` gives clouds from all of the
/// source, brought into the same frame: who lies at the beginning stands up later (up_of_take()).
inline constexpr int kSourceFrames = 8;  ///< that are enough for check_source()
using TakeClouds = std::function<std::vector<Points>()>;
void check_source(const std::vector<Mesh>& first_frames, const std::string& where,
                  const SourceFrame& given = {}, const TakeClouds& take = {});
void check_target(const Mesh& target, const std::string& where, ExamineOptions options = {});
/// InputError for joints whose left is on the right.
void check_sides(const Joints& joints, const std::string& where);

/// What check_source() says of the up axis, of a second person and of floors, for a source that
/// comes cloud by cloud.
class SourceWatch {
 public:
  /// `again`: clouds were taken before, so that the axes are known: who lies now fell.
  explicit SourceWatch(SourceFrame given = {}, bool again = false)
      : given_(std::move(given)), again_(again) {}
  /// Takes the next cloud, in metres, y up, as given. Every kSourceFrames clouds are judged
  /// together. The first good judgement ends the watch: all later clouds pass. A bad judgement
  /// refuses (InputError) the cloud that completed it and the clouds after it:
  /// - all of them, where the clouds stand up along another axis;
  /// - those before the next judgement, where the clouds show nobody, a floor or a second person.
  void look(const Points& cloud, const std::string& where);
  /// The clouds stand up along another axis: no cloud that follows will be better.
  bool hopeless() const { return settled_ && wrong_; }

 private:
  void judge();

  SourceFrame given_;
  bool again_;
  std::vector<Mesh> clouds_;
  bool settled_ = false;
  std::optional<Finding> wrong_;
  std::string fix_;
};

/// Cheaply, of any frame: whether it is of a person's size, in metres.
bool may_be_a_person(const Points& frame);
/// UnusableCloud where it is not, or is so far away that float32 loses centimetres. `options`:
/// which of them the message can name.
enum class FrameMends { scale_and_force, none };
void check_frame(const Points& frame, const std::string& where,
                 FrameMends options = FrameMends::scale_and_force);

}  // namespace restage
