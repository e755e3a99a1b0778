// What the files of `restage track` share.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "experiments/cli/perform/retarget.h"
#include "experiments/cli/perform/retarget_gaps.h"
#include "experiments/cli/perform/track_work.h"
#include "experiments/source.h"
#include "infer/track/atlas.h"
#include "infer/track/journal.h"

namespace restage::cli {

struct TrackCommand {
  RetargetCommand how;           ///< its target is the template
  std::optional<double> detail;  ///< mm
  std::optional<double> rate;    ///< kB a second
  bool texture = false, surface = true;
};

inline constexpr const char* kAutoTemplate = "auto";
/// Whether the result is a GLB file, which is made of offsets; others are made of vertices.
bool writes_glb(const TrackCommand& c);

/// Small numbers of all frames.
struct TrackTake {
  std::vector<std::optional<double>> confidence;
  std::vector<std::optional<MiddleAndMost>> distance;
  std::vector<int64_t> filled;
  size_t points_left_out = 0;

  int64_t frames() const { return std::ssize(distance); }
  /// The middle of all frames' distances.
  MiddleAndMost middle() const;
  /// Frames that fit badly.
  std::vector<int64_t> poor() const;
};

/// The person's own body, made from the clouds that show it best, in the folder of the work: as
/// kTemplateMesh, with texture coordinates, and with joints and weights. Taken from there if it
/// was made before.
Body auto_template(const TrackCommand& c, const Common& common, Source& source,
                   const TrackWork& work);
/// The file of its mesh.
std::string auto_template_mesh(const TrackWork& work);

/// Texture coordinates of such a body, and its OBJ file; `texture`: with the material of
/// make_texture().
Atlas template_atlas(const Body& body);
std::string template_obj(const Body& body, const Atlas& atlas, bool texture);

/// InputError: the first frame has no colours.
void check_colours(Source& source);
/// The colours of the frames that fit best, as a picture and a material beside the template's mesh,
/// which names them from then on. What is told of it.
Json make_texture(Source& source, const TrackWork& work, const Tracker& tracker,
                  const TrackJournal& journal, const TrackTake& take);

/// All frames of the source through networks and tracker, into the journal; those that are there
/// already only through the networks.
TrackTake run_frames(const TrackCommand& c, Source& source, System& system, Tracker& tracker,
                     TrackJournal& journal, Gaps& gaps);

/// What a take is written from.
struct TrackedTake {
  const TrackCommand& c;
  const TargetMesh& target;
  const std::string& target_file;
  const Tracker& tracker;
  const TrackJournal& journal;
  const TrackTake& take;
  std::string clip;
  double fps;
};
/// X.glb: the template's file, its bones or ours, morph targets. What is told of it.
Json write_track_glb(const TrackedTake& t);
/// Where the file of a template without bones stores offsets; empty: as the body has them.
std::function<FileSkin(const Pose&)> file_skin(const TrackCommand& c, const TargetMesh& target,
                                               const std::string& target_file, const Body& body);

}  // namespace restage::cli
