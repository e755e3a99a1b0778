// restage train: all stages of a configuration, or the rest of an interrupted run.
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/base/parallel.h"
#include "autograd/base/temporary.h"
#include "autograd/kernels/matmul_precision.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/training/find_rate.h"
#include "experiments/cli/training/resumed.h"
#include "experiments/cli/training/train.h"
#include "experiments/cli/training/watched.h"
#include "experiments/scratch.h"
#include "experiments/shipped_config.h"
#include "infer/systems.h"
#include "nn/config/config.h"
#include "train/run_provenance.h"
#include "train/stages/motion_stage.h"
#include "train/training/identity.h"
#include "train/training/training.h"

namespace restage::cli {
namespace {

Json value_of(const ConfigNode& node) {
  if (node.kind == ConfigNode::Kind::null) return nullptr;
  if (node.kind == ConfigNode::Kind::scalar) {
    const Json value = node.quoted ? Json(node.text) : Json::parse(node.text, nullptr, false);
    return value.is_discarded() ? Json(node.text) : value;
  }
  Json out = Json::array();
  for (const ConfigNode& child : node.children) out.push_back(value_of(child));
  return out;
}

/// All keys by their full names: {"motion.optimiser.steps": 100, ...}.
void add_keys(const ConfigNode& section, const std::string& prefix, Json* keys) {
  for (const ConfigNode& child : section.children) {
    if (child.kind == ConfigNode::Kind::map)
      add_keys(child, prefix + child.key + ".", keys);
    else
      (*keys)[prefix + child.key] = value_of(child);
  }
}

namespace fs = std::filesystem;

/// CONFIG.yaml and key=value, in any order; resume=RUN stands alone.
struct Request {
  std::string config, resume;
  std::vector<std::string> overrides;
};

void check_resumed(const TrainArguments& a, const Common& common) {
  const std::pair<bool, const char*> others[] = {{common.seed_given, "--seed"},
                                                 {a.overfit_batches > 0, "--overfit-batches"},
                                                 {a.fast_dev_run, "--fast-dev-run"},
                                                 {!a.find_rate.empty(), "--find-rate"}};
  for (const auto& [given, name] : others)
    if (given)
      throw InputError("", std::string(name) + " cannot change a resumed run",
                       "leave it out, or train anew");
}

Request read_request(const TrainArguments& arguments, const Common& common) {
  Request out;
  for (const std::string& a : arguments.words) {
    if (a.starts_with("resume=")) {
      out.resume = a.substr(7);
    } else if (a.find('=') != std::string::npos) {
      out.overrides.push_back(a);
    } else if (out.config.empty()) {
      if (fs::is_directory(a) && fs::exists(fs::path(a) / "config.yaml"))
        throw InputError(a, "is the folder of a training",
                         "say resume=" + a + " to go on with it, or give its config.yaml");
      out.config = config_file(a);
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
  if (!out.resume.empty()) check_resumed(arguments, common);
  if (arguments.overfit_batches < 0)
    throw InputError("", "--overfit-batches is out of range", "give 1 or more");
  if (!arguments.find_rate.empty() && !arguments.find_rate.ends_with(".svg"))
    throw InputError(arguments.find_rate, "is no picture that can be written",
                     "give --find-rate a name that ends in .svg");
  if (!arguments.find_rate.empty() && (arguments.dry_run || arguments.fast_dev_run))
    throw InputError("", "--find-rate takes other steps than --dry-run and --fast-dev-run",
                     "give one of them at a time");
  if (!arguments.profile.empty() &&
      (arguments.dry_run || arguments.print_config || !arguments.find_rate.empty()))
    throw InputError("", "--profile times a training, and nothing is trained here",
                     "leave it out, or try --fast-dev-run, which trains three steps");
  if (common.seed_given) out.overrides.push_back("seed=" + std::to_string(common.seed));
  if (arguments.overfit_batches > 0)
    out.overrides.push_back("loop.overfit_batches=" + std::to_string(arguments.overfit_batches));
  return out;
}

TrainConfig configured(const Request& request) {
  TrainConfig config;
  if (request.resume.empty()) {
    if (load_config_tree(request.config).find("protocol") != nullptr)
      throw InputError(request.config, "is the recipe of a data set, not a training",
                       "make the data with 'restage data build', and give data.source=FOLDER");
    load_config(request.config, request.overrides, config);
  } else {
    config = resumed_config(request.resume, request.overrides);
  }
  if (config.data.one_mesh && config.data.source != "builtin")
    log_warning("data.one_mesh is for built-in data; those of " + config.data.source +
                " are taken as they are");
  system_type(config.evaluation.system, "evaluation.system");
  if (config.stages.empty())
    throw InputError(request.config, "names no stages, so there is nothing to train",
                     "use it in a sweep, or name stages");
  return config;
}

/// Of every stage that would be trained three steps and a validation.
TrainConfig shortened(Request request, const TrainConfig& whole) {
  constexpr int64_t kSteps = 3, kAsked = 4;
  for (const std::string& stage : whole.trained()) {
    request.overrides.push_back(format("%s.optimiser.steps=%d", stage.c_str(), int{kSteps}));
    if (stage != "motion") continue;
    const auto& motion = whole.section(stage).config.as<MotionStageConfig>();
    if (motion.answers.tracks.sequences > kAsked)
      request.overrides.push_back(format("motion.answers.sequences=%d", int{kAsked}));
  }
  return configured(request);
}

/// For the first lines of a run; nothing for float32.
std::string products_in(const TrainConfig& config) {
  if (config.precision == MatmulPrecision::float32) return "";
  return "; products in tf32 on " + config.device;
}

RunInput provenance_of(const TrainConfig& config, const TrainingData& data, const Common& common) {
  RunInput out{config.seed, threads(), common.command_line, {}, resolved_yaml(config)};
  for (const NetworkSource& network : network_sources(config))
    out.networks.push_back({network.stage, network.model, network.source});
  if (config.data.source != "builtin")
    out.data.push_back({config.data.source, checksum(data.train) + checksum(data.validation)});
  return out;
}

/// Trains in a run directory and leaves its weights there.
void train_in(RunDir& run, const TrainConfig& config, const TrainingData& data,
              const TrainArguments& arguments, const Common& common, Profiled* profile) {
  log_info("seed " + std::to_string(config.seed) + ", " + std::to_string(threads()) + " threads; " +
           std::to_string(data.train.bodies.size()) + " bodies and " +
           std::to_string(data.train.motions.size()) + " motions to train on" +
           products_in(config));
  Watched watched(run.dir(), config, arguments, data.team->rank() == 0, profile);
  TrainOptions options;
  options.team = data.team;
  options.quiet = common.quiet || data.team->rank() > 0;
  options.observers = watched.observers();
  watched.run([&] {
    save_bundle(run.dir() + "/weights.safetensors", train_run(run, config, data, options));
  });
}

int dry_run(const TrainConfig& config, const TrainingData& data, const Common& common) {
  const std::vector<StageForecast> stages = forecast(config, data);
  std::vector<std::vector<std::string>> rows{
      {"stage", "parameters", "steps", "ms a step", "before", "time", "memory"}};
  Json list = Json::array();
  double seconds = 0;
  for (const StageForecast& f : stages) {
    const double whole = f.seconds(config.loop.validate_every);
    const double mebibytes = static_cast<double>(f.memory) / 1048576.0;
    seconds += whole;
    rows.push_back({f.stage, std::to_string(f.parameters), std::to_string(f.steps),
                    format("%.1f", 1e3 * f.per_step), duration_text(f.before), duration_text(whole),
                    format("%.0f MiB", mebibytes)});
    list.push_back({{"stage", f.stage},
                    {"parameters", f.parameters},
                    {"steps", f.steps},
                    {"seconds", whole},
                    {"memory_bytes", f.memory}});
  }
  print(common.json, {{"stages", list}, {"seconds", seconds}},
        markdown_table(rows) + "\nabout " + duration_text(seconds) + " on " +
            std::to_string(threads()) + " threads; nothing was written\n");
  return 0;
}

/// Sweeps the rate of every stage; writes the picture and nothing else.
int find_rate(const TrainConfig& config, const TrainingData& data, const std::string& picture,
              const std::string& source, const Common& common) {
  const StopScope stop;
  check_output(picture, {source});
  std::optional<AtomicFile> file;  // made at once: a place that cannot be written is told before
  if (data.team->rank() == 0) file.emplace(picture);
  const std::vector<RateSweep> sweeps = find_rates(config, data);
  if (!file) return 0;
  file->write(rates_svg(sweeps));
  file->commit();
  print(common.json, rates_json(sweeps), rates_markdown(sweeps));
  log_info("wrote " + picture);
  return 0;
}

/// Everything a training does, in a folder that is removed.
int fast_dev_run(const TrainConfig& config, const TrainingData& data,
                 const TrainArguments& arguments, const Common& common, Profiled* profile) {
  const Scratch scratch;
  const RunInput input = provenance_of(config, data, common);
  {
    RunDir run = RunDir::create_at(scratch.file("run"), input.resolved_yaml, provenance_json(input),
                                   config.trained());
    train_in(run, config, data, arguments, common, profile);
    load_bundle(run.dir());
  }
  print(common.json, {{"fast_dev_run", true}, {"stages", config.stages}},
        "every stage ran some steps, was validated and saved; nothing was kept\n");
  return 0;
}

/// The run, at its newest checkpoint if it is resumed. The first process of a team keeps it; the
/// others begin with its checkpoints, in `scratch`.
RunDir run_of(const Request& request, const TrainConfig& config, const RunInput& input, Team& team,
              std::optional<Scratch>* scratch) {
  const std::string provenance = provenance_json(input);
  std::string bytes, place;
  if (team.rank() == 0) {
    RunDir run = request.resume.empty()
                     ? RunDir::create(config.run_root, config.name, input.resolved_yaml, provenance,
                                      config.trained())
                     : RunDir::resume(request.resume, config.trained());
    if (team.size() == 1) return run;
    for (const auto& entry : fs::directory_iterator(run.dir() + "/checkpoints")) {
      if (entry.path().extension() != ".safetensors") continue;  // put aside as damaged
      bytes += read_file(entry.path().string());
      place += entry.path().filename().string() + " " + std::to_string(bytes.size()) + "\n";
    }
    team.of_first(place);
    team.of_first(bytes);
    return run;
  }
  place = team.of_first("");
  bytes = team.of_first("");
  scratch->emplace();
  const std::string folder = (*scratch)->file("run");
  RunDir::create_at(folder, input.resolved_yaml, provenance, config.trained());
  std::istringstream lines(place);
  std::string name;
  for (size_t end = 0, at = 0; lines >> name >> end; at = end)
    write_file_atomically(folder + "/checkpoints/" + name,
                          std::string_view(bytes).substr(at, end - at));
  return RunDir::resume(folder, config.trained());
}

TrainingData data_of(const TrainConfig& config, const Request& request) {
  try {
    return TrainingData(config.data);
  } catch (const InputError& error) {
    std::error_code ignored;
    if (request.resume.empty() || fs::exists(config.data.source, ignored)) throw;
    throw InputError(error.where(), error.cause(),
                     "if the data have moved, say where they are with data.source=PATH");
  }
}

int train_with(Team& team, const TrainArguments& arguments, const Common& common) {
  const Request request = read_request(arguments, common);
  TrainConfig config = configured(request);
  if (arguments.fast_dev_run) config = shortened(request, config);
  if (arguments.print_config) {
    Json keys = Json::object();
    add_keys(write_config(config), "", &keys);
    print(common.json, {{"config", resolved_yaml(config)}, {"keys", keys}}, resolved_yaml(config));
    return 0;
  }
  TrainingData data = data_of(config, request);
  data.team = &team;
  const RunInput input = provenance_of(config, data, common);
  if (!request.resume.empty() && team.rank() == 0)
    check_same_run(request.resume, input, request.overrides,
                   resolved_as_begun(request.resume, request.overrides));
  check_stages(config, data);
  for (const std::string& remark : remarks(config.data, data.train)) log_warning(remark);
  if (arguments.dry_run) return dry_run(config, data, common);
  if (!arguments.find_rate.empty())
    return find_rate(config, data, arguments.find_rate, request.config, common);
  std::optional<Profiled> profiled;
  if (!arguments.profile.empty() && team.rank() == 0) {
    check_output(arguments.profile, {request.config});
    profiled.emplace(arguments.profile);
  }
  Profiled* profile = profiled ? &*profiled : nullptr;
  if (arguments.fast_dev_run) return fast_dev_run(config, data, arguments, common, profile);

  std::optional<Scratch> scratch;
  RunDir run = run_of(request, config, input, team, &scratch);
  if (!request.resume.empty() && team.rank() == 0)
    write_resumed(request.resume, input, request.overrides);
  if (team.rank() == 0)
    print(common.json, {{"run", run.dir()}, {"seed", config.seed}}, run.dir() + "\n");
  finish_output();
  train_in(run, config, data, arguments, common, profile);
  if (team.rank() == 0) log_info("weights: " + run.dir() + "/weights.safetensors");
  return 0;
}

}  // namespace

int run_train(const TrainArguments& arguments, const Common& common) {
  Team& team = team_of_processes();
  set_local_rank(team.local_rank());
  if (team.size() == 1) return train_with(team, arguments, common);
  if (team.rank() > 0) set_log_level(LogLevel::warning);
  // One that fails by itself would leave the others waiting for it.
  try {
    return train_with(team, arguments, common);
  } catch (const Interrupted& error) {  // all of them, after the same step
    team.any(true);  // mpirun kills the others as soon as one has ended: all checkpoints are there
    if (team.rank() == 0) throw;
    return error.exit_code;
  } catch (const Error& error) {
    print_error(team.name() + ": " + error.what());
    team.abort(error.exit_code);
  } catch (const std::exception& error) {
    print_error(team.name() + ": " + error.what());
    team.abort(1);
  }
  return 1;
}

void add_train(Program& program) {
  auto [app, a] = program.add(
      "train", "train the stages of a configuration",
      "restage train configs/demo.yaml\n"
      "restage train configs/lite/all.yaml data.source=data.h5 motion.optimiser.steps=2000\n"
      "restage train configs/lite/all.yaml skeleton.from=experiments/weights/lite.safetensors "
      "motion.init=experiments/weights/lite.safetensors\n"
      "restage train configs/lite/all.yaml data.source=data.h5 --dry-run\n"
      "restage train configs/lite/all.yaml loop.export=best loop.patience=5 --tensorboard --csv\n"
      "restage train configs/lite/all.yaml stages=[skeleton] --overfit-batches 1\n"
      "restage train configs/lite/all.yaml data.source=data.h5 --print-config\n"
      "restage train configs/lite/all.yaml data.source=data.h5 --fast-dev-run\n"
      "restage train configs/lite/all.yaml stages=[skeleton] --find-rate rate.svg\n"
      "restage train configs/demo.yaml --fast-dev-run --profile trace.json\n"
      "restage train resume=runs/demo-20260101-120000-1\n"
      "restage train resume=runs/demo-20260101-120000-1 data.source=moved/data.h5 "
      "motion.optimiser.steps=8000",
      run_train);
  add_train_options(app, a);
}

void add_train_options(CommandOptions app, TrainArguments& a) {
  app.add_option("ARGUMENTS", a.words, "CONFIG.yaml and key=value overrides, or resume=RUN_DIR")
      .suggest(shipped_configs())
      .required();
  app.add_flag("--print-config", a.print_config, "print the resolved configuration and end");
  app.add_flag("--dry-run", a.dry_run,
               "check all, forecast time and memory from some steps of each stage, write nothing");
  app.add_flag("--fast-dev-run", a.fast_dev_run,
               "three steps, a validation and a checkpoint of each stage; keep nothing");
  app.add_option("--find-rate", a.find_rate,
                 "let each stage's rate grow over 100 steps, suggest one, draw the loss as F.svg; "
                 "write nothing else")
      .one_at_a_time();
  app.add_option("--overfit-batches", a.overfit_batches,
                 "train on the same N batches again and again: can they be learned? (default: no)");
  app.add_option("--profile", a.profile,
                 "time ops and modules; a table in the log, and F.json for Perfetto or "
                 "chrome://tracing")
      .one_at_a_time();
  app.add_flag("--tensorboard", a.tensorboard, "event files in RUN/tensorboard");
  app.add_flag("--csv", a.csv, "RUN/metrics.csv besides metrics.jsonl");
}

}  // namespace restage::cli
