#include "infer/writers/bvh.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <numbers>

#include "autograd/base/error.h"
#include "autograd/base/format.h"

namespace restage {
namespace {

constexpr int kCountWidth = 10;  // digits left free for the number of frames, known at the end

std::string vector_text(const Vec3& v) { return format("%.6f %.6f %.6f", v.x(), v.y(), v.z()); }

bool is_leaf(int joint) {
  return std::find(kParents.begin(), kParents.end(), joint) == kParents.end();
}

/// The file's text for a joint and all joints below it. Appends these joints to `order`, in the
/// order in which the text lists them.
void list_joint(const Joints& rest, const BvhWriterOptions& options, int joint, int depth,
                std::string& text, std::array<int, kJoints>& order, int& listed) {
  const double scale = options.units_per_metre;
  const std::string& own = options.names[static_cast<size_t>(joint)];
  const std::string name = own.empty() ? std::string(kJointNames[joint]) : own;
  const std::string in(static_cast<size_t>(depth), '\t');
  const int parent = kParents[joint];
  const Vec3 offset = parent < 0 ? rest[joint] : Vec3(rest[joint] - rest[parent]);
  order[listed++] = joint;
  text += in + (parent < 0 ? "ROOT " : "JOINT ") + name + "\n" + in + "{\n";
  text += in + "\tOFFSET " + vector_text(scale * offset) + "\n";
  text += in + (parent < 0 ? "\tCHANNELS 6 Xposition Yposition Zposition " : "\tCHANNELS 3 ") +
          "Zrotation Yrotation Xrotation\n";
  for (int child = joint + 1; child < kJoints; ++child)
    if (kParents[child] == joint) list_joint(rest, options, child, depth + 1, text, order, listed);
  // The format wants an end point behind the last joint of a chain; the skeleton has none. The end
  // point is put half a bone's length behind that joint.
  if (is_leaf(joint))
    text += in + "\tEnd Site\n" + in + "\t{\n" + in + "\t\tOFFSET " +
            vector_text(0.5 * scale * offset) + "\n" + in + "\t}\n";
  text += in + "}\n";
}

double nearest_turn(double angle, double near) {
  constexpr double turn = 2 * std::numbers::pi;
  return angle + turn * std::round((near - angle) / turn);
}

}  // namespace

Vec3 euler_zyx(const Mat3& r, const Vec3& near) {
  const double sine = std::clamp(-r(2, 0), -1.0, 1.0);
  const double cosine = std::hypot(r(2, 1), r(2, 2));
  // With y at +-90 degrees, only z - x or z + x matters; x stays that of the frame before.
  if (cosine < 1e-9) {
    const double y = std::copysign(std::numbers::pi / 2, sine), x = near[2];
    const double sum = std::atan2(-r(0, 1), r(1, 1));  // z - x at +90, z + x at -90
    return {nearest_turn(sine > 0 ? sum + x : sum - x, near[0]), nearest_turn(y, near[1]), x};
  }
  const Vec3 first(std::atan2(r(1, 0), r(0, 0)), std::atan2(sine, cosine),
                   std::atan2(r(2, 1), r(2, 2)));
  const Vec3 second(first[0] + std::numbers::pi, std::numbers::pi - first[1],
                    first[2] + std::numbers::pi);
  Vec3 best;
  double least = INFINITY;
  for (const Vec3& angles : {first, second}) {
    const Vec3 turned(nearest_turn(angles[0], near[0]), nearest_turn(angles[1], near[1]),
                      nearest_turn(angles[2], near[2]));
    const double distance = (turned - near).squaredNorm();
    if (distance < least) best = turned, least = distance;
  }
  return best;
}

BvhWriter::BvhWriter(std::string path, const Joints& rest, BvhWriterOptions options)
    : path_(std::move(path)), options_(options), file_(path_) {
  out_.reset(std::fopen(file_.path().c_str(), "wb"));
  if (!out_) throw WorkError(path_ + ": could not be opened (" + std::strerror(errno) + ")");
  last_.fill(Vec3::Zero());
  std::string text = "HIERARCHY\n";
  int listed = 0;
  list_joint(rest, options_, 0, 0, text, order_, listed);
  text += "MOTION\nFrames: ";
  count_at_ = static_cast<long>(text.size());
  write(text + format("%*d\nFrame Time: %.16g\n", kCountWidth, 0, 1.0 / options_.fps));
}

void BvhWriter::write(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), out_.get()) != text.size())
    throw WorkError(path_ + ": could not be written (" + std::strerror(errno) +
                    "); free some space and run it again");
}

void BvhWriter::push(const Pose& pose) {
  bool finite = pose.root.allFinite();
  for (const Mat3& r : pose.local) finite = finite && r.allFinite();
  if (!finite)
    throw WorkError(path_ + ": the pose of frame " + std::to_string(frames_) +
                    " is not finite; check the source and the weights");
  std::string line = vector_text(options_.units_per_metre * pose.root);
  for (const int joint : order_) {
    last_[joint] = euler_zyx(pose.local[joint], last_[joint]);
    line += ' ' + vector_text(last_[joint] * (180.0 / std::numbers::pi));
  }
  write(line + "\n");
  ++frames_;
}

void BvhWriter::commit() {
  if (std::fseek(out_.get(), count_at_, SEEK_SET) != 0)
    throw WorkError(path_ + ": could not be written (" + std::strerror(errno) + ")");
  write(format("%*zu", kCountWidth, frames_));
  if (std::fclose(out_.release()) != 0)
    throw WorkError(path_ + ": could not be written (" + std::strerror(errno) +
                    "); free some space and run it again");
  file_.commit();
}

}  // namespace restage
