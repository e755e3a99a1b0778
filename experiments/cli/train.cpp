// restage train: all stages of a configuration, or the rest of an interrupted run.
#include "autograd/base/log.h"
#include "autograd/base/parallel.h"
#include "autograd/kernels/matmul_precision.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "nn/config/config.h"
#include "train/run_provenance.h"
#include "train/stages/training.h"

namespace restage::cli {
namespace {

/// CONFIG.yaml and key=value, in any order; resume=RUN stands alone.
struct Request {
  std::string config, resume;
  std::vector<std::string> overrides;
};

Request read_request(const std::vector<std::string>& arguments) {
  Request out;
  for (const std::string& a : arguments) {
    if (a.starts_with("resume=")) {
      out.resume = a.substr(7);
    } else if (a.find('=') != std::string::npos) {
      out.overrides.push_back(a);
    } else if (out.config.empty()) {
      out.config = a;
    } else {
      throw InputError("", "there are two configurations, '" + out.config + "' and '" + a + "'",
                       "give one, and include: others in it");
    }
  }
  if (out.config.empty() == out.resume.empty())
    throw InputError(
        "",
        out.config.empty() ? "no configuration was given"
                           : "a resumed run has its own configuration",
        "use 'restage train CONFIG.yaml [key=value ...]' or 'restage train resume=RUN_DIR'");
  if (!out.resume.empty() && !out.overrides.empty())
    throw InputError("", "'" + out.overrides[0] + "' cannot change a resumed run",
                     "leave it out, or train anew");
  return out;
}

/// For the first lines of a run; nothing for float32.
std::string products_in(MatmulPrecision precision) {
  if (precision == MatmulPrecision::float32) return "";
  return std::string("; products in bfloat16 ") +
         (matrix_unit() ? "by the matrix unit (AMX)" : "by float32 vectors");
}

int run_train(const std::vector<std::string>& arguments, const Common& common) {
  const Request request = read_request(arguments);
  if (!request.resume.empty() && common.seed_given)
    throw InputError("", "--seed cannot change a resumed run", "leave it out, or train anew");
  TrainConfig config;
  std::vector<std::string> overrides = request.overrides;
  if (common.seed_given) overrides.push_back("seed=" + std::to_string(common.seed));
  load_config(request.resume.empty() ? request.config : run_config_path(request.resume), overrides,
              config);
  if (config.stages.empty())
    throw InputError(request.config, "names no stages, so there is nothing to train",
                     "use it in a sweep, or name stages");
  const TrainingData data(config.data);
  RunInput input{config.seed, threads(), common.command_line, {}, resolved_yaml(config)};
  if (config.data.source != "builtin")
    input.data.push_back({config.data.source, checksum(data.train) + checksum(data.validation)});
  if (!request.resume.empty()) check_same_run(request.resume, input);
  check_stages(config, data);

  RunDir run = request.resume.empty()
                   ? RunDir::create(config.run_root, config.name, input.resolved_yaml,
                                    provenance_json(input), config.stages)
                   : RunDir::resume(request.resume, config.stages);
  print(common.json, {{"run", run.dir()}, {"seed", config.seed}}, run.dir() + "\n");
  finish_output();
  log_info("seed " + std::to_string(config.seed) + ", " + std::to_string(threads()) + " threads; " +
           std::to_string(data.train.bodies.size()) + " bodies and " +
           std::to_string(data.train.motions.size()) + " motions to train on" +
           products_in(config.precision));
  save_bundle(run.dir() + "/weights.safetensors", train_run(run, config, data, common.quiet));
  log_info("weights: " + run.dir() + "/weights.safetensors");
  return 0;
}

}  // namespace

void add_train(Program& program) {
  auto [app, arguments] = program.add(
      "train", "train the stages of a configuration",
      "restage train configs/demo.yaml\n"
      "restage train configs/lite/all.yaml data.source=data.h5 motion.optimiser.steps=2000\n"
      "restage train configs/lite/all.yaml skeleton.from=experiments/weights/lite.safetensors "
      "motion.init=experiments/weights/lite.safetensors\n"
      "restage train resume=runs/demo-20260101-120000-1",
      run_train);
  app.add_option("ARGUMENTS", arguments, "CONFIG.yaml and key=value overrides, or resume=RUN_DIR")
      ->required();
}

}  // namespace restage::cli
