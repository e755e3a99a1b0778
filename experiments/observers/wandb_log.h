// A run of Weights & Biases that was not online: `wandb sync RUN/wandb/offline-run-*` takes it to a
// server. The file is a log of protobuf messages in LevelDB's format, with zlib's CRC in the place
// of LevelDB's (wandb/sdk/internal/datastore.py, wandb/proto/wandb_internal.proto).
#pragma once

#include <cstdio>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "experiments/observers/message.h"
#include "experiments/observers/mirrored_logs.h"

namespace restage {

/// Records in blocks of 32 KiB, each with its checksum; one that does not fit is cut into parts.
class RecordLog {
 public:
  /// WorkError: it cannot be made or written.
  explicit RecordLog(std::string path);
  void add(const std::string& record);
  void flush();

 private:
  void part(char kind, std::string_view bytes);
  void write(std::string_view bytes);

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  size_t at_ = 0;  // in the block
};

/// RUN/wandb/offline-run-DATE_TIME-ID/run-ID.wandb. A key is STAGE/NAME; its axis is STAGE/step.
class WandbLog final : public MirroredLog {
 public:
  explicit WandbLog(RunFacts facts);
  void begin(const std::vector<LogLine>& lines) override;
  void add(const LogLine& line) override;
  void end(RunEnd how, double time) override;

 private:
  void record(int field, const Message& message);
  void define(const std::string& key, const std::string& axis);
  void put(const LogLine& line);

  RunFacts facts_;
  std::string folder_, id_;
  std::unique_ptr<RecordLog> file_;
  std::set<std::string> known_;  // keys that were defined
  uint64_t records_ = 0, rows_ = 0;
};

}  // namespace restage
