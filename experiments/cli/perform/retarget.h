// What the files of `restage retarget` share, and `restage stream` with them.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "datasets/importers/rigs/gltf_character.h"
#include "datasets/readers/frames/frame_folder.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/retarget_sink.h"
#include "infer/systems.h"

namespace restage::cli {

struct RetargetCommand {
  SourceRecord source;
  std::string target, bones, source_bones, body_model, person, asf, layout, weights, device = "cpu";
  std::string system = "chain", rest;
  SinkOptions to;
  RetargetOptions options;
  std::string floor, contacts;  ///< "on" or "off"; empty: is_on() decides
  bool profile = false, from_surface = false;
};

/// What a caller that is no command line (python/) gives, and what it wants.
struct RetargetCaller {
  std::unique_ptr<FrameSource> clouds = nullptr;  ///< the source; null: the file that is named
  /// Where frames go; null: into the file that is named.
  std::function<Sink(const Shown&)> sink = nullptr;
  std::function<void()> every_frame = nullptr;  ///< is called before each frame, and may throw
  void look() const {
    if (every_frame) every_frame();
  }
};

/// What was done: the command's document, and the same in words.
struct Retargeted {
  Json document;
  std::string text;
};
/// The command itself; it prints nothing on standard output.
Retargeted retarget(const RetargetCommand& c, const Common& common, RetargetCaller caller = {});
/// All options of the command. `files`: its source and its result are files, which have to be
/// named.
void add_retarget_options(CommandOptions app, RetargetCommand& c, bool files = true);

/// The options of every command that makes a system: the target, the weights, how they are used.
void add_target_options(CommandOptions app, RetargetCommand& c);
void add_weights_options(CommandOptions app, RetargetCommand& c);
void add_system_options(CommandOptions app, RetargetCommand& c);
/// What the animation in a result is called, whose bones it moves, and whether meshes are left out.
void add_animation_options(CommandOptions app, SinkOptions& to);
/// All of these, and how clouds that come one by one are read: what makes a system that somebody
/// else feeds (python/). It answers at once, unless --no-online lets its network look ahead.
void add_live_options(CommandOptions app, RetargetCommand& c);
/// InputError naming an option that is out of range, or that the system does not read.
void check_options(const RetargetOptions& options, const SystemType& type);
/// The doctor's words on a target that would make the result nonsense, unless `force`.
void check_mesh(const RetargetCommand& c, const TargetMesh& target);

/// What the command's system is made from, but for its target: weights and options.
SystemInput load_input(const RetargetCommand& c, const Common& common);
/// The same with the target; what is refused because its rig is not known says so.
std::unique_ptr<System> system_for(const RetargetCommand& c, SystemInput input, TargetMesh& target);
/// Whether feet are put on the floor, and hands where the source's touch: unless something else is
/// asked for (`asked`), of every target but a bare mesh whose result is numbers, which may be
/// measured.
bool is_on(const std::string& asked, const RetargetCommand& c, const TargetMesh& target);
/// Who stands in for a source whose surface is not known, with legs of 1 m.
PartSurfaces average_surfaces();
/// Where frames go, and which joints the target's are: its rig's, those of --rest, else those of
/// the weights. InputError: they cannot be converted to --joints, or --rest holds others than the
/// weights.
SinkOptions sink_options(const RetargetCommand& c, const SystemInput& input,
                         const TargetMesh& target);
/// InputError for a character whose rig is not recognised where its own file is to come out, unless
/// a skeleton of ours is asked for.
void check_kept(const RetargetCommand& c, const TargetMesh& target);

/// A source whose skeleton is known: its turns go over as they are, and no network is asked but for
/// a target without a rig.
/// Whether the source has a skeleton to be taken over; holds_take().
bool has_take(const RetargetCommand& c, std::string* why);
Retargeted run_take(const RetargetCommand& c, const Common& common, const RetargetCaller& caller);

}  // namespace restage::cli
