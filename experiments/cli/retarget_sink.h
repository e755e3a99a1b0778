// Where the frames of `restage retarget` go, by the ending of --out.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "datasets/importers/gltf_own_rig.h"
#include "datasets/schema.h"
#include "infer/system.h"

namespace restage::cli {

struct SinkOptions {
  std::string out, format = "ply", clip_name;
  bool animation_only = false;
  int64_t every = 1;  ///< of the source's frames, one is taken
  double rate() const { return kFps / static_cast<double>(every); }  ///< of the result
};

/// What a writer takes of each frame, and how it ends. `filled`: the numbers of the frames that are
/// RetargetedFrame::filled.
struct Sink {
  std::function<void(const RetargetedFrame&)> push;
  std::function<void(const std::vector<int64_t>& filled)> commit;
};

/// InputError for an ending that cannot be written, and for options that do not go with it.
void check_sink(const SinkOptions& options);

/// `own`: the target's own rig, of the file `target`; null: it has none. InputError if the system
/// or the target lacks what the ending needs.
Sink make_sink(const SinkOptions& options, const System& system, const SourceRecord& source,
               const std::string& target, const std::shared_ptr<const GltfOwnRig>& own);

}  // namespace restage::cli
