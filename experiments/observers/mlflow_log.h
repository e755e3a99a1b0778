// A run in MLflow's file store (mlflow/store/tracking/file_store.py), beside the folder of the run:
// `mlflow ui --backend-store-uri RUN_ROOT/mlruns` shows all runs of a place side by side.
#pragma once

#include <string>

#include "experiments/observers/mirrored_logs.h"

namespace restage {

/// RUN/../mlruns/EXPERIMENT/ID: meta.yaml, metrics/STAGE/NAME with lines "milliseconds value step",
/// params/KEY, tags/NAME.
class MlflowLog final : public MirroredLog {
 public:
  explicit MlflowLog(RunFacts facts);
  void begin(const std::vector<LogLine>& lines) override;
  void add(const LogLine& line) override;
  void end(RunEnd how, double time) override;

 private:
  void write_meta(int status, double ended);
  std::string place_of(const LogLine& line, const std::string& name) const {
    return folder_ + "/metrics/" + line.stage + "/" + name;
  }

  RunFacts facts_;
  std::string store_, experiment_, id_, folder_;
};

}  // namespace restage
