#include "datasets/importers/joints/layouts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "datasets/doctor/shape.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

using joints_detail::SeenFrame;

constexpr const char* kOurs =
    "pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 "
    "left_foot right_foot neck left_collar right_collar head left_shoulder right_shoulder "
    "left_elbow right_elbow left_wrist right_wrist";
constexpr const char* kSmplHands = " left_hand right_hand";
// Of each hand index, middle, little, ring and thumb, from the knuckle outwards.
constexpr const char* kSmplFingers =
    " left_index - - left_hand - - left_pinky - - - - - - - - right_index - - right_hand - - "
    "right_pinky";
constexpr const char* kCoco =
    "nose - - left_ear right_ear left_shoulder right_shoulder left_elbow right_elbow left_wrist "
    "right_wrist left_hip right_hip left_knee right_knee left_ankle right_ankle";
constexpr const char* kMediaPipe =
    "nose - - - - - - left_ear right_ear - - left_shoulder right_shoulder left_elbow right_elbow "
    "left_wrist right_wrist left_pinky right_pinky left_index right_index - - left_hip right_hip "
    "left_knee right_knee left_ankle right_ankle left_heel right_heel left_toe right_toe";
constexpr const char* kBody25 =
    "nose - right_shoulder right_elbow right_wrist left_shoulder left_elbow left_wrist - right_hip "
    "right_knee right_ankle left_hip left_knee left_ankle - - right_ear left_ear left_toe "
    "left_small_toe left_heel right_toe right_small_toe right_heel";
// The wrist, then four joints of thumb, index, middle, ring and little finger.
constexpr const char* kLeftHand =
    " - - - - - left_index - - - left_hand - - - - - - - left_pinky - - -";
constexpr const char* kRightHand =
    " - - - - - right_index - - - right_hand - - - - - - - right_pinky - - -";

struct Line {
  const char *name, *title;
  size_t count;
  std::string joints;
};

