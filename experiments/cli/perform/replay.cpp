// restage replay: the step of a training whose loss was not finite, once more.
#include "autograd/base/log.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "nn/config/config.h"
#include "train/failure.h"
#include "train/training/training.h"

namespace restage::cli {
namespace {

bool same(const NamedTensors& a, const NamedTensors& b) {
  TensorFile x, y;
  for (const auto& [name, tensor] : a) x.tensors[name] = tensor;
  for (const auto& [name, tensor] : b) y.tensors[name] = tensor;
  return safetensors_bytes(x) == safetensors_bytes(y);
}

int run_replay(const std::string& path, const Common& common) {
  const Failure failure = read_failure(path);
  TrainConfig config;
  read_config(of_this_version(parse_yaml(failure.config_yaml, path)), config);
  const TrainingData data(config.data);
  Bundle given = failure.given;
  const auto stage = make_stage(config, failure.stage, data, &given);
  if (stage == nullptr)
    throw InputError(path, "is of a stage that is not trained", "give a file of RUN/nonfinite");
  if (!failure.state.tensors.empty()) stage->load(failure.state, path);
  const bool examples = same(stage->examples(failure.step), failure.examples);
  if (!examples)
    log_warning(config.data.source +
                " gives other examples than those that failed; they are kept "
                "in " +
                path + " as examples.*");
  std::string said;
  try {
    const MatmulPrecisionScope scope(config.precision);
    for (int64_t step = failure.from; step <= failure.step; ++step) stage->step(step);
  } catch (const NonFiniteError& error) {
    said = error.what();
  }
  const std::string place = failure.stage + ", step " + std::to_string(failure.step) + ": ";
  const std::string then = said.empty()           ? "is finite now; it was: " + failure.said
                           : said == failure.said ? said
                                                  : said + "; it was: " + failure.said;
  print(common.json,
        {{"stage", failure.stage},
         {"step", failure.step},
         {"finite", said.empty()},
         {"same", said == failure.said},
         {"same_examples", examples},
         {"error", said.empty() ? Json(nullptr) : Json(said)}},
        place + then + "\n");
  return 0;
}

}  // namespace

void add_replay(Program& program) {
  auto [app, path] = program.add(
      "replay", "repeat the step of a training whose loss was not finite",
      "restage replay runs/lite-20260101T120000-1/nonfinite/motion-812.safetensors", run_replay);
  app.add_option("FILE", path, "what the training left in RUN/nonfinite").required();
}

}  // namespace restage::cli
