#include "datasets/importers/joints/solve.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "datasets/importers/joints/frame_solver.h"
#include "datasets/importers/joints/learnt_body.h"
#include "datasets/importers/joints/skeleton_of.h"
#include "datasets/importers/motions/rest_pose.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

using namespace joints_detail;

std::vector<Pose> at_30_fps(const std::vector<Pose>& poses, double fps) {
  std::vector<Pose> out;
  const double last = static_cast<double>(poses.size() - 1);
  const auto frames = static_cast<size_t>(std::floor(last / fps * kFps + 1e-3)) + 1;
  for (size_t k = 0; k < frames; ++k) {
    const double at = std::min(last, static_cast<double>(k) / kFps * fps);
    const auto a = static_cast<size_t>(at);
    out.push_back(
        between(poses[a], poses[std::min(a + 1, poses.size() - 1)], at - static_cast<double>(a)));
  }
  return out;
}

/// Joints that do not say where the root is: each frame stands on its lower foot.
void stand(Poses& poses) {
  for (PosedSkeleton& pose : poses) {
    const double low = lowest_foot(pose);
    for (Vec3& x : pose.joints) x.y() -= low;
  }
}

void report_errors(const std::array<double, kJoints>& error, ImportReport& report) {
  const double degrees = 180 / M_PI;
  double mean = 0;
  for (const double e : error) mean += e / kJoints * degrees;
  report.fact("turns",
              format("where bones point is as given; about themselves they turn as a network "
                     "believes: off by %.0f degrees on average, elbows %.0f, wrists %.0f",
                     mean, 0.5 * degrees * (error[kLeftElbow] + error[kRightElbow]),
                     0.5 * degrees * (error[kLeftWrist] + error[kRightWrist])));
}

}  // namespace

namespace joints_detail {

LearntBody learn_body(const JointRecording& recording, const MotionOptions& options,
                      ImportReport& report) {
  report.fact("joints", cat(recording.form, ", ", recording.layout.title));
  for (const std::string& remark : recording.remarks) report.remark(remark);
  LearntBody out;
  out.joints = clean_joints(recording, options, report);
  check_length(out.joints.frames.size(), kJoints, out.joints.fps,
               out.joints.frames.size() * recording.layout.count * 12, report.file);
  out.believed = believed_turns(out.joints);
  out.rest = find_skeleton(out.joints.frames, out.believed.turns);
  out.noise = unsteadiness(out.joints.frames) / std::sqrt(2.0);  // a bone has two ends
  report_errors(out.believed.error, report);
  return out;
}

}  // namespace joints_detail

SolvedJoints solve_joints(const JointRecording& recording, const MotionOptions& options,
                          ImportReport& report) {
  const LearntBody body = learn_body(recording, options, report);
  const CleanJoints& joints = body.joints;
  std::vector<Pose> poses;
  for (size_t f = 0; f < joints.frames.size(); ++f)
    poses.push_back(pose_through(body.rest, joints.frames[f], body.believed.turns[f], body.noise));
  Poses posed;
  for (const Pose& pose : at_30_fps(poses, joints.fps))
    posed.push_back(forward_kinematics(body.rest, pose));
  if (joints.in_place) {
    stand(posed);
    report.remark(
        "the hips never go anywhere: the file does not say where the person is. The motion "
        "stays in place and stands on the lower foot");
  }
  SolvedJoints out;
  out.expected_error = body.believed.error;
  Motion named;
  named.id = options.id;
  named.subject = options.subject;
  named.split = options.split;
  named.action = options.action;
  out.motion = to_motion(posed, body.rest, floor_height(posed), std::move(named));
  return out;
}

}  // namespace restage
