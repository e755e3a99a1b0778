// restage adapt: an extractor learns from a studio's own captures, without a truth.
#include "experiments/adapt/adapt.h"
#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/joint_source.h"
#include "experiments/cli/perform/source_options.h"
#include "experiments/cli/perform/standard_weights.h"
#include "experiments/slow_work.h"
#include "experiments/text.h"

namespace restage::cli {
namespace {

struct AdaptCommand {
  std::vector<std::string> sources;
  SourceRecord how;
  std::string weights, out;
  AdaptOptions options;
  bool force = false;
};

void check(const AdaptCommand& c) {
  if (!c.out.ends_with(".safetensors"))
    throw InputError(c.out, "names no weights file", "end --out in .safetensors");
  const AdaptOptions& o = c.options;
  const auto in = [](const char* name, double value, double least, double most) {
    if (!(value >= least && value <= most))
      throw InputError("", std::string(name) + " is out of range",
                       format("give a number from %g to %g", least, most));
  };
  in("--steps", static_cast<double>(o.steps), 1, 1e6);
  in("--rate", o.rate, 1e-8, 0.1);
  in("--samples", o.samples, 1, 256);
  in("--batch", static_cast<double>(o.batch), 1, 1024);
  in("--min-confidence", o.min_confidence, 0, 1);
  in("--held-out", o.held_out, 0.05, 0.9);
  for (const std::string& source : c.sources) refuse_joints(source);
  std::vector<std::string> inputs = c.sources;
  inputs.push_back(c.weights);
  check_output(c.out, inputs);
}

Json json_of(const AdaptFigures& f) {
  return {{"bone_length_sd_mm", 1e3 * f.bone_length_sd},
          {"jitter_mm", 1e3 * f.jitter},
          {"surface_mm", 1e3 * f.surface},
          {"swaps", f.swaps},
          {"confidence", f.confidence ? Json(*f.confidence) : Json(nullptr)}};
}

std::string table_of(const Adapted& a) {
  const auto row = [](const char* what, double before, double after, const char* how) {
    return std::vector<std::string>{what, format(how, before), format(how, after)};
  };
  const AdaptFigures &b = a.before, &c = a.after;
  std::vector<std::vector<std::string>> rows = {
      {"held-out frames", "before", "after"},
      row("bone lengths, standard deviation", 1e3 * b.bone_length_sd, 1e3 * c.bone_length_sd,
          "%.4g mm"),
      row("jitter", 1e3 * b.jitter, 1e3 * c.jitter, "%.4g mm"),
      row("surface from the person's own body", 1e3 * b.surface, 1e3 * c.surface, "%.4g mm"),
      row("legs or arms changed sides", 100 * b.swaps, 100 * c.swaps, "%.3g %% of frames")};
  if (b.confidence && c.confidence)
    rows.push_back(row("confidence", *b.confidence, *c.confidence, "%.3g"));
  return markdown_table(rows);
}

int run_adapt(const AdaptCommand& c, const Common& common) {
  AdaptCommand command = c;
  command.weights = weights_path(c.weights.empty() ? standard_weights() : c.weights);
  check(command);
  Bundle models = load_bundle(command.weights);
  std::vector<std::unique_ptr<Source>> sources;
  for (const std::string& path : c.sources) {
    SourceRecord how = c.how;
    how.path = path;
    sources.push_back(std::make_unique<Source>(how, common.max_memory));
    if (!c.force) check_first_frames(*sources.back());
  }
  command.options.seed = common.seed;
  SlowWork slow;
  slow.on("looking, learning and looking again");
  const Adapted done = adapt(sources, models, command.weights, command.options);
  slow.on("");
  for (const auto& source : sources)
    for (const std::string& remark : source->remarks()) log_warning(remark);
  if (!done.gained)
    throw WorkError(format(
        "the held-out frames did not gain (bones %.3g to %.3g mm, jitter %.3g to "
        "%.3g mm, surface %.3g to %.3g mm), and nothing is written; give more frames, or another "
        "--rate",
        1e3 * done.before.bone_length_sd, 1e3 * done.after.bone_length_sd, 1e3 * done.before.jitter,
        1e3 * done.after.jitter, 1e3 * done.before.surface, 1e3 * done.after.surface));
  save_bundle(c.out, models);
  if (done.left_out > 0)
    log_warning("teaching nothing: " + counted(done.left_out, "frame") +
                "; the first: " + done.why);
  const Json document = {
      {"out", c.out},
      {"frames",
       {{"taught", done.taught}, {"held_out", done.held_out}, {"left_out", done.left_out}}},
      {"before", json_of(done.before)},
      {"after", json_of(done.after)},
      {"gain", done.gain},
      {"seed", common.seed}};
  print(common.json, document,
        table_of(done) + format("gain %.1f %%\n", 100 * done.gain) + "wrote " + c.out + "\n");
  return 0;
}

}  // namespace

void add_adapt(Program& program) {
  auto [app, c] = program.add(
      "adapt", "an extractor learns from captures of one sensor, without a truth",
      "restage adapt --source take1/ --source take2/ --out studio.safetensors\n"
      "restage adapt --source takes.h5 --sequence 2 --weights runs/finetune-1 --out "
      "studio.safetensors --json\n"
      "restage adapt --source mm/ --scale mm --source-up z --fps 60 --out studio.safetensors\n"
      "restage adapt --source hero.glb --clip Walk --samples 8 --min-confidence 0.9 --held-out 0.5 "
      "--out "
      "hero.safetensors\n"
      "restage adapt --source toy/ --force --out toy.safetensors\n"
      "restage adapt --source take1/ --steps 1000 --batch 8 --rate 1e-5 --out studio.safetensors",
      run_adapt);
  app.add_option(
         "--source,SOURCE", c.sources,
         "clouds of one person: a folder, HDF5 file, glTF or arrays; again for more sequences")
      .required();
  app.add_option("--weights", c.weights,
                 "weights file, run or artifact (default: the standard ones)");
  app.add_option("--out", c.out,
                 "weights file with the adapted extractor; all else as in --weights")
      .required();
  add_source_options(app, c.how);
  app.add_option("--samples", c.options.samples,
                 "views of a cloud that the teacher averages: choices of its points, turned and "
                 "mirrored")
      .formerly("--views");
  app.add_option("--min-confidence", c.options.min_confidence,
                 "a frame of which the extractor is less sure teaches nothing, 0 to 1");
  app.add_option("--steps", c.options.steps, "of the optimiser");
  app.add_option("--batch", c.options.batch, "clouds in a step");
  app.add_option("--rate", c.options.rate, "of the optimiser, at the beginning");
  app.add_option("--held-out", c.options.held_out,
                 "the last part of each sequence, which only judges");
  add_force(app, c.force);
}

}  // namespace restage::cli
