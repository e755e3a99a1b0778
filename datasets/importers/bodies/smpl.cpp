#include "datasets/importers/bodies/smpl.h"

#include <algorithm>
#include <cmath>

#include "datasets/readers/errors.h"

namespace restage {
namespace {

constexpr const char* kGiveModel = "give a SMPL, SMPL-H or SMPL-X model as published (.npz)";
constexpr double kMostMetres = 100;  // nobody is larger: other units, or no model at all

[[noreturn]] void misfit(const NpyArray& array, const std::string& wanted) {
  throw InputError(array.where(), "has the shape " + shape_text(array.shape()) + ", not " + wanted,
                   kGiveModel);
}

void check_shape(const NpyArray& array, const std::vector<int64_t>& wanted) {
  if (!array.is_shaped(wanted)) misfit(array, shape_text(wanted));
}

SmplFamily family_of(const NpyArray& kintree) {
  if (kintree.is_shaped({2, 24})) return SmplFamily::smpl;
  if (kintree.is_shaped({2, 52})) return SmplFamily::smplh;
  if (kintree.is_shaped({2, 55})) return SmplFamily::smplx;
  misfit(kintree, "[2, 24] (SMPL), [2, 52] (SMPL-H) or [2, 55] (SMPL-X)");
}

/// SMPL-X as published keeps expressions behind the shapes: 300 + 100, or 10 + 10 in its small
/// files. Others (16, 100) have been cut to their shapes.
size_t shapes_of(SmplFamily family, size_t directions) {
  if (family != SmplFamily::smplx) return directions;
  return directions == 20 ? 10 : std::min<size_t>(directions, 300);
}

}  // namespace

const char* to_string(SmplFamily family) {
  return family == SmplFamily::smpl ? "SMPL" : family == SmplFamily::smplh ? "SMPL-H" : "SMPL-X";
}

bool is_smpl_model(const Npz& file) {
  return file.has("v_template") && file.has("shapedirs") && file.has("J_regressor");
}

SmplFamily smpl_family(const Npz& file) { return family_of(file.array("kintree_table")); }

SmplModel::SmplModel(const Npz& file)
    : path_(file.path()),
      directions_(file.array("shapedirs")),
      regressor_(file.array("J_regressor")) {
  read_template(file);
  read_skeleton(file);
  read_regressor();
  read_weights(file);
  read_faces(file);
  const Joints rest = joints({});
  if (!(rest[15].y() > rest[0].y()) || !(rest[1].x() > rest[2].x()))
    throw InputError(path_, "does not stand with y up and its left towards +x", kGiveModel);
  const double height = (rest[15] - 0.5 * (rest[7] + rest[8])).norm();
  if (!(height > 0.3 && height < 3))
    throw InputError(path_, cat("is no person's size in metres: from ankles to head ", height),
                     kGiveModel);
}

void SmplModel::read_template(const Npz& file) {
  const NpyArray array = file.array("v_template");
  if (!array.is_shaped({-1, 3}) || array.size() == 0) misfit(array, "[V, 3]");
  const std::vector<double> values = array.finite();
  template_.resize(values.size() / 3);
  for (size_t v = 0; v < template_.size(); ++v) {
    template_[v] = Vec3(&values[3 * v]);
    if (!(template_[v].cwiseAbs().maxCoeff() < kMostMetres))
      throw InputError(array.where(), "is larger than any person in metres", kGiveModel);
  }
  if (!directions_.is_shaped({array.shape()[0], 3, -1}))
    misfit(directions_, cat("[", template_.size(), ", 3, B]"));
  for (int64_t i = 0; i < directions_.size(); ++i)
    if (!(std::abs(directions_[i]) < kMostMetres))
      throw InputError(directions_.where(), "holds a number that is no length in metres",
                       kGiveModel);
}

void SmplModel::read_skeleton(const Npz& file) {
  const NpyArray table = file.array("kintree_table");
  family_ = family_of(table);
  shapes_ = shapes_of(family_, static_cast<size_t>(directions_.shape()[2]));
  const int64_t n = table.shape()[1];
  for (int64_t j = 0; j < n; ++j) {
    const double parent = table[j];  // the root's is -1, or 2^32 - 1 where signs were lost
    const bool known = j < kJoints ? j == 0 || parent == kParents[j]
                                   : parent >= 0 && parent < static_cast<double>(j);
    if (!known)
      throw InputError(table.where(), cat("gives joint ", j, " another parent than SMPL"),
                       kGiveModel);
    parents_.push_back(j == 0 ? -1 : static_cast<int>(parent));
  }
}

void SmplModel::read_regressor() {
  const int64_t n = template_.size();
  check_shape(regressor_, {static_cast<int64_t>(parents_.size()), n});
  joint_vertices_.resize(kJoints);
  for (int64_t i = 0; i < kJoints * n; ++i) {
    const double share = regressor_[i];
    if (!(std::abs(share) < 1e3))
      throw InputError(regressor_.where(), "holds a number that is no share", kGiveModel);
    if (share != 0) joint_vertices_[i / n].push_back(static_cast<uint32_t>(i % n));
  }
}

void SmplModel::read_weights(const Npz& file) {
  const NpyArray array = file.array("weights");
  const int64_t joints = parents_.size();
  check_shape(array, {static_cast<int64_t>(template_.size()), joints});
  weights_.setZero(array.shape()[0], kJoints);
  for (int64_t v = 0; v < array.shape()[0]; ++v) {
    std::array<double, kJoints> row{};
    double sum = 0;
    for (int64_t j = 0; j < joints; ++j) {
      const double weight = array[v * joints + j];
      if (!(weight >= -1e-6 && weight < 1e3))
        throw InputError(array.where(), "holds a weight that is negative or no number", kGiveModel);
      int ours = static_cast<int>(j);  // hands, jaw and eyes: the joint of ours they hang from
      while (ours >= kJoints) ours = parents_[ours];
      row[ours] += std::max(weight, 0.0);
      sum += std::max(weight, 0.0);
    }
    if (!(sum > 0))
      throw InputError(array.where(), cat("gives vertex ", v, " no weight"), kGiveModel);
    for (int j = 0; j < kJoints; ++j) weights_(v, j) = static_cast<float>(row[j] / sum);
  }
}

void SmplModel::read_faces(const Npz& file) {
  const NpyArray array = file.array("f");
  if (!array.is_shaped({-1, 3})) misfit(array, "[T, 3]");
  faces_.resize(array.shape()[0]);
  for (int64_t i = 0; i < array.size(); ++i) {
    const double index = array[i];
    if (!(index >= 0 && index < static_cast<double>(template_.size())) ||
        index != std::floor(index))
      throw InputError(array.where(), "names a vertex that does not exist", kGiveModel);
    faces_[i / 3][i % 3] = static_cast<int32_t>(index);
  }
}

void SmplModel::read_blend_shapes(const Npz& file) {
  if (!file.has("posedirs")) return;
  const NpyArray array = file.array("posedirs");
  const int64_t n = template_.size();
  const auto width = 9 * (static_cast<int64_t>(parents_.size()) - 1);
  check_shape(array, {n, 3, width});
  const auto shapes = std::make_shared<PoseBlendShapes>();
  shapes->directions.resize(3 * n, PoseBlendShapes::kFeatures);
  for (int64_t row = 0; row < 3 * n; ++row)  // fingers, jaw and eyes stay as they are
    for (int64_t k = 0; k < PoseBlendShapes::kFeatures; ++k) {
      const double value = array[row * width + k];
      if (!(std::abs(value) < kMostMetres))
        throw InputError(array.where(), "holds a number that is no length in metres", kGiveModel);
      shapes->directions(row, k) = static_cast<float>(value);
    }
  blend_shapes_ = shapes;
}

Vec3 SmplModel::vertex(size_t v, const Betas& betas) const {
  Vec3 out = template_[v];
  const size_t n = std::min(betas.size(), shapes_);
  const auto stride = static_cast<size_t>(directions_.shape()[2]);
  for (size_t axis = 0; axis < 3; ++axis)
    for (size_t b = 0; b < n; ++b)
      out[static_cast<int>(axis)] +=
          betas[b] * directions_[static_cast<int64_t>((3 * v + axis) * stride + b)];
  return out;
}

Joints SmplModel::joints(const Betas& betas) const {
  Joints out;
  for (size_t j = 0; j < kJoints; ++j) {
    out[j].setZero();
    for (const uint32_t v : joint_vertices_[j])
      out[j] += regressor_[static_cast<int64_t>(j * template_.size() + v)] * vertex(v, betas);
  }
  return out;
}

Body SmplModel::body(const Betas& betas) const {
  std::vector<Vec3> vertices(template_.size());
  double floor = 0;
  for (size_t v = 0; v < vertices.size(); ++v) {
    vertices[v] = vertex(v, betas);
    floor = v == 0 ? vertices[v].y() : std::min(floor, vertices[v].y());
  }
  Body out;
  for (const Vec3& x : vertices) out.rest.vertices.push_back((x - Vec3(0, floor, 0)).cast<float>());
  out.joints = joints(betas);
  out.definition = "smpl";
  for (Vec3& x : out.joints) x.y() -= floor;
  out.rest.faces = faces_;
  out.weights = weights_;
  out.blend_shapes = blend_shapes_;
  return out;
}

std::vector<Betas> read_betas(const std::string& path, uint64_t max_memory) {
  const bool npy = path.ends_with(".npy");
  const NpyArray array = npy ? read_npy(path, max_memory) : Npz(path, max_memory).array("betas");
  const auto& shape = array.shape();
  if (array.is_text() || shape.empty() || shape.size() > 2 || array.size() == 0)
    throw InputError(array.where(), "has the shape " + shape_text(shape),
                     "give betas as [B], or [P, B] for several people");
  const std::vector<double> values = array.finite();
  const auto width = shape.back();
  std::vector<Betas> out;
  for (auto at = values.begin(); at != values.end(); at += width) out.emplace_back(at, at + width);
  for (const double value : values)
    if (!(std::abs(value) < 1e3))
      throw InputError(array.where(), "holds a number that is no shape",
                       "give betas, about -5 to 5");
  return out;
}

}  // namespace restage
