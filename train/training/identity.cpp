#include "train/training/identity.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/file_sums.h"
#include "datasets/readers/sha256.h"
#include "nn/weights/bundle.h"
#include "nn/weights/safetensors.h"
#include "train/stages/registry.h"

namespace restage {
namespace {

using Json = nlohmann::json;  // keys in order of their names

std::string number(double value) { return config_detail::write_leaf(value).text; }

template <class C>
Json keys_of(const C& config) {
  return Json::parse(keys_text(write_identity(config)));
}

/// The checksum of the source of a stage's network, where it is written in Python.
std::string code_of(const Json& keys) {
  const auto model = keys.find("model");
  if (model == keys.end() || !model->is_string()) return "";
  return model_type(model->get<std::string>()).code;
}

}  // namespace

std::string Identities::data(const CorpusSource& source) {
  if (source.source == "builtin") return keys_of(source).dump();
  if (!source.subject.empty()) {
    CorpusSource all = source;
    all.subject.clear();
    return Json{{"of", data(all)}, {"subject", source.subject}}.dump();
  }
  std::string& known = seen_["data " + source.source];
  if (!known.empty()) return known;
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (!fs::is_directory(source.source, ignored)) return known = content_of_file(source.source);
  Json files = Json::object();
  for (const char* split : {"train", "validation", "test"}) {
    const fs::path file = fs::path(source.source) / (std::string(split) + ".h5");
    if (is_there(file.string())) files[split] = content_of_file(file.string());
  }
  return known = files.dump();
}

std::string Identities::weights(const std::string& path) {
  std::string& known = seen_["weights " + path];
  if (known.empty()) known = kept_sha256(weights_path(path));
  return known;
}

std::string Identities::networks(const std::string& stage, const std::string& path) {
  std::string& known = seen_[stage + " of " + path];
  if (known.empty())
    known =
        sha256(identity_bytes(networks_of(stage_type(stage), path).only(stage_type(stage).roles)));
  return known;
}

std::vector<StageId> Identities::stages(const TrainConfig& config) {
  std::vector<StageId> out;
  std::map<std::string, std::string> left;  // what each stage leaves to later stages: an id
  for (const std::string& name : config.stages) {
    const StageSection& section = config.section(name);
    if (section.from) {
      left[name] = networks(name, *section.from);
      continue;
    }
    Json json = {{"behaviour", kBehaviour},
                 {"stage", name},
                 {"config", keys_of(section.config)},
                 {"data", data(config.data)},
                 {"seed", config.seed},
                 {"precision", static_cast<int>(config.precision)},
                 {"reads", Json::object()}};
    if (const std::string code = code_of(json["config"]); !code.empty()) json["network"] = code;
    const SelectionConfig& selection = config.loop.selection;
    // Another device rounds in other ways.
    if (config.device != "cpu") json["device"] = config.device;
    if (config.loop.overfit_batches > 0) json["overfit_batches"] = config.loop.overfit_batches;
    if (config.loop.micro_batches > 1) json["micro_batches"] = config.loop.micro_batches;
    if (selection.ema > 0) json["ema"] = number(selection.ema);
    if (selection.swa_from > 0) json["swa_from"] = number(selection.swa_from);
    if (selection.judges())
      json["selection"] = {{"export", static_cast<int>(selection.choice)},
                           {"patience", selection.patience},
                           {"min_delta", number(selection.min_delta)},
                           {"monitor", monitored(selection, name)},
                           {"validate_every", config.loop.validate_every}};
    // Before, min_delta also decided which validation was the best.
    if (selection.choice == SelectionConfig::Export::best && selection.min_delta > 0)
      json["selection"]["best"] = "lowest";
    if (section.init) {
      json["init"] = weights(*section.init);
      json["init_names"] = section.init_names;
    }
    for (const std::string& read : stage_type(name).reads(section.config))
      json["reads"][read] = left[read];
    left[name] = short_id(json.dump());
    out.push_back({name, left[name], json.dump()});
  }
  return out;
}

std::vector<NetworkSource> network_sources(const TrainConfig& config) {
  std::vector<NetworkSource> out;
  for (const std::string& stage : config.trained()) {
    const Json keys = keys_of(config.section(stage).config);
    if (const std::string code = code_of(keys); !code.empty())
      out.push_back({stage, keys["model"].get<std::string>(), code});
  }
  return out;
}

std::string Identities::trial(const TrainConfig& config,
                              const std::map<std::string, std::string>& more) {
  Json json = {{"behaviour", kBehaviour}, {"data", data(config.data)},
               {"seed", config.seed},     {"evaluation", keys_of(config.evaluation)},
               {"stages", config.stages}, {"more", more}};
  for (const StageId& stage : stages(config)) json["artifacts"][stage.stage] = stage.id;
  for (const std::string& name : config.stages)
    if (const auto& from = config.section(name).from) json["from"][name] = networks(name, *from);
  return short_id(json.dump());
}

}  // namespace restage
