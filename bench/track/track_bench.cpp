// How exactly `restage track` follows a person whose true surface is known.
//   track_bench twin FILE FOLDER [frames=100] [body=0] [motion=0] [first=0] [cameras=0]
//     a test body of FILE, dressed, performs a test motion of FILE. Into FOLDER, which must exist:
//     scans.h5 (cameras=0: 10,000 points all over, 3 mm of noise; else as many depth cameras in a
//     ring), clean.h5 (the same without noise), truth.h5 (the true vertices), dressed.ply and
//     naked.ply (the person in T-pose: templates)
//   track_bench measure FOLDER RESULT.h5
//     distances of the clean points from the result's surface, and of its vertices from the true
//     ones, as a row in Markdown. Of a result with other vertices those places count that were
//     nearest to the true vertices in the first frame. Then the five frames that fit worst
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <optional>
#include <string>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "datasets/sampling/dress.h"
#include "datasets/sampling/scanner.h"
#include "datasets/sampling/surface.h"
#include "datasets/schema.h"
#include "infer/registration/nearest_detail.h"
#include "infer/track/surface_distance.h"
#include "nn/geometry/mesh_file.h"

namespace restage::bench {
namespace {

constexpr size_t kWholePoints = 10000;
constexpr double kWholeNoise = 0.003;  // metres

struct TwinAsked {
  std::string file, folder;
  size_t frames = 100, body = 0, motion = 0, first = 0;
  int cameras = 0;
};

/// What one frame's scan shows, with noise and without.
struct TwinScan {
  Points seen, clean;
};

class TwinScanner {
 public:
  TwinScanner(const Body& body, int cameras) : body_(body), sampler_(body), cameras_(cameras) {}

  TwinScan operator()(const Points& surface, const Vec3& pelvis, size_t frame) const {
    const RngKey key = RngKey{17, 0}.fold("track").fold(static_cast<uint64_t>(frame));
    if (cameras_ == 0) return whole(surface, key);
    DepthCamera model;
    model.width = model.height = 320;
    // They go with the person, as cameras of a large room would see as much.
    const auto ring =
        camera_ring(cameras_, 3.0, 0, Vec3(pelvis.x(), 0.9, pelvis.z()), {1.0, 1.6}, model);
    const Mesh mesh{surface, body_.rest.faces};
    ScannerNoise none;
    none.base = none.growth = none.dropout = none.grazing = none.mixed = none.outliers = 0;
    return {scan_surface(mesh, ring, {}, key), scan_surface(mesh, ring, none, key)};
  }

 private:
  TwinScan whole(const Points& surface, const RngKey& key) const {
    const SurfaceSamples drawn = sampler_.draw(key, kWholePoints);
    TwinScan out;
    Points picked;
    for (const int32_t v : drawn.vertices) picked.push_back(surface[static_cast<size_t>(v)]);
    out.clean = drawn.on(picked);
    out.seen = out.clean;
    add_noise(key.fold("noise"), kWholeNoise, out.seen);
    return out;
  }

