// What H4D's codes mean: the buffers of a trained network (nn/models/h4d.h).
#include <algorithm>

#include "autograd/base/error.h"
#include "nn/models/h4d.h"

namespace restage {
namespace {

/// Puts `value` in the place of a buffer of the same shape, on the buffer's device.
void put(Tensor* buffer, const Tensor& value, const char* name) {
  if (!(value.shape() == buffer->shape()))
    throw ShapeError("H4D's " + std::string(name) + " of shape " + buffer->shape().str() +
                     " cannot be " + value.shape().str());
  *buffer = value.cast(buffer->dtype()).to(buffer->device());
}

/// The numbers of a buffer as integers.
std::vector<int32_t> whole_numbers(const Tensor& buffer) {
  const Tensor here = buffer.cpu();
  std::vector<int32_t> out(static_cast<size_t>(here.numel()));
  for (size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<int32_t>(std::clamp(here.item(static_cast<int64_t>(i)), -2e9, 2e9));
  return out;
}

}  // namespace

H4dSpace::H4dSpace(const H4dConfig& c, const Init& init) {
  if (c.vertices == 0) return;
  const int64_t j = c.pose / 3, later = c.frames - 1;
  if (c.pose % 3 != 0 || c.root >= c.motion)
    throw InputError("", "sizes of codes/h4d do not fit one another",
                     "give pose three numbers for each joint, and root fewer than motion");
  const auto zeros = [&](const Shape& shape, const char* name) {
    return init.uniform(shape, 0, name);  // which counts what a damaged file may ask for
  };
  mean = zeros({c.vertices, 3}, "mean");
  directions = zeros({c.vertices, 3, c.shape}, "directions");
  body_joints = zeros({j, 3}, "joints");
  joint_directions = zeros({j, 3, c.shape}, "joint_directions");
  weights = zeros({c.vertices, j}, "weights");
  parents = zeros({j}, "parents");
  corners = zeros({c.faces, 3}, "faces");
  root = zeros({c.root, 3 * later}, "motion_root");
  root_mean = zeros({3 * later}, "motion_root_mean");
  joints = zeros({c.motion - c.root, (c.pose - 3) * later}, "motion_joints");
  joint_mean = zeros({(c.pose - 3) * later}, "motion_joint_mean");
}

void H4dSpace::set(const LinearBody& from, const std::vector<std::array<int32_t, 3>>& faces,
                   const MotionBasis& basis) {
  put(&mean, from.mean, "mean");
  put(&directions, from.directions, "directions");
  put(&body_joints, from.joint_mean, "joints");
  put(&joint_directions, from.joint_directions, "joint_directions");
  put(&weights, from.weights, "weights");
  put(&parents,
      Tensor::from<double>({std::ssize(from.parents)},
                           std::vector<double>(from.parents.begin(), from.parents.end())),
      "parents");
  std::vector<double> all;
  for (const auto& face : faces) all.insert(all.end(), face.begin(), face.end());
  put(&corners, Tensor::from<double>({std::ssize(faces), 3}, all), "faces");
  put(&root, basis.root, "motion_root");
  put(&root_mean, basis.root_mean, "motion_root_mean");
  put(&joints, basis.joints, "motion_joints");
  put(&joint_mean, basis.joint_mean, "motion_joint_mean");
}

LinearBody H4dSpace::body() const {
  LinearBody out{mean, directions, body_joints, joint_directions, weights, whole_numbers(parents)};
  for (size_t i = 0; i < out.parents.size(); ++i)
    if (out.parents[i] >= static_cast<int>(i) || out.parents[i] < (i == 0 ? -1 : 0))
      throw InputError("", "the body of codes/h4d has joints that hang together wrongly",
                       "give weights as a training left them");
  return out;
}

std::vector<std::array<int32_t, 3>> H4dSpace::faces() const {
  const std::vector<int32_t> all = whole_numbers(corners);
  const auto vertices = static_cast<int32_t>(mean.size(0));
  for (const int32_t i : all)
    if (i < 0 || i >= vertices)
      throw InputError("", "the body of codes/h4d has a face without its vertex",
                       "give weights as a training left them");
  std::vector<std::array<int32_t, 3>> out;
  for (size_t i = 0; i + 2 < all.size(); i += 3) out.push_back({all[i], all[i + 1], all[i + 2]});
  return out;
}

void H4dSpace::visit(Fields& f) {
  f("mean", mean);
  f("directions", directions);
  f("joints", body_joints);
  f("joint_directions", joint_directions);
  f("weights", weights);
  f("parents", parents);
  f("faces", corners);
  f("motion_root", root);
  f("motion_root_mean", root_mean);
  f("motion_joints", joints);
  f("motion_joint_mean", joint_mean);
}

}  // namespace restage
