// restage data perform: scans of a body performing a motion, with the true answer for another body.
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/base/output_check.h"
#include "datasets/benchmark/sequence.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/text.h"

namespace restage::cli {
namespace {

struct PerformOptions {
  std::string bodies, motions, body, motion, target, out;
  int64_t first = 0, frames = 0;
};

template <class T>
size_t index_of(const std::vector<T>& list, const std::string& id, const std::string& file,
                const char* kind) {
  for (size_t i = 0; i < list.size(); ++i)
    if (id.empty() || list[i].id == id) return i;
  throw InputError(
      file, std::string("has no ") + kind + " '" + id + "'",
      list.empty() ? "give a file that holds some" : "name one such as '" + list[0].id + "'");
}

int run_perform(const PerformOptions& o, const Common& common) {
  const std::string& motion_file = o.motions.empty() ? o.bodies : o.motions;
  for (const std::string& file : sequence_files(o.out)) check_output(file, {o.bodies, o.motions});
  Corpus corpus{read_bodies(o.bodies), read_motions(motion_file), "made by restage data perform",
                ""};
  corpus.license = inspect(o.bodies).license;
  EvalSequence s;
  s.body_a = index_of(corpus.bodies, o.body, o.bodies, "body");
  s.body_b = index_of(corpus.bodies, o.target.empty() ? o.body : o.target, o.bodies, "body");
  s.motion = index_of(corpus.motions, o.motion, motion_file, "motion");
  const auto count = static_cast<int64_t>(corpus.motions[s.motion].frames());
  if (o.first < 0 || o.first >= count || o.frames < 0 || o.frames > count - o.first)
    throw InputError(
        motion_file,
        "'" + corpus.motions[s.motion].id + "' has " + std::to_string(count) + " frames",
        "choose --first and --frames inside them");
  s.first = static_cast<size_t>(o.first);
  s.frames = static_cast<size_t>(o.frames > 0 ? o.frames : count - o.first);
  std::error_code failed;
  std::filesystem::create_directories(o.out, failed);
  if (failed) throw InputError(o.out, "cannot be made a folder", "give a place you can write to");
  write_sequence(Performance(corpus, s, ScanConfig{}, common.seed),
                 {corpus.license, corpus.description}, o.out);
  print(common.json, {{"out", o.out}, {"frames", s.frames}, {"seed", common.seed}},
        "wrote " + o.out + "/{source.h5,target.ply,rest.h5,truth.h5}: " +
            counted(s.frames, "frame") + " (seed " + std::to_string(common.seed) + ")\n");
  return 0;
}

}  // namespace

void add_data_perform(Program& program, CommandOptions group) {
  auto [app, o] = program.add(
      group, "perform", "scans of a body performing a motion, and the truth for a target",
      "restage data perform --bodies data.h5 --body b140 --motion 02_01 --answer b150 --out walk/\n"
      "restage data perform --bodies data.h5 --motions walk.h5 --body b140 --out walk/\n"
      "restage data perform --bodies data.h5 --first 30 --frames 60 --out two_seconds/",
      run_perform);
  app.add_option("--bodies", o.bodies, "data file with bodies").required();
  app.add_option("--motions", o.motions, "data file with motions (default: the same)");
  app.add_option("--body", o.body, "who is scanned (default: the first)");
  app.add_option("--motion", o.motion, "which motion (default: the first)");
  app.add_option("--answer", o.target, "whose answer is written (default: the same body)")
      .formerly("--target");
  app.add_option("--first", o.first, "first frame");
  app.add_option("--frames", o.frames, "how many (default: to the end)");
  app.add_option("--out", o.out, "folder for source.h5, target.ply, rest.h5 and truth.h5")
      .required();
}

}  // namespace restage::cli