  const Body& body_;
  SurfaceSampler sampler_;
  int cameras_;
};

void write_ply(const std::string& path, const Mesh& mesh) {
  write_file_atomically(path, ply_bytes(mesh.vertices, mesh.faces));
}

int twin(const TwinAsked& asked) {
  const std::vector<Body> bodies = read_bodies(asked.file, "test");
  const std::vector<Motion> motions = read_motions(asked.file, "test");
  if (asked.body >= bodies.size() || asked.motion >= motions.size())
    throw InputError(asked.file, "has fewer test bodies or motions", "name earlier ones");
  const Body& naked = bodies[asked.body];
  const Body body = dressed(naked, RngKey{5, 0}.fold("clothes"));
  const Motion& motion = motions[asked.motion];
  if (asked.first >= motion.frames())
    throw InputError(asked.file, "has a shorter motion", "begin earlier");
  FileInfo info;
  info.provenance = "a dressed twin, by track_bench";
  ScanWriter scans(asked.folder + "/scans.h5", info), clean(asked.folder + "/clean.h5", info);
  PredictionWriter truth(asked.folder + "/truth.h5", std::ssize(body.rest.vertices),
                         body.rest.faces, info);
  const TwinScanner scan(body, asked.cameras);
  const size_t end = std::min(motion.frames(), asked.first + asked.frames);
  for (size_t f = asked.first; f < end; ++f) {
    const Pose pose = pose_on(motion, body, f);
    const Points surface = pose_surface(body, pose);
    const TwinScan seen = scan(surface, pose.root, f);
    scans.append(seen.seen);
    clean.append(seen.clean);
    truth.append(forward_kinematics(body.joints, pose).joints, surface);
  }
  scans.commit();
  clean.commit();
  truth.commit();
  write_ply(asked.folder + "/dressed.ply", body.rest);
  write_ply(asked.folder + "/naked.ply", naked.rest);
  std::printf("%zu frames of %s in %s, %zu vertices\n", end - asked.first, motion.id.c_str(),
              body.id.c_str(), body.rest.vertices.size());
  return 0;
}

using Columns = Eigen::Matrix3Xd;

Columns columns_of(const std::vector<double>& numbers) {
  return Eigen::Map<const Columns>(numbers.data(), 3, std::ssize(numbers) / 3);
}

/// Metres.
struct Drift {
  double mean = 0, aligned = 0;
};

Drift drift(const Columns& found, const Columns& truth) {
  const Eigen::Matrix4d to = Eigen::umeyama(found, truth, true);
  const Columns moved =
      (to.topLeftCorner<3, 3>() * found).colwise() + Vec3(to.topRightCorner<3, 1>());
  return {(found - truth).colwise().norm().mean(), (moved - truth).colwise().norm().mean()};
}

/// The place on a triangle that is nearest to a point, as shares of its corners.
Vec3 nearest_share(const Vec3& p, const std::array<Vec3, 3>& at) {
  Eigen::Matrix<double, 3, 2> edges;
  edges << at[1] - at[0], at[2] - at[0];
  const Eigen::Vector2d by = (edges.transpose() * edges + 1e-12 * Eigen::Matrix2d::Identity())
                                 .ldlt()
                                 .solve(edges.transpose() * (p - at[0]));
  Vec3 share(1 - by.sum(), by[0], by[1]);
  share = share.cwiseMax(0);
  return share / share.sum();
}

/// Of every true vertex the place on the found surface that was nearest in the first frame.
class Bound {
 public:
  Bound(const Columns& truth, const Columns& found, const std::vector<Triangle>& faces) {
    std::vector<std::vector<size_t>> about(static_cast<size_t>(found.cols()));
    for (size_t f = 0; f < faces.size(); ++f)
      for (const int32_t v : faces[f]) about[static_cast<size_t>(v)].push_back(f);
    std::vector<Vec3> places;
    for (Eigen::Index v = 0; v < found.cols(); ++v) places.push_back(found.col(v));
    const NearestPoint find(places);
    for (Eigen::Index v = 0; v < truth.cols(); ++v) {
      const Vec3 p = truth.col(v);
      double least = 1e9;
      Place& best = places_.emplace_back();
      for (const uint32_t near : find.nearest(p, 6))
        for (const size_t f : about[near]) {
          std::array<Vec3, 3> at;
          for (size_t k = 0; k < 3; ++k) at[k] = places[static_cast<size_t>(faces[f][k])];
          const Vec3 share = nearest_share(p, at);
          const double away = (share[0] * at[0] + share[1] * at[1] + share[2] * at[2] - p).norm();
          if (away < least) least = away, best = {faces[f], share};
        }
    }
  }
  Columns operator()(const Columns& found) const {
    Columns out(3, std::ssize(places_));
    for (size_t i = 0; i < places_.size(); ++i) {
      out.col(static_cast<Eigen::Index>(i)).setZero();
      for (size_t k = 0; k < 3; ++k)
        out.col(static_cast<Eigen::Index>(i)) +=
            places_[i].share[static_cast<int>(k)] * found.col(places_[i].face[k]);
    }
    return out;
  }

