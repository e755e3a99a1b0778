#include "datasets/sampling/transfers.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "autograd/base/error.h"
#include "autograd/base/parallel.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

/// `count` of the numbers below `all`, in random order.
std::vector<int32_t> drawn(Rng& rng, size_t all, size_t count, bool shuffle) {
  std::vector<int32_t> out(all);
  std::iota(out.begin(), out.end(), 0);
  if (!shuffle && count == all) return out;
  for (size_t i = 0; i < count; ++i) std::swap(out[i], out[i + rng.below(all - i)]);
  out.resize(count);
  if (!shuffle) std::sort(out.begin(), out.end());
  return out;
}

/// Those of `points` that `order` names, into a row of a tensor.
void write_in_order(float* to, const Points& points, const std::vector<int32_t>& order) {
  for (size_t i = 0; i < order.size(); ++i)
    Eigen::Map<Point>(to + 3 * i) = points[static_cast<size_t>(order[i])];
}

}  // namespace

Point centre_box(Points& points) {
  const Point centre = points.empty() ? Point::Zero() : Point(box_of(points).center());
  for (Point& p : points) p -= centre;
  return centre;
}

TransferSampler::TransferSampler(const Corpus& corpus, const TransferConfig& config, uint64_t seed,
                                 const TransferSampler* like)
    : corpus_(corpus),
      config_(config),
      key_(RngKey{seed, 0}.fold("transfers")),
      frames_(corpus.motions, static_cast<size_t>(std::max(
                                  1, (config.frames - 1) * std::max(1, config.frame_step) + 1))) {
  if (corpus.bodies.empty()) throw InputError("", "no bodies to draw from", "add bodies");
  find_meshes(like);
  check_setting("transfer", config_.frames >= 1 && config_.frames <= 64, "frames", "1 to 64");
  check_setting("transfer", config_.frame_step >= 1, "frame_step", "1 or more");
  check_setting("transfer", config_.points >= 0 && config_.points <= vertices(), "points",
                ("0 to " + std::to_string(vertices()) + ", the vertices of a body").c_str());
}

/// Thins each topology once, so that bodies of one topology keep the same vertices.
void TransferSampler::find_meshes(const TransferSampler* like) {
  const auto number_of = [](const std::vector<const Mesh*>& known, const Mesh& mesh) {
    size_t k = 0;
    while (k < known.size() &&
           (known[k]->vertices.size() != mesh.vertices.size() || known[k]->faces != mesh.faces))
      ++k;
    return k;
  };
  for (const Body& body : corpus_.bodies) {
    if (body.rest.faces.empty())
      throw InputError("", "body '" + body.id + "' has no faces, which the edge loss needs",
                       "give meshes");
    const size_t k = number_of(wholes_, body.rest);
    mesh_of_.push_back(k);
    if (k < wholes_.size()) continue;
    wholes_.push_back(&body.rest);
    const size_t there = like == nullptr ? 0 : number_of(like->wholes_, body.rest);
    if (like != nullptr && there < like->meshes_.size())
      meshes_.push_back(like->meshes_[there]);
    else
      meshes_.push_back(thin_mesh(body.rest, static_cast<size_t>(std::max(0, config_.vertices))));
    faces_ = std::max(faces_, std::ssize(meshes_.back().faces));
    if (std::ssize(meshes_.back().kept) != vertices()) {
      const int64_t least = std::min(vertices(), std::ssize(meshes_.back().kept));
      throw InputError("",
                       "bodies have different numbers of vertices, one of them " +
                           std::to_string(least) + ", and all must be thinned to the same number",
                       "set transfer.pairs.vertices to " + std::to_string(least) +
                           " or less, such as 1000, or give data whose bodies have more");
    }
  }
}

void TransferSampler::fill(TransferBatch& batch, int64_t row, const RngKey& key) const {
  Rng rng(key);
  const size_t bodies = corpus_.bodies.size();
  const size_t a = rng.below(bodies);
  const size_t b = bodies > 1 ? (a + 1 + rng.below(bodies - 1)) % bodies : a;
  const FrameRef at = frames_.at(rng.below(frames_.count()));
  const Mat3 turn = turn_about_y(config_.heading * M_PI / 180 * (2 * rng.uniform() - 1));
  const auto v = static_cast<size_t>(vertices()), p = static_cast<size_t>(points());
  const std::vector<int32_t> order = drawn(rng, v, v, config_.shuffle);
  const ThinMesh& mesh = meshes_[mesh_of_[b]];
  const Body& target = corpus_.bodies[b];
  const auto posed = [&](size_t who, const FrameRef& f) {
    const Body& body = corpus_.bodies[who];
    Points out = pose_surface(body, pose_on(corpus_.motions[f.motion], body, f.frame),
                              &meshes_[mesh_of_[who]].kept);
    for (Point& x : out) x = turn.cast<float>() * x;
    centre_box(out);
    return out;
  };
  for (int t = 0; t < config_.frames; ++t) {
    const FrameRef now{at.motion, at.frame + static_cast<size_t>(t * config_.frame_step)};
    const int64_t place = row * config_.frames + t;
    write_in_order(batch.pose.data<float>() + place * points() * 3, posed(a, now),
                   drawn(rng, v, p, config_.shuffle));
    write_in_order(batch.truth.data<float>() + place * vertices() * 3, posed(b, now), order);
  }
  Points identity;
  if (config_.identity == Identity::posed) {
    identity = posed(b, frames_.at(rng.below(frames_.count())));
  } else {
    for (const int32_t i : mesh.kept)
      identity.push_back(target.rest.vertices[static_cast<size_t>(i)]);
    centre_box(identity);
  }
  write_in_order(batch.identity.data<float>() + row * vertices() * 3, identity, order);
  std::vector<int32_t> place(v);
  for (size_t i = 0; i < v; ++i) place[static_cast<size_t>(order[i])] = static_cast<int32_t>(i);
  int32_t* const faces = batch.faces.data<int32_t>() + row * faces_ * 3;
  int32_t* face = faces;
  for (const Triangle& f : mesh.faces)
    for (const int32_t i : f) *face++ = place[static_cast<size_t>(i)];
  std::fill(face, faces + 3 * faces_, 0);
}

TransferBatch TransferSampler::batch(int64_t first, int64_t n) const {
  TransferBatch out;
  out.pose = Tensor::empty({n, config_.frames, points(), 3});
  out.identity = Tensor::empty({n, vertices(), 3});
  out.truth = Tensor::empty({n, config_.frames, vertices(), 3});
  out.faces = Tensor::empty({n, faces_, 3}, DType::i32);
  parallel_for(n, 1, [&](int64_t from, int64_t to) {
    for (int64_t i = from; i < to; ++i) fill(out, i, key_.fold(static_cast<uint64_t>(first + i)));
  });
  return out;
}

}  // namespace restage
