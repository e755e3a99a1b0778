#include "datasets/doctor/examine.h"

#include <algorithm>
#include <cmath>

#include "datasets/doctor/examine_detail.h"
#include "datasets/doctor/pose.h"
#include "datasets/doctor/words.h"

namespace restage {

using namespace doctor_detail;

const char* name(Weight weight) {
  return weight == Weight::fact ? "fact" : weight == Weight::note ? "note" : "wrong";
}

bool Diagnosis::usable() const {
  return std::none_of(findings.begin(), findings.end(),
                      [](const Finding& f) { return f.weight == Weight::wrong; });
}

const Finding* Diagnosis::find(const std::string& topic) const {
  for (const Finding& f : findings)
    if (f.topic == topic) return &f;
  return nullptr;
}

namespace {

void judge_cover(Diagnosis& d, const Mesh& mesh, const PersonShape& shape) {
  const double one = one_sidedness(shape.points, shape.parts.spacing);
  if (one > kOneSided && shape.points.size() >= 200)
    d.say({"holes", Weight::note, "seen from one side only", 0.9,
           "rays through it hit a single surface: " + per_cent(one),
           "scan from more sides if you can"});
  if (mesh.faces.empty()) return;
  const Borders open = borders(mesh);
  if (open.edges > 0)
    d.say({"holes", Weight::note,
           counted(open.loops, "open border") + " with " + counted(open.edges, "edge"), 1,
           "edges with one triangle", "close them in a mesh editor if they are not meant"});
}

/// Of a T-pose the arms say more exactly where somebody faces than the network, which has headings
/// of 15 degrees.
void refine_turn(Orientation& o, const Points& points) {
  if (!o.is_turn_sure()) return;
  const Eigen::Matrix3f turn = o.exact_turn().cast<float>();
  Points ours;
  for (const Point& p : points) ours.push_back(turn * p);
  const auto angles = t_pose_angles(ours);
  if (angles && std::max(angles->arms[0], angles->arms[1]) <= kTPoseAngle)
    o.turned += angles->turned;
}

}  // namespace

Diagnosis doctor_detail::judge_surface(const Mesh& mesh, const PersonShape& shape, size_t equal,
                                       const ExamineOptions& options) {
  Diagnosis d;
  d.kind = mesh.faces.empty() ? "cloud" : "mesh";
  d.faces = mesh.faces.size();
  d.fewest_points = d.most_points = mesh.vertices.size();
  judge_points(d, mesh.vertices.size() - equal);
  if (mesh.faces.empty()) judge_path(d, mesh.vertices);
  if (mesh.faces.empty() && !options.target)
    judge_sparse(d,
                 static_cast<size_t>(
                     std::count(shape.parts.part.begin(), shape.parts.part.end(), Part::person)),
                 false);
  Seen seen;
  seen.vote.add(shape.points);
  seen.size = shape.size;
  seen.stray_share = static_cast<double>(shape.parts.stray) /
                     static_cast<double>(std::max<size_t>(shape.parts.part.size(), 1));
  recognise(d, seen, options);
  refine_turn(d.orientation, shape.points);
  judge_units(d, options.target);
  judge_up(d, seen, options, 1);
  judge_facing(d, options);
  const Vec3 up = direction(d.orientation.up);
  judge_frame(d, quantile(shape.points, up, kLevel), quantile(shape.points, up, 1 - kLevel),
              shape.parts.planes);
  judge_pose(d, shape, options);
  judge_parts(d, shape, "");
  return d;
}

Diagnosis examine_surface(const Mesh& mesh, const ExamineOptions& options) {
  const PersonShape shape = shape_of(mesh);
  const size_t equal = repeats(mesh.vertices);
  Diagnosis d = judge_surface(mesh, shape, equal, options);
  judge_cover(d, mesh, shape);
  judge_duplicates(d, equal, mesh.faces.empty(), "");
  return d;
}

Finding examine_skeletons(const std::vector<Joints>& frames) {
  constexpr double kHeight = 1.16;  // times legs and spine, up to the head's joint
  std::vector<double> heights;
  for (const Joints& j : frames) {
    const auto bone = [&](size_t a, size_t b) { return (j[a] - j[b]).norm(); };
    const double legs = (bone(1, 4) + bone(4, 7) + bone(2, 5) + bone(5, 8)) / 2;
    const double spine = bone(0, 3) + bone(3, 6) + bone(6, 9) + bone(9, 12) + bone(12, 15);
    heights.push_back(kHeight * (legs + spine));
  }
  if (heights.empty()) return {};
  const double height = median(std::move(heights));
  Diagnosis d;
  d.size = kSizeOfHeight * height;
  d.unit = guess_unit(d.size);
  judge_units(d, false);
  Finding f = d.findings[0];
  f.evidence = "standing, the skeleton is about " + number(height) + " units tall";
  if (!f.fix.empty()) f.fix = "store metres";
  return f;
}

std::optional<bool> is_mirrored(const Joints& joints, const Vec3& up) {
  Vec3 toes = Vec3::Zero();
  for (const int side : {0, 1}) toes += joints[10 + side] - joints[7 + side];
  const Vec3 left = joints[1] - joints[2] + joints[16] - joints[17];
  const Vec3 forward = toes - toes.dot(up) * up;
  if (!(forward.norm() > 0.25 * toes.norm())) return std::nullopt;  // on tiptoe: noise
  const double turn = up.cross(forward).dot(left);
  if (!(std::abs(turn) > 0.3 * forward.norm() * left.norm())) return std::nullopt;
  return turn < 0;
}

}  // namespace restage