const std::vector<Line>& lines() {
  static const std::vector<Line> all = {
      {"smpl22", "SMPL's body, 22 joints (HumanML3D)", 22, kOurs},
      {"smpl24", "SMPL, 24 joints", 24, std::string(kOurs) + kSmplHands},
      {"smplh52", "SMPL-H, 52 joints", 52, std::string(kOurs) + kSmplFingers},
      {"smplh73", "SMPL-H, 73 joints", 73, std::string(kOurs) + kSmplFingers},
      {"smplx55", "SMPL-X, 55 joints", 55, std::string(kOurs) + " - - -" + kSmplFingers},
      {"smplx127", "SMPL-X, 127 joints", 127, std::string(kOurs) + " - - -" + kSmplFingers},
      {"smplx144", "SMPL-X, 144 joints", 144, std::string(kOurs) + " - - -" + kSmplFingers},
      {"smplx145", "SMPL-X, 145 joints", 145, std::string(kOurs) + " - - -" + kSmplFingers},
      {"h36m17", "Human3.6M, 17 joints", 17,
       "pelvis right_hip right_knee right_ankle left_hip left_knee left_ankle spine2 neck - - "
       "left_shoulder left_elbow left_wrist right_shoulder right_elbow right_wrist"},
      {"h36m32", "Human3.6M, 32 joints", 32,
       "pelvis right_hip right_knee right_ankle right_toe - left_hip left_knee left_ankle left_toe "
       "- - spine2 neck - - - left_shoulder left_elbow left_wrist - - - - - right_shoulder "
       "right_elbow right_wrist"},
      {"coco17", "COCO, 17 keypoints (AIST++)", 17, kCoco},
      {"halpe26", "Halpe, 26 keypoints", 26,
       std::string(kCoco) + " - - - left_toe right_toe left_small_toe right_small_toe left_heel "
                            "right_heel"},
      {"coco133", "COCO-WholeBody, 133 keypoints", 133,
       std::string(kCoco) +
           " left_toe left_small_toe left_heel right_toe right_small_toe right_heel" +
           [] {
             std::string face;
             for (int i = 0; i < 68; ++i) face += " -";
             return face;
           }() +
           kLeftHand + kRightHand},
      {"mediapipe33", "MediaPipe Pose, 33 landmarks", 33, kMediaPipe},
      {"mediapipe75", "MediaPipe body and hands, 75 landmarks (FreeMoCap)", 75,
       std::string(kMediaPipe) + kRightHand + kLeftHand},
      {"mediapipe553", "MediaPipe body, hands and face, 553 landmarks (FreeMoCap)", 553,
       std::string(kMediaPipe) + kRightHand + kLeftHand},
      {"openpose25", "OpenPose BODY_25 (EasyMocap)", 25, kBody25},
      {"openpose67", "OpenPose BODY_25 and hands, 67 joints", 67,
       std::string(kBody25) + kLeftHand + kRightHand},
      {"openpose137", "OpenPose body, hands and face, 137 joints", 137,
       std::string(kBody25) + kLeftHand + kRightHand},
      {"openpose18", "OpenPose COCO, 18 joints", 18,
       "nose - right_shoulder right_elbow right_wrist left_shoulder left_elbow left_wrist "
       "right_hip right_knee right_ankle left_hip left_knee left_ankle - - right_ear left_ear"},
      {"panoptic19", "CMU Panoptic, 19 joints", 19,
       "- nose - left_shoulder left_elbow left_wrist left_hip left_knee left_ankle right_shoulder "
       "right_elbow right_wrist right_hip right_knee right_ankle - left_ear - right_ear"},
      {"kinect25", "Kinect v2, 25 joints (NTU RGB+D)", 25,
       "pelvis spine2 - head left_shoulder left_elbow left_wrist left_hand right_shoulder "
       "right_elbow right_wrist right_hand left_hip left_knee left_ankle left_foot right_hip "
       "right_knee right_ankle right_foot neck"},
      {"azure32", "Azure Kinect, 32 joints", 32,
       "pelvis spine1 spine3 neck left_collar left_shoulder left_elbow left_wrist left_hand - - "
       "right_collar right_shoulder right_elbow right_wrist right_hand - - left_hip left_knee "
       "left_ankle left_foot right_hip right_knee right_ankle right_foot head nose - left_ear - "
       "right_ear"}};
  return all;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> out;
  while (!line.empty()) {
    const size_t end = std::min(line.find(' '), line.size());
    if (end > 0) out.push_back(line.substr(0, end));
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return out;
}

int joint_called(std::string_view word) {
  const auto at = std::find(kJointNames.begin(), kJointNames.end(), word);
  return at == kJointNames.end() ? -1 : static_cast<int>(at - kJointNames.begin());
}

/// The place of a word in a frame, if it is there.
std::optional<Vec3> place(const FileFrame& frame, const JointLayout& layout,
                          std::string_view word) {
  const auto at = std::find(layout.joints.begin(), layout.joints.end(), word);
  if (at == layout.joints.end()) return {};
  const auto i = static_cast<size_t>(at - layout.joints.begin());
  return i < frame.size() ? frame[i] : std::nullopt;
}

std::optional<Vec3> between(const std::optional<Vec3>& a, const std::optional<Vec3>& b) {
  if (a && b) return Vec3(0.5 * (*a + *b));
  return a ? a : b;
}

/// The ball of the foot from the toes' tips and the heel, of which our skeleton has neither.
std::optional<Vec3> ball_of_foot(const FileFrame& frame, const JointLayout& layout,
                                 const std::string& side) {
  constexpr double kBack = 0.25;  // of the way from the toes to the heel, or to the ankle
  const auto toes =
      between(place(frame, layout, side + "_toe"), place(frame, layout, side + "_small_toe"));
  if (!toes) return {};
  auto behind = place(frame, layout, side + "_heel");
  if (!behind) behind = place(frame, layout, side + "_ankle");
  return behind ? Vec3(*toes + kBack * (*behind - *toes)) : *toes;
}

}  // namespace

const std::vector<JointLayout>& joint_layouts() {
  static const std::vector<JointLayout> all = [] {
    std::vector<JointLayout> out;
    for (const Line& line : lines())
      out.push_back({line.name, line.title, words_of(line.joints), line.count});
    return out;
  }();
  return all;
}

