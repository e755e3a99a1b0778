#include "datasets/characters/gltf_clip.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/errors.h"
#include "nn/geometry/rotation_key.h"

namespace restage {

GltfClipWriter::GltfClipWriter(std::string out, const std::string& in,
                               std::shared_ptr<const GltfOwnRig> rig, Options options)
    : out_(std::move(out)),
      in_(in),
      content_(read_gltf_bytes(in)),
      rig_(std::move(rig)),
      options_(std::move(options)) {
  if (options_.name.empty())
    throw InputError(out_, "its animation has no name", "give {clip-name}");
  GltfDocument(content_, in_).check_place(out_);
}

void GltfClipWriter::push(const Pose& pose, std::optional<double> confidence,
                          const FingerTurns* fingers) {
  const NodeTurns turns = rig_->turns(pose, fingers);
  bool finite = true;
  for (const auto& [node, place] : turns.moved) finite = finite && place.allFinite();
  const size_t count = turns.local.size();
  for (size_t i = 0; i < count; ++i) {
    if (frames() == 0) nodes_.push_back(turns.local[i].first);
    const Quat& turn = turns.local[i].second;
    finite = finite && turn.coeffs().allFinite();
    const size_t at = turns_.size();
    turns_.push_back(rotation_key(turn, at >= count ? &turns_[at - count] : nullptr));
  }
  if (!finite)
    throw WorkError(out_ + ": the pose of frame " + std::to_string(frames()) +
                    " is not finite; check the source and the weights");
  if (moves_.empty())
    for (const auto& [node, place] : turns.moved) moves_.emplace_back(node, std::vector<float>());
  for (size_t i = 0; i < moves_.size(); ++i)
    for (const double x : turns.moved[i].second) moves_[i].second.push_back(static_cast<float>(x));
  if (confidence) confidence_.push_back(std::round(*confidence * 1e3) / 1e3);
}

void GltfClipWriter::commit() {
  GltfDocument document(content_, in_);
  if (options_.animation_only) document.keep_nodes_only();
  if (frames() > 0) {
    const size_t count = nodes_.size();
    GltfDocument::Clip clip;
    clip.name = options_.name;
    clip.fps = options_.fps;
    clip.frames = frames();
    clip.moves = moves_;
    clip.confidence = confidence_;
    clip.filled = filled_;
    for (const GltfNode& node : rig_->file().nodes) {
      const auto is_moved = [&](const auto& move) { return move.first == node.number; };
      if (std::none_of(moves_.begin(), moves_.end(), is_moved) &&
          std::find(nodes_.begin(), nodes_.end(), node.number) == nodes_.end())
        continue;
      const Vec3 &t = node.translation, &s = node.scale;
      const Eigen::Vector4d r = node.rotation.normalized().coeffs();
      clip.rest[node.number] = {t[0], t[1], t[2], r[0], r[1], r[2], r[3], s[0], s[1], s[2]};
    }
    for (size_t i = 0; i < count; ++i) {
      auto& track = clip.turns.emplace_back(nodes_[i], std::vector<std::array<float, 4>>());
      for (size_t f = 0; f < frames(); ++f) track.second.push_back(turns_[f * count + i]);
    }
    document.append(clip);
    if (bulge_) document.bulge(*bulge_, rig_->file());
  }
  document.write(out_);
}

}  // namespace restage
