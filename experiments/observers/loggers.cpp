#include "experiments/observers/loggers.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "experiments/observers/mlflow_log.h"
#include "experiments/observers/wandb_log.h"
#include "infer/render/sheet.h"

namespace restage {
namespace {

/// As a contact sheet takes it.
std::vector<Clip> clips_of(std::vector<Shown> all) {
  std::vector<Clip> out;
  for (Shown& shown : all) {
    out.push_back({std::move(shown.label), std::move(shown.clouds), {}});
    for (const Joints& joints : shown.skeletons) out.back().frames.push_back(stick_figure(joints));
  }
  return out;
}

}  // namespace

void TensorBoardLog::on_begin(const Stage& stage, int64_t done) {
  const std::string folder = folder_ + "/" + stage.name();
  make_folder(folder);
  file_.emplace(folder, done);
}

void TensorBoardLog::on_log(const Stage& stage, int64_t done, const NamedValues& values) {
  for (const auto& [name, value] : values) file_->scalar(done, stage.name() + "/" + name, value);
  file_->flush();
}

void TensorBoardLog::on_validation(Stage& stage, int64_t done, const NamedValues& figures) {
  on_log(stage, done, figures);
  for (const StateEntry& entry : stage.weights())
    if (const Tensor t = entry.value->cpu(); t.dtype() == DType::f32)
      file_->histogram(done, entry.name, {t.data<float>(), static_cast<size_t>(t.numel())});
  if (const std::vector<Clip> clips = clips_of(stage.show()); !clips.empty()) {
    const Image sheet = contact_sheet(clips, {.fps = 0});
    file_->picture(done, stage.name() + "/held out", sheet.width, sheet.height, png_bytes(sheet));
  }
  file_->flush();
}

void CsvLog::on_checkpoint(const Stage&, int64_t, const std::string&) {
  std::istringstream lines(read_file(run_ + "/metrics.jsonl"));
  std::string out = "stage,step,name,value\n";
  for (std::string text; std::getline(lines, text);) {
    const auto line = nlohmann::ordered_json::parse(text);
    const std::string place = line["stage"].get<std::string>() + "," + line["step"].dump() + ",";
    for (const auto& [name, value] : line.items())
      if (name != "stage" && name != "step")
        out += place + name + "," + (value.is_null() ? "" : value.dump()) + "\n";
  }
  write_file_atomically(run_ + "/metrics.csv", out);
}

RunLogs::RunLogs(const std::string& run, const std::string& name, const std::string& yaml,
                 const std::vector<std::string>& logs) {
  const auto named = [&](const char* log) {
    return std::find(logs.begin(), logs.end(), log) != logs.end();
  };
  if (named("tensorboard")) all_.push_back(std::make_unique<TensorBoardLog>(run));
  if (named("csv")) all_.push_back(std::make_unique<CsvLog>(run));
  if (!named("wandb") && !named("mlflow")) return;
  const RunFacts facts = run_facts(run, name, yaml);
  std::vector<std::unique_ptr<MirroredLog>> mirrored;
  if (named("wandb")) mirrored.push_back(std::make_unique<WandbLog>(facts));
  if (named("mlflow")) mirrored.push_back(std::make_unique<MlflowLog>(facts));
  auto log = std::make_unique<MirroredLogs>(facts, std::move(mirrored));
  mirrored_ = log.get();
  all_.push_back(std::move(log));
}

std::vector<TrainObserver*> RunLogs::observers() const {
  std::vector<TrainObserver*> out;
  for (const auto& one : all_) out.push_back(one.get());
  return out;
}

void RunLogs::end(RunEnd how) {
  if (mirrored_ != nullptr) mirrored_->end(how);
}

}  // namespace restage