 private:
  struct Place {
    Triangle face;
    Vec3 share;
  };
  std::vector<Place> places_;
};

int measure(const std::string& folder, const std::string& result) {
  const PredictionReader truth(folder + "/truth.h5"), found(result);
  if (truth.frames() != found.frames())
    throw InputError(result, "has other frames than the truth",
                     "give what `restage track` made of this twin");
  const bool same = truth.vertex_count() == found.vertex_count();
  const Scans clean = read_scans(folder + "/clean.h5");
  Mesh mesh;
  mesh.faces = found.read_small().faces;
  mesh.vertices.resize(static_cast<size_t>(found.vertex_count()));
  const SurfaceDistance distance(mesh);
  std::vector<double> all;
  std::vector<std::pair<double, int64_t>> worst;
  std::optional<Bound> bound;
  Drift sum;
  for (int64_t f = 0; f < truth.frames(); ++f) {
    std::vector<double> numbers;
    truth.read_vertices(f, 1, numbers);
    const Columns right = columns_of(numbers);
    found.read_vertices(f, 1, numbers);
    const Columns now = columns_of(numbers);
    if (!same && f == 0) bound.emplace(right, now, mesh.faces);
    const Drift d = drift(same ? now : (*bound)(now), right);
    sum.mean += d.mean, sum.aligned += d.aligned;
    std::vector<Vec3> surface, points;
    for (Eigen::Index v = 0; v < now.cols(); ++v) surface.push_back(now.col(v));
    for (int64_t i = clean.frame_offset[f]; i < clean.frame_offset[f + 1]; ++i)
      points.push_back(clean.points[static_cast<size_t>(i)].cast<double>());
    const std::vector<double> some = distance(points, surface);
    all.insert(all.end(), some.begin(), some.end());
    worst.emplace_back(-middle_and_most(some).p95, f);
  }
  const MiddleAndMost d = middle_and_most(all);
  const double frames = static_cast<double>(truth.frames());
  std::printf("| %s | %.1f | %.1f | %.1f | %.1f |\n", result.c_str(), 1e3 * d.median, 1e3 * d.p95,
              1e3 * sum.mean / frames, 1e3 * sum.aligned / frames);
  std::sort(worst.begin(), worst.end());
  std::printf("worst frames, 95 %%:");
  for (size_t i = 0; i < std::min<size_t>(5, worst.size()); ++i)
    std::printf(" %d (%.0f mm)", static_cast<int>(worst[i].second), -1e3 * worst[i].first);
  std::printf("\n");
  return 0;
}

bool read_word(const std::string& word, TwinAsked* asked) {
  const size_t at = word.find('=');
  if (at == std::string::npos) return false;
  const std::string name = word.substr(0, at);
  const auto value = static_cast<size_t>(std::stoul(word.substr(at + 1)));
  if (name == "cameras") return asked->cameras = static_cast<int>(value), true;
  for (const auto& [known, to] : {std::pair{"frames", &asked->frames},
                                  {"body", &asked->body},
                                  {"motion", &asked->motion},
                                  {"first", &asked->first}})
    if (name == known) return *to = value, true;
  return false;
}

}  // namespace
}  // namespace restage::bench

int main(int argc, char** argv) {
  using namespace restage;
  try {
    const std::string what = argc > 1 ? argv[1] : "";
    if (what == "measure" && argc == 4) return bench::measure(argv[2], argv[3]);
    bool right = what == "twin" && argc >= 4;
    bench::TwinAsked asked;
    if (right) asked.file = argv[2], asked.folder = argv[3];
    for (int i = 4; i < argc && right; ++i) right = bench::read_word(argv[i], &asked);
    if (right) return bench::twin(asked);
  } catch (const Error& error) {
    std::cerr << error.what() << "\n";
    return error.exit_code;
  }
  std::cerr
      << "track_bench twin FILE FOLDER [frames=100] [body=0] [motion=0] [first=0] [cameras=0]\n"
         "track_bench measure FOLDER RESULT.h5\n";
  return 2;
}
