// restage track: X.glb, the template's own file with a surface that moves.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "datasets/characters/gltf_clip.h"
#include "experiments/cli/perform/bare_document.h"
#include "experiments/cli/perform/track.h"
#include "infer/track/components.h"
#include "infer/writers/glb.h"

namespace restage::cli {
namespace {

constexpr double kUsualDetail = 1;  // mm

GltfDocument::Bulge bulge_of(const TrackedTake& t, const SurfaceComponents& found) {
  GltfDocument::Bulge out;
  const double metre = t.tracker.stored_metre();
  for (const Point& p : found.mean) out.mean.push_back(static_cast<float>(metre) * p);
  out.deltas = found.deltas;
  for (const float w : found.weights) out.weights.push_back(static_cast<float>(metre) * w);
  for (const auto& d : t.take.distance) out.distance.push_back(d ? 1e3 * d->median : -1.0);
  out.mean_error = 1e3 * found.error.mean;
  out.p95_error = 1e3 * found.error.p95;
  out.max_error = 1e3 * found.error.max;
  return out;
}

/// Writes the file with all targets of `found`, or with the first `most`.
class GlbOfTake {
 public:
  explicit GlbOfTake(const TrackedTake& t) : t_(t) {
    const auto& all = t.take.confidence;
    sure_ = std::all_of(all.begin(), all.end(), [](const auto& x) { return x.has_value(); });
  }

  void write(const SurfaceComponents& found, const std::string& path) const {
    if (t_.target.own)
      write_own(found, path);
    else
      write_ours(found, path);
  }

 private:
  template <class Writer>
  void push_all(Writer& writer) const {
    for (int64_t f = 0; f < t_.journal.frames(); ++f) {
      const JournalFrame frame = t_.journal.read(f);
      writer.push(frame.pose, sure_ ? frame.confidence : std::nullopt);
    }
    writer.set_filled(t_.take.filled);
  }

  /// A character keeps its bones.
  void write_own(const SurfaceComponents& found, const std::string& path) const {
    SinkOptions to = t_.c.how.to;
    GltfClipWriter writer(
        path, t_.target_file, t_.target.own,
        {own_clip_name(to, t_.clip, t_.target_file, *t_.target.own), t_.fps, false});
    push_all(writer);
    writer.set_bulge(bulge_of(t_, found));
    writer.commit();
  }

  void write_ours(const SurfaceComponents& found, const std::string& path) const {
    const Body& body = t_.tracker.body();
    BareDocument bare(t_.target_file, body.rest.vertices.size(), true);
    GlbOptions how;
    how.clip = t_.clip;
    how.fps = t_.fps;
    how.small = true;
    if (!t_.c.how.to.skeleton.empty()) how.skeleton = t_.c.how.to.skeleton;
    Mesh mesh = body.rest;
    for (size_t v = 0; v < mesh.vertices.size() && !bare.known(); ++v)
      mesh.vertices[v] += found.mean[v];
    GlbWriter writer(path, mesh, body.joints, body.weights, how);
    push_all(writer);
    if (bare.known()) {
      const GltfDocument::Bulge bulge = bulge_of(t_, found);
      bare.write(writer.bytes(), t_.target.unposed ? &*t_.target.unposed : nullptr, path, &bulge);
      return;
    }
    GlbMorphs morphs{found.deltas, found.weights, found.error, {}};
    for (const auto& d : t_.take.distance) morphs.distance.push_back(d ? d->median : -1.0);
    writer.set_morphs(std::move(morphs));
    writer.commit();
  }

  const TrackedTake& t_;
  bool sure_;
};

double bytes_at(const std::string& path) {
  return static_cast<double>(std::filesystem::file_size(path));
}

/// How many targets there may be so that the file has no more than so many bytes. It grows by the
/// same with each.
size_t affordable(const GlbOfTake& glb, const SurfaceComponents& one, const std::string& draft,
                  double bytes) {
  SurfaceComponents none = one;
  none.deltas.clear();
  none.weights.clear();
  glb.write(none, draft);
  const double bare = bytes_at(draft);
  if (one.deltas.empty()) return 0;
  glb.write(one, draft);
  const double each = bytes_at(draft) - bare;
  return bytes < bare ? 0 : static_cast<size_t>((bytes - bare) / each);
}

}  // namespace

std::function<FileSkin(const Pose&)> file_skin(const TrackCommand& c, const TargetMesh& target,
                                               const std::string& target_file, const Body& body) {
  if (!writes_glb(c)) return {};
  if (target.own)
    return [own = target.own](const Pose& pose) {
      Joints joints;
      Points vertices;
      own->place(pose, nullptr, &joints, &vertices);
      FileSkin out{{}, own->blends(pose)};
      for (const Point& p : vertices) out.vertices.push_back(p.cast<double>());
      return out;
    };
  const BareDocument bare(target_file, body.rest.vertices.size(), true);
  bare.say_remarks();
  if (!bare.known()) return {};
  const bool moved = target.unposed.has_value();
  std::vector<Mat3> stored = bare.stored(body.rest.vertices.size());
  const bool plain =
      std::all_of(stored.begin(), stored.end(), [](const Mat3& m) { return m.isIdentity(1e-12); });
  if (plain && !moved) return {};
  JointMoves moves;
  moves.fill(Eigen::Isometry3d::Identity());
  if (moved) moves = *target.unposed;
  return [body, moves, stored = std::move(stored)](const Pose& pose) {
    const PosedSkeleton posed = forward_kinematics(body.joints, pose);
    FileSkin out{skinned(body, pose), {}};
    for (size_t v = 0; v < stored.size(); ++v) {
      Mat3 sum = Mat3::Zero();
      for (size_t j = 0; j < kJoints; ++j)
        sum += static_cast<double>(
                   body.weights(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(j))) *
               (posed.global[j] * moves[j].linear());
      out.blends.emplace_back(sum * stored[v]);
    }
    return out;
  };
}

Json write_track_glb(const TrackedTake& t) {
  const OffsetFrames frames = [&](const std::function<void(const Points&)>& visit) {
    for (int64_t f = 0; f < t.journal.frames(); ++f) visit(t.journal.read(f).points);
  };
  const GlbOfTake glb(t);
  const std::string& out = t.c.how.to.out;
  const double seconds = static_cast<double>(t.journal.frames()) / t.fps;
  double error = 1e-3 * t.c.detail.value_or(kUsualDetail);
  size_t most = kMostComponents;
  if (t.c.rate) {
    most = affordable(glb, surface_components(frames, 0, 1), t.journal.folder() + "/draft.glb",
                      1e3 * *t.c.rate * seconds);
    error = 0;
  }
  const SurfaceComponents found = surface_components(frames, error, most);
  glb.write(found, out);
  const double bytes = bytes_at(out), rate = 1e-3 * bytes / seconds;
  if (t.c.rate && rate > *t.c.rate)
    log_warning(
        format("the file has %.0f kB/s without any morph target: bones and mesh need that", rate));
  if (!t.c.rate && found.error.p95 > error)
    log_warning(format("%zu morph targets keep 95 %% of the vertices' errors below %.2f mm only",
                       found.deltas.size(), 1e3 * found.error.p95));
  return {{"morph_targets", found.deltas.size()},
          {"surface_error_mm",
           {{"mean", 1e3 * found.error.mean},
            {"p95", 1e3 * found.error.p95},
            {"max", 1e3 * found.error.max}}},
          {"bytes", bytes},
          {"kilobytes_per_second", rate}};
}

}  // namespace restage::cli
