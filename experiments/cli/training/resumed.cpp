#include "experiments/cli/training/resumed.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "autograd/base/log.h"
#include "autograd/base/words.h"
#include "nn/config/config.h"
#include "train/run.h"

namespace restage::cli {
namespace {

std::string key_of(const std::string& override_text) {
  return override_text.substr(0, override_text.find('='));
}

[[noreturn]] void refuse(const std::string& key, const std::string& why) {
  throw InputError(
      "", "'" + key + "' cannot change a resumed run" + why,
      "leave it out, or train anew (stages can be taken over: STAGE.from=, STAGE.init=)");
}

/// InputError where `after` is no training that goes on from `before` and ends with what a user
/// asks for.
void check_steps(const std::string& run, const std::string& key, const TrainConfig& before,
                 const TrainConfig& after) {
  const std::string stage = key.substr(0, key.find('.'));
  const std::vector<std::string> stages = before.trained();
  const auto at = std::find(stages.begin(), stages.end(), stage);
  if (at == stages.end()) refuse(key, ", which trains no such stage");
  const auto last = latest_checkpoint(run, stages);
  if (last && std::find(stages.begin(), stages.end(), last->stage) > at)
    refuse(key, ": the stage is over, and later ones have learned on what it left");
  const auto value = [&](const TrainConfig& config, const char* name) {
    const ConfigNode tree = write_config(config);
    const ConfigNode* node = find_config(tree, stage + ".optimiser." + name);
    return node == nullptr ? std::string() : node->text;
  };
  const int64_t was = std::stoll(value(before, "steps")), now = std::stoll(value(after, "steps"));
  if (last && last->stage == stage && now < last->step)
    refuse(key, cat(": the stage has done ", last->step, " steps"));
  const std::string kind = value(before, "schedule.kind");
  if (now != was && kind != "constant")
    log_warning(cat("the learning rate follows ", now, " steps from here on, and followed ", was,
                    " before: the result is another than that of ", now, " steps in one go"));
}

/// What names files of networks: they may lie elsewhere by now.
std::vector<std::string> files_of(const std::vector<std::string>& overrides) {
  std::vector<std::string> out;
  for (const std::string& text : overrides)
    if (key_of(text) == "python") out.push_back(text);
  return out;
}

}  // namespace

TrainConfig resumed_config(const std::string& run, const std::vector<std::string>& overrides) {
  const ConfigNode tree =
      of_this_version(load_config_tree(run_config_path(run), files_of(overrides)));
  TrainConfig before;
  read_config(tree, before);
  TrainConfig after;
  read_config(of_this_version(load_config_tree(run_config_path(run), overrides)), after);
  for (const std::string& text : overrides) {
    const std::string key = key_of(text);
    if (key.ends_with(".optimiser.steps")) {
      check_steps(run, key, before, after);
    } else if (key == "loop.validate_every" && before.loop.selection.judges()) {
      refuse(key, ", whose validations choose the weights");
    } else if (key != "data.source" && key != "python" && key != "loop.log_every" &&
               key != "loop.checkpoint_every" && key != "loop.validate_every" &&
               key != "loop.logs" && key != "loop.keep" && key != "loop.keep_every") {
      refuse(key, "");
    }
  }
  return after;
}

std::string resolved_as_begun(const std::string& run, const std::vector<std::string>& overrides) {
  TrainConfig config;
  const ConfigNode tree = load_config_tree(run_config_path(run), files_of(overrides));
  read_config(known_then(run, of_this_version(tree)), config);
  return resolved_yaml(config);
}

void write_resumed(const std::string& run, const RunInput& input,
                   const std::vector<std::string>& overrides) {
  if (overrides.empty()) return;
  using Ordered = nlohmann::ordered_json;
  const std::string path = run + "/provenance.json";
  Ordered then = Ordered::parse(read_file(path, 1 << 22));
  const Ordered now = Ordered::parse(provenance_json(input));
  then["configuration"] = now["configuration"];
  then["data"] = now["data"];
  then["resumed"].push_back(
      Ordered{{"started", now["started"]}, {"command_line", now["command_line"]}});
  write_file_atomically(path, then.dump(2, ' ', false, Ordered::error_handler_t::replace) + "\n");
  write_file_atomically(run + "/config.yaml", input.resolved_yaml);
}

}  // namespace restage::cli
