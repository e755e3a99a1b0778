// restage track: one mesh over all scans of somebody.
#include "experiments/cli/perform/track.h"

#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/base/words.h"
#include "datasets/readers/text/text.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/perform/bare_document.h"
#include "experiments/cli/perform/retarget_words.h"
#include "experiments/cli/perform/source_options.h"
#include "experiments/cli/perform/standard_weights.h"

namespace restage::cli {

bool writes_glb(const TrackCommand& c) { return text::ends_in(c.how.to.out, {".glb"}); }

namespace {

bool is_auto(const TrackCommand& c) { return c.how.target == kAutoTemplate; }

void check(const TrackCommand& c) {
  const std::string& out = c.how.to.out;
  const bool folder = std::filesystem::path(out).extension().empty();
  if (!writes_glb(c) && !folder && !out.ends_with(".h5"))
    throw InputError(out, "is of no kind that can be written",
                     "end it in .glb, .h5, or / for a folder of frames");
  check_sink(c.how.to);
  for (const auto& [given, name] : {std::pair(&c.detail, "--detail"), {&c.rate, "--rate"}})
    if (given->has_value() && !writes_glb(c))
      throw InputError(out, "has every vertex of every frame", cat("leave ", name, " out"));
  if (c.detail && !(*c.detail > 0 && *c.detail <= 1000))
    throw InputError("", "--detail is out of range", "give millimetres above 0, up to 1000");
  if (c.rate && !(*c.rate > 0 && *c.rate <= 1e6))
    throw InputError("", "--rate is out of range", "give kilobytes a second, above 0");
  if (c.rate && c.detail)
    throw InputError("", "--rate and --detail both choose the number of morph targets",
                     "leave one out");
  if (c.texture && !is_auto(c))
    throw InputError(c.how.target, "has texture coordinates and materials of its own",
                     "leave --texture out, or --template");
  if (c.texture && !writes_glb(c))
    throw InputError(out, "holds no picture", "end --out in .glb with --texture");
  std::vector<std::string> inputs = {c.how.source.path};
  if (!is_auto(c)) inputs.push_back(c.how.target);
  if (!c.how.weights.empty()) inputs.push_back(weights_path(c.how.weights));
  if (!c.how.bones.empty()) inputs.push_back(c.how.bones);
  check_output(out, inputs);
}

/// All on which the tracked frames depend.
Json work_of(const TrackCommand& c, const Common& common, const Source& source) {
  const SourceRecord& how = source.record();
  const std::string weights =
      weights_path(c.how.weights.empty() ? standard_weights() : c.how.weights);
  return {{"source", how.path},
          {"stamp", stamp_of(how.path)},
          {"clip", how.clip},
          {"sequence", how.sequence.value_or(-1)},
          {"fps", source.fps()},
          {"scale", how.scale},
          {"up", how.up},
          {"template", is_auto(c) ? c.how.target : stamp_of(c.how.target)},
          {"bones", c.how.bones.empty() ? "" : stamp_of(c.how.bones)},
          {"weights", stamp_of(weights)},
          {"device", c.how.device},
          {"seed", common.seed},
          {"force", c.how.options.force},
          {"surface", c.surface},
          {"offsets", writes_glb(c)}};
}

/// The template, whoever brought it, and the networks for it.
struct Performer {
  std::string file;
  TargetMesh target;
  std::unique_ptr<System> system;
  Body body;
  SinkOptions to;
};

Performer own_performer(const TrackCommand& c, const Common& common, Source& source,
                        const TrackWork& work) {
  Performer out{auto_template_mesh(work), {}, {}, auto_template(c, common, source, work), {}};
  out.target.mesh = out.body.rest;
  SystemInput input = load_input(c.how, common);
  out.to = sink_options(c.how, input, out.target);
  input.target = out.body.rest;
  input.rest = out.body.joints;
  out.system = make_system(system_type(c.how.system), std::move(input));
  return out;
}

Performer given_performer(const TrackCommand& c, const Common& common, TargetMesh target) {
  Performer out{c.how.target, std::move(target), {}, {}, {}};
  SystemInput input = load_input(c.how, common);
  out.to = sink_options(c.how, input, out.target);
  out.system = system_for(c.how, std::move(input), out.target);
  const SystemRig& rig = *out.system->rig();
  out.body.rest = out.system->target();
  out.body.joints = rig.rest;
  out.body.weights = rig.weights;
  return out;
}

/// Frames as numbers, or as files in the template's own format.
void write_frames(const TrackedTake& t, SinkOptions to, const Performer& who,
                  const SourceRecord& source) {
  to.fps = t.fps;
  const SystemRig rig{t.tracker.body().joints, t.tracker.body().weights};
  const Shown shown{who.system->target(), &rig, nullptr};
  const Sink sink = make_sink(to, shown, source, t.clip, who.file, nullptr);
  for (int64_t f = 0; f < t.journal.frames(); ++f) {
    JournalFrame in = t.journal.read(f);
    RetargetedFrame out;
    out.pose = in.pose;
    out.joints = forward_kinematics(t.tracker.body().joints, in.pose).joints;
    out.vertices = std::move(in.points);
    out.confidence = in.confidence;
    out.filled = in.filled;
    sink.push(out);
  }
  sink.commit(t.take.filled);
}

Json document_of(const TrackCommand& c, const Common& common, const TrackTake& take,
                 const Gaps& gaps, const Source& source, size_t vertices) {
  Json distances = Json::array(), confidence = Json::array();
  for (const auto& d : take.distance)
    distances.push_back(d ? Json({{"median", 1e3 * d->median}, {"p95", 1e3 * d->p95}}) : Json());
  for (const auto& sure : take.confidence) confidence.push_back(sure ? Json(*sure) : Json());
  const MiddleAndMost middle = take.middle();
  return {{"out", c.how.to.out},
          {"source_frames", source.frames()},
          {"frames", take.frames()},
          {"fps", source.fps()},
          {"vertices", vertices},
          {"seed", common.seed},
          {"distance_mm", {{"median", 1e3 * middle.median}, {"p95", 1e3 * middle.p95}}},
          {"frame_distances_mm", distances},
          {"confidence", confidence},
          {"poor_frames", take.poor()},
          {"missing", gaps.json()},
          {"filled", take.filled},
          {"points_left_out", take.points_left_out}};
}

std::string text_of(const Json& document, const TrackTake& take) {
  std::string out = "wrote " + document["out"].get<std::string>() + ": " +
                    counted(take.frames(), "frame") +
                    format("; its points are %.1f mm from the surface, 95 %% below %.1f mm",
                           1e3 * take.middle().median, 1e3 * take.middle().p95);
  if (document.contains("morph_targets"))
    out += format(
        "; %d morph targets, exact to %.2f mm (95 %%), %.0f kB, %.0f kB/s",
        document["morph_targets"].get<int>(), document["surface_error_mm"]["p95"].get<double>(),
        1e-3 * document["bytes"].get<double>(), document["kilobytes_per_second"].get<double>());
  return out + " (seed " + std::to_string(document["seed"].get<uint64_t>()) + ")\n";
}

void say_at_the_end(const Performer& who, const Source& source, const Gaps& gaps,
                    const TrackTake& take) {
  say_target(who.target);
  for (const std::string& line : source.remarks()) log_warning(line);
  for (const std::string& line : gaps.lines(take.filled)) log_warning(line);
  if (const auto poor = take.poor(); !poor.empty())
    log_warning("the surface fits badly in " + counted(std::ssize(poor), "frame") + ": " +
                listed(poor, 8));
}

Json track(const TrackCommand& c, const Common& common, Source& source,
           std::optional<TargetMesh> target, const TrackWork& work, std::string* text) {
  const Performer who = target ? given_performer(c, common, std::move(*target))
                               : own_performer(c, common, source, work);
  TrackOptions options;
  options.deform = c.surface;
  options.skin = file_skin(c, who.target, who.file, who.body);
  Tracker tracker(who.body, c.how.target, options);
  TrackJournal journal(work.folder(), who.body.rest.vertices.size());
  if (journal.frames() > 0)
    log_info("going on behind " + counted(journal.frames(), "frame") +
             " of a run that was stopped");
  Gaps gaps(source.frames(), source.fps(), c.how.options.force);
  const TrackTake take = run_frames(c, source, *who.system, tracker, journal, gaps);
  Json document = document_of(c, common, take, gaps, source, who.body.rest.vertices.size());
  const TrackedTake all{
      c, who.target, who.file, tracker, journal, take, clip_name(source.record()), source.fps()};
  if (c.texture) document["texture"] = make_texture(source, work, tracker, journal, take);
  if (writes_glb(c))
    document.update(write_track_glb(all));
  else
    write_frames(all, who.to, who, source.record());
  say_at_the_end(who, source, gaps, take);
  *text = text_of(document, take);
  return document;
}

int run_track(const TrackCommand& given, const Common& common) {
  TrackCommand c = given;
  // The person's own motion, in the person's own place; each cloud is a frame of the result.
  c.how.floor = c.how.contacts = "off";
  c.how.options.foot_lock = false;
  c.how.options.late = true;
  check(c);
  Source source(c.how.source, common.max_memory);
  if (source.frames() == 0)
    throw InputError(c.how.source.path, "holds no frames", "give at least one cloud");
  std::optional<TargetMesh> target;
  if (!is_auto(c)) {
    target = read_target(c.how.target, c.how.bones);
    check_mesh(c.how, *target);
    if (target->mesh.faces.empty())
      throw InputError(c.how.target, "has no faces, and a surface is fitted by them",
                       "give a mesh");
    if (target->own && !c.how.to.skeleton.empty())
      throw InputError(c.how.target, "has a rig of its own, which is kept", "leave --skeleton out");
  }
  if (!c.how.options.force) check_first_frames(source);
  if (c.texture) check_colours(source);
  const TrackWork work(c.how.to.out, work_of(c, common, source));
  std::string text;
  try {
    const Json document = track(c, common, source, std::move(target), work, &text);
    work.remove();
    print(common.json, document, text);
  } catch (const InputError&) {  // the same would happen again
    work.remove();
    throw;
  }
  return 0;
}

}  // namespace

void add_track(Program& program) {
  auto [app, c] = program.add(
      "track", "one mesh over all scans of somebody: a rigged character with a surface that moves",
      "restage track --source scans/ --out actor.glb\n"
      "restage track --source scans/ --template body.obj --out actor.glb --rate 100\n"
      "restage track --source scans/ --template body.ply --out stiff.glb --no-surface\n"
      "restage track --source coloured/ --out actor.glb --texture\n"
      "restage track scans.h5 actor.glb --detail 0.5 --skeleton mixamo --json\n"
      "restage track --source scans/ --template body.ply --out frames/ --format ply\n"
      "restage track --source mm/ --scale mm --source-up z --fps 30 --template body.ply --out "
      "a.h5\n"
      "restage track --source s.h5 --sequence 2 --template body.glb --bones names.yaml --out a.h5\n"
      "restage track --source dance.glb --clip Walk --template body.ply --weights w --device cpu "
      "--out a.glb --force",
      run_track);
  c.how.target = kAutoTemplate;
  app.add_option("--source,SOURCE", c.how.source.path,
                 "clouds of one person: a folder, HDF5 file, glTF or arrays")
      .required();
  app.add_option("--out,OUT", c.how.to.out, "X.glb, X.h5, or a folder for PLY or OBJ frames")
      .required();
  app.add_option("--template", c.how.target,
                 "auto: the person's own mesh is made from the clouds; or the same person's mesh, "
                 "with faces, y up, best in T-pose facing +z (default: auto)");
  app.add_option("--detail", c.detail,
                 "of X.glb: as many morph targets are kept, up to 64, that 95 % of the vertices' "
                 "errors are below so many mm (default: 1)");
  app.add_option("--rate", c.rate,
                 "of X.glb: as many morph targets are kept that the file has so many kB a second");
  app.add_flag(
      "--texture", c.texture,
      "colours of PLY and OBJ scans are collected into one picture (with --template auto)");
  app.add_flag("!--no-surface", c.surface,
               "the skeleton alone follows the clouds, and the mesh follows the skeleton");
  app.add_option("--skeleton", c.how.to.skeleton,
                 "names and axes of the bones of X.glb: restage, smpl, mixamo, vrm, unreal "
                 "(default: restage)");
  app.add_option("--format", c.how.to.format,
                 "of a folder's frames: ply or obj (default: the template's own, else ply)");
  app.add_option("--bones", c.how.bones,
                 "which bone of a rigged template is which joint, a .yaml file or a known family "
                 "(default: found)");
  app.add_option("--weights", c.how.weights,
                 "weights file, run, artifact, standard or lite (default: standard)");
  app.add_option("--device", c.how.device,
                 "where extractor and motion network run: cpu, or cuda in a program built for it");
  add_source_options(app, c.how.source);
  add_force(app, c.how.options.force,
            "a template that is no T-pose, clouds in which nobody is found, gaps of over a third "
            "of a second");
}

}  // namespace restage::cli