const JointLayout& joint_layout(const std::string& name) {
  for (const JointLayout& layout : joint_layouts())
    if (layout.name == name || (name == "humanml263" && layout.name == "smpl22")) return layout;
  std::string names;
  for (const JointLayout& layout : joint_layouts()) names += cat(layout.name, ", ");
  throw InputError("", cat("{layout} '", name.substr(0, 40), "' is unknown"),
                   cat("give one of ", names, "humanml263"));
}

std::vector<const JointLayout*> layouts_of(size_t count) {
  std::vector<const JointLayout*> out;
  for (const JointLayout& layout : joint_layouts())
    if (layout.count == count) out.push_back(&layout);
  return out;
}

MappedFrame mapped(const FileFrame& frame, const JointLayout& layout) {
  MappedFrame out;
  for (size_t i = 0; i < std::min(frame.size(), layout.joints.size()); ++i)
    if (const int j = joint_called(layout.joints[i]); j >= 0)
      out.joints[static_cast<size_t>(j)] = frame[i];
  out.nose = place(frame, layout, "nose");
  out.left_ear = place(frame, layout, "left_ear");
  out.right_ear = place(frame, layout, "right_ear");
  if (!out.joints[kHead] && out.left_ear && out.right_ear)
    out.joints[kHead] = between(out.left_ear, out.right_ear);
  for (const size_t side : {0u, 1u}) {
    const std::string name = side == 0 ? "left" : "right";
    out.hand[side] = place(frame, layout, name + "_hand");
    out.index[side] = place(frame, layout, name + "_index");
    out.pinky[side] = place(frame, layout, name + "_pinky");
    auto& foot = out.joints[side == 0 ? kLeftFoot : kRightFoot];
    if (!foot) foot = ball_of_foot(frame, layout, name);
  }
  return out;
}

namespace {

/// How far two joints are apart, and how much that changes: medians over the frames that know both.
/// A few frames with a joint far away count little.
struct Apart {
  double mean = 0, deviation = 0;
  size_t frames = 0;
};

Apart apart(const std::vector<SeenFrame>& frames, int a, int b) {
  std::vector<double> lengths;
  for (const SeenFrame& frame : frames) {
    const auto &x = frame[static_cast<size_t>(a)], &y = frame[static_cast<size_t>(b)];
    if (x && y) lengths.push_back((*x - *y).norm());
  }
  Apart out;
  out.frames = lengths.size();
  if (lengths.empty()) return out;
  out.mean = median(lengths);
  for (double& length : lengths) length = std::abs(length - out.mean);
  out.deviation = 1.5 * median(lengths);  // as large as a standard deviation
  return out;
}

}  // namespace

double misfit(const std::vector<FileFrame>& frames, const JointLayout& layout) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  constexpr size_t kMost = 500;  // frames, evenly spaced
  // Pairs of bones, left and right, which are as long as each other and stay so.
  constexpr int kBones[][4] = {{kLeftHip, kLeftKnee, kRightHip, kRightKnee},
                               {kLeftKnee, kLeftAnkle, kRightKnee, kRightAnkle},
                               {kLeftShoulder, kLeftElbow, kRightShoulder, kRightElbow},
                               {kLeftElbow, kLeftWrist, kRightElbow, kRightWrist}};
  std::vector<SeenFrame> seen;
  std::vector<double> trunks;
  const size_t n = std::min(kMost, frames.size());
  for (size_t f = 0; f < n; ++f) {
    seen.push_back(mapped(frames[f * frames.size() / n], layout).joints);
    if (const double trunk = joints_detail::trunk_length(seen.back()); trunk > 0)
      trunks.push_back(trunk);
  }
  if (trunks.empty()) return kNone;
  const double trunk = median(trunks);
  double sum = 0, count = 0;
  for (const auto& bone : kBones) {
    const Apart left = apart(seen, bone[0], bone[1]), right = apart(seen, bone[2], bone[3]);
    if (left.frames == 0 || right.frames == 0) continue;
    // A limb of a person is a fifth to twice as long as the trunk.
    for (const Apart& one : {left, right})
      if (one.mean < 0.2 * trunk || one.mean > 2 * trunk) sum += 1;
    sum +=
        std::abs(left.mean - right.mean) / trunk + left.deviation / trunk + right.deviation / trunk;
    count += 3;
  }
  return count > 0 ? sum / count : kNone;
}

}  // namespace restage
