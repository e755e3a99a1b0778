// Where the frames of `restage retarget` go, by the ending of --out.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "datasets/importers/rigs/gltf_own_rig.h"
#include "datasets/schema.h"
#include "infer/system.h"

namespace restage::cli {

struct SinkOptions {
  std::string out, format, clip_name;  ///< empty format: the target's own, else PLY
  bool in_memory = false;  ///< the result is a caller's arrays, which are as an X.h5; no `out`
  bool animation_only = false;
  /// Which joints the system gives (empty: not known), and which ones a file is to hold (empty:
  /// those).
  JointDefinition definition, joints;
  std::string skeleton;  ///< of a target without a rig, one of rig_conventions(); empty: restage
  int64_t every = 1;     ///< of the source's frames, one is taken
  double fps = kFps;     ///< of an animation
  double rate() const { return fps / static_cast<double>(every); }  ///< of the result
};

/// What a writer takes of each frame, and how it ends. `filled`: the numbers of the frames that are
/// RetargetedFrame::filled.
struct Sink {
  std::function<void(const RetargetedFrame&)> push;
  std::function<void(const std::vector<int64_t>& filled)> commit;
};

/// What is moved: the target, its skeleton (null: none), and TargetMesh::unposed.
struct Shown {
  const Mesh& target;
  const SystemRig* rig;
  const JointMoves* unposed = nullptr;
};

/// InputError for an ending that cannot be written, and for options that do not go with it.
void check_sink(const SinkOptions& options);

/// `source`: for files that remember it; nothing: a source without a surface. `clip`: what its
/// motion is called. `own`: the target's own rig, of the file `target`; null: it has none.
/// InputError if the target lacks what the ending needs.
Sink make_sink(const SinkOptions& options, const Shown& shown,
               const std::optional<SourceRecord>& source, const std::string& clip,
               const std::string& target, const std::shared_ptr<const GltfOwnRig>& own);

/// The same with its joints converted to SinkOptions::joints, if those are asked for.
Sink in_joints(const SinkOptions& options, Sink sink);

/// What the animation is called that a target with a rig gets, for a motion called `clip`: a name
/// that none of the file's has.
std::string own_clip_name(const SinkOptions& options, const std::string& clip,
                          const std::string& target, const GltfOwnRig& own);

/// What the motion of a source of clouds is called: its clip's name, else its file's.
std::string clip_name(const SourceRecord& source);

}  // namespace restage::cli
