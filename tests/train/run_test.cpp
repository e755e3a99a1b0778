#include "train/run.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "autograd/base/log.h"
#include "autograd/base/rng.h"
#include "tests/support/files.h"
#include "tests/support/unreadable.h"
#include "train/run_provenance.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
const std::vector<std::string> kStages = {"skeleton", "smrm", "deformation"};

class TrainRun : public test::FileTest {
 protected:
  TrainRun() { set_log_level(LogLevel::quiet); }
  ~TrainRun() override { set_log_level(LogLevel::info); }
  RunDir make(const std::string& name = "a") {
    return RunDir::create_at(root + "/" + name, "steps: 1\n", "{}\n", kStages);
  }
  /// Names without the checksum at their end.
  std::vector<std::string> checkpoints(const std::string& run) {
    std::vector<std::string> names = test::names_in(run + "/checkpoints");
    for (std::string& name : names) name.resize(name.rfind('-'));
    return names;
  }
  /// What is said against an action, without the folder; "" if nothing is.
  template <class F>
  std::string error(F&& f) {
    std::string what = test::refusal_of(f);
    for (size_t at; (at = what.find(root + "/")) != std::string::npos;)
      what.erase(at, root.size() + 1);
    return what;
  }
  const std::string root = dir.path();
};

/// A child that does `work`, which tells each act through the pipe; killed after `acts` acts and a
/// little while. True if it had finished by itself.
bool killed_child(uint64_t acts, unsigned delay_us, const std::function<void(int pipe)>& work) {
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("pipe");
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(ends[0]);
    try {
      work(ends[1]);
    } catch (...) {
      ::_exit(4);
    }
    ::_exit(0);
  }
  ::close(ends[1]);
  char act;
  for (uint64_t i = 0; i < acts && ::read(ends[0], &act, 1) == 1; ++i) {
  }
  ::usleep(delay_us);
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  ::close(ends[0]);
  EXPECT_TRUE(WIFSIGNALED(status) || (WIFEXITED(status) && WEXITSTATUS(status) == 0)) << status;
  return WIFEXITED(status);
}

TEST_F(TrainRun, CreateMakesWhatTheContractLists) {
  const RunDir a = RunDir::create(root, "demo", "steps: 1\n", "{\"x\": 1}\n", kStages);
  const RunDir b = RunDir::create(root, "demo", "steps: 2\n", "{}\n", kStages);
  EXPECT_NE(a.dir(), b.dir());
  EXPECT_EQ(a.dir().rfind(root + "/demo-2", 0), 0u);
  for (const char* name :
       {"config.yaml", "provenance.json", "metrics.jsonl", "log.txt", "checkpoints"})
    EXPECT_TRUE(fs::exists(a.dir() + "/" + name)) << name;
  EXPECT_EQ(read_file(run_config_path(a.dir())), "steps: 1\n");
  EXPECT_EQ(read_file(a.dir() + "/provenance.json"), "{\"x\": 1}\n");
  EXPECT_EQ(test::names_in(root).size(), 2u) << "a draft was left behind";
  // roots are made when they are missing
  EXPECT_TRUE(fs::exists(RunDir::create(root + "/deep/er", "x", "", "", kStages).dir()));
}

TEST_F(TrainRun, ExplicitDirectory) {
  fs::create_directory(root + "/empty");
  EXPECT_EQ(make("empty").dir(), root + "/empty");
  EXPECT_EQ(RunDir::create_at(root + "/slash/", "", "", kStages).dir(), root + "/slash/");
  EXPECT_TRUE(fs::exists(root + "/slash/config.yaml"));
  EXPECT_EQ(
      error([&] { make("empty"); }),
      "empty: exists already and is no empty folder; choose another folder, or give resume=empty");
  std::ofstream(root + "/file") << "x";
  EXPECT_NE(error([&] { make("file"); }), "");
  EXPECT_NE(error([&] { make("file/below"); }), "");
  EXPECT_EQ(read_file(root + "/file"), "x");
}

TEST_F(TrainRun, LogGoesIntoTheRun) {
  {
    const RunDir run = make();
    log_info("hello run");
  }
  log_info("not any more");
  const std::string log = read_file(root + "/a/log.txt");
  EXPECT_HAS(log, "hello run\n");
  EXPECT_EQ(log.find("not any more"), std::string::npos);
}

TEST_F(TrainRun, OnlyOneProcessTrainsInARun) {
  {
    const RunDir run = make();
    EXPECT_EQ(error([&] { RunDir::resume(root + "/a", kStages); }),
              "a: another process trains in this run; wait for it or stop it first");
    EXPECT_FALSE(latest_checkpoint(root + "/a", kStages).has_value());  // reading is allowed
  }
  EXPECT_EQ(error([&] { RunDir::resume(root + "/a", kStages); }), "");
}

TEST_F(TrainRun, NotARunDirectory) {
  EXPECT_EQ(error([&] { RunDir::resume(root + "/none", kStages); }),
            "none: is no run directory (no config.yaml and checkpoints/ in it); give a folder that "
            "'restage "
            "train' made");
  std::ofstream(root + "/config.yaml") << "x";
  EXPECT_NE(error([&] { RunDir::resume(root, kStages); }), "");
  EXPECT_NE(error([&] { latest_checkpoint(root, kStages); }), "");
}

TEST_F(TrainRun, CheckpointsKeepTheLast) {
  RunDir run = make();
  for (int64_t step = 10; step <= 40; step += 10)
    run.save_checkpoint("skeleton", step, "s" + std::to_string(step));
  EXPECT_EQ(checkpoints(run.dir()),
            (std::vector<std::string>{"skeleton-000000030", "skeleton-000000040"}));
  // a stage that is over keeps its last one, whatever the steps of the later stage are
  run.prune("skeleton", {.last = 1});
  for (int64_t step = 1; step <= 3; ++step)
    run.save_checkpoint("smrm", step, "m" + std::to_string(step));
  EXPECT_EQ(checkpoints(run.dir()),
            (std::vector<std::string>{"skeleton-000000040", "smrm-000000002", "smrm-000000003"}));
  const auto latest = latest_checkpoint(run.dir(), kStages);
  ASSERT_TRUE(latest);
  EXPECT_EQ(latest->stage, "smrm");
  EXPECT_EQ(latest->step, 3);
  EXPECT_EQ(latest->bytes, "m3");
  EXPECT_EQ(latest_checkpoint(run.dir(), {"skeleton"})->bytes, "s40");
  EXPECT_FALSE(latest_checkpoint(run.dir(), {"deformation"}));
  // saving the same again, and one step of a stage with other bytes
  run.save_checkpoint("smrm", 3, "m3");
  EXPECT_EQ(read_file(run.save_checkpoint("smrm", 3, "other", {.last = 1})), "other");
  EXPECT_EQ(latest_checkpoint(run.dir(), kStages)->bytes, "other");
  EXPECT_EQ(read_file(run.save_checkpoint("smrm", 4, "")), "");
  EXPECT_EQ(latest_checkpoint(run.dir(), kStages)->bytes, "");
}

TEST_F(TrainRun, CheckpointsOfChosenStepsStay) {
  RunDir run = make();
  for (int64_t step = 1; step <= 9; ++step)
    run.save_checkpoint("skeleton", step, "s" + std::to_string(step),
                        {.last = 1, .every = 4, .best = step < 3 ? -1 : 3});
  EXPECT_EQ(checkpoints(run.dir()),
            (std::vector<std::string>{"skeleton-000000003", "skeleton-000000004",
                                      "skeleton-000000008", "skeleton-000000009"}));
  EXPECT_EQ(checkpoint_of(run.dir(), "skeleton", 4).bytes, "s4");
  EXPECT_NE(error([&] { checkpoint_of(run.dir(), "skeleton", 5); }), "");
  run.prune("skeleton", {.last = 1, .best = 3});
  EXPECT_EQ(checkpoints(run.dir()),
            (std::vector<std::string>{"skeleton-000000003", "skeleton-000000009"}));
}

TEST_F(TrainRun, DamagedCheckpointsArePassedOver) {
  std::string newest;
  {
    RunDir run = make();
    run.save_checkpoint("skeleton", 1, std::string(1000, 'a'));
    newest = run.save_checkpoint("skeleton", 2, std::string(1000, 'b'));
    std::string bytes = read_file(newest);
    bytes[bytes.size() / 2] ^= 1;
    test::write_bytes(newest, bytes);
    for (const char* name :
         {"notes.txt", "foreign-1-0123456789abcdef.safetensors", "skeleton-9-xx.safetensors"})
      test::write_bytes(run.dir() + "/checkpoints/" + name, "mine");
    EXPECT_EQ(latest_checkpoint(run.dir(), kStages)->step, 1);
    EXPECT_HAS(read_file(run.dir() + "/log.txt"),
               newest + ": the checkpoint is damaged and passed over\n");
  }
  RunDir run = RunDir::resume(root + "/a", kStages);
  const auto state = run.take_resumed();
  ASSERT_TRUE(state);
  EXPECT_EQ(state->step, 1);
  EXPECT_EQ(state->bytes, std::string(1000, 'a'));
  EXPECT_FALSE(run.take_resumed());
  // the damaged one does not push good ones out
  run.save_checkpoint("skeleton", 2, std::string(1000, 'c'));
  EXPECT_EQ(latest_checkpoint(run.dir(), kStages)->bytes, std::string(1000, 'c'));
  EXPECT_TRUE(fs::exists(state->path));
  EXPECT_TRUE(fs::exists(run.dir() + "/checkpoints/notes.txt"));
}

TEST_F(TrainRun, ACheckpointThatCannotBeReadIsNotDamaged) {
  std::string newest;
  {
    RunDir run = make();
    run.metrics("skeleton", 2, {{"loss", 1}});
    run.save_checkpoint("skeleton", 1, "first");
    newest = run.save_checkpoint("skeleton", 2, "second");
  }
  const std::string metrics = read_file(root + "/a/metrics.jsonl");
  {
    const test::Unreadable loop(newest);
    EXPECT_THROW(RunDir::resume(root + "/a", kStages), ReadError) << "goes back to the first";
  }
  {
    const test::Unreadable loop(root + "/a/checkpoints");
    EXPECT_THROW(latest_checkpoint(root + "/a", kStages), Error) << "begins anew";
  }
  EXPECT_EQ(read_file(root + "/a/metrics.jsonl"), metrics);
  EXPECT_EQ(RunDir::resume(root + "/a", kStages).take_resumed()->bytes, "second");
}

TEST_F(TrainRun, ResumeCutsTheMetricsAtTheCheckpoint) {
  {
    RunDir run = make();
    for (int64_t step = 1; step <= 3; ++step)
      run.metrics("skeleton", step, {{"loss", 0.1 * static_cast<double>(step)}});
    run.save_checkpoint("skeleton", 3, "first");
    run.metrics("smrm", 1, {{"loss", 1e-3}, {"odd \"name\"\n", std::nan("")}});
    run.metrics("smrm", 2, {});
    run.save_checkpoint("smrm", 2, "state");
    run.metrics("smrm", 3, {{"loss", 3}});
    run.metrics("deformation", 1, {{"loss", 4}});
    const std::string text = read_file(run.dir() + "/metrics.jsonl");
    EXPECT_EQ(text.substr(0, text.find('\n')), "{\"step\":1,\"stage\":\"skeleton\",\"loss\":0.1}");
    EXPECT_HAS(text,
               "{\"step\":1,\"stage\":\"smrm\",\"loss\":0.001,\"odd \\\"name\\\"\\n\":null}\n");
  }
  std::ofstream(root + "/a/metrics.jsonl", std::ios::app)
      << "{\"step\":2,\"loss\":1}\nnoise\n[1]\n{\"step\":\"2\",\"stage\":\"smrm\"}\n{\"step\":2,"
         "\"stage\":\"sm";
  std::ofstream(root + "/a/checkpoints/smrm-000000003-0123456789abcdef.safetensors.part77")
      << "torn";
  {
    RunDir run = RunDir::resume(root + "/a", kStages);
    EXPECT_EQ(run.take_resumed()->bytes, "state");
    run.metrics("smrm", 3, {{"loss", 5}});
  }
  std::string seen;
  std::ifstream file(root + "/a/metrics.jsonl");
  for (std::string line; std::getline(file, line);) {
    const auto json = nlohmann::json::parse(line);
    seen += json.at("stage").get<std::string>() + std::to_string(json.at("step").get<int>()) + " ";
  }
  EXPECT_EQ(seen, "skeleton1 skeleton2 skeleton3 smrm1 smrm2 smrm3 ");
  EXPECT_FALSE(
      fs::exists(root + "/a/checkpoints/smrm-000000003-0123456789abcdef.safetensors.part77"));
  // without any checkpoint the training starts again, and so do the metrics
  make("b").metrics("skeleton", 1, {{"loss", 1}});
  EXPECT_FALSE(RunDir::resume(root + "/b", kStages).take_resumed());
  EXPECT_EQ(read_file(root + "/b/metrics.jsonl"), "");
}

TEST_F(TrainRun, FullDiskIsOneErrorAndLeavesNoHalves) {
  RunDir run = make();
  run.metrics("smrm", 1, {{"loss", 1}});
  run.save_checkpoint("smrm", 1, "good");
  const std::string metrics = read_file(run.dir() + "/metrics.jsonl");
  {
    const test::FileSizeLimit full(metrics.size() + 10);
    EXPECT_THROW(run.metrics("smrm", 2, {{"loss", 1}}), WorkError);
    EXPECT_THROW(run.save_checkpoint("smrm", 2, std::string(5000, 'x')), WorkError);
  }
  EXPECT_EQ(read_file(run.dir() + "/metrics.jsonl"), metrics);
  EXPECT_EQ(checkpoints(run.dir()), (std::vector<std::string>{"smrm-000000001"}));
  run.save_checkpoint("smrm", 2, "good again");
}

TEST_F(TrainRun, ProvenanceNamesWhatIsNeededToRepeat) {
  RunInput input;
  input.seed = ~0ull;
  input.threads = 2;
  input.command_line = {"restage", "train", "a\xff.yaml"};
  input.data = {{"data/x.h5", "0123456789abcdef"}};
  const auto json = nlohmann::json::parse(provenance_json(input));
  for (const char* key :
       {"version", "git_commit", "compiler", "flags", "processor", "simd", "started"})
    EXPECT_FALSE(json.at(key).get<std::string>().empty()) << key;
  EXPECT_EQ(json.at("seed").get<uint64_t>(), ~0ull);
  EXPECT_EQ(json.at("data").at(0).at("checksum"), "0123456789abcdef");
  EXPECT_EQ(json.at("command_line").at(1), "train");
}

/// The bytes that the child below saves at a step.
std::string payload(const std::string& stage, int64_t step) {
  const RngKey key = RngKey{1, 2}.fold(stage).fold(static_cast<uint64_t>(step));
  std::string bytes(20'000 + uniform_int(key, 0, 100'000), '\0');
  for (size_t i = 0; i < bytes.size(); i += 64)
    bytes[i] = static_cast<char>(uniform_int(key, i + 1, 256));
  return bytes;
}

constexpr int64_t kStepsPerStage = 60;

/// Trains: resumes, writes metrics each step, a checkpoint every third, and tells each act.
void train(const std::string& dir, int pipe) {
  const auto tell = [&](char act) {
    if (::write(pipe, &act, 1) != 1) ::_exit(3);
  };
  RunDir run = RunDir::resume(dir, kStages);
  const auto from = run.take_resumed();
  bool skip = from.has_value();
  for (const auto& stage : kStages) {
    int64_t step = 0;
    if (skip && stage != from->stage) continue;
    if (skip) step = from->step;
    skip = false;
    while (++step <= kStepsPerStage) {
      run.metrics(stage, step, {{"loss", 1.0 / static_cast<double>(step)}});
      tell('m');
      if (step % 3 != 0) continue;
      run.save_checkpoint(stage, step, payload(stage, step));
      tell('c');
    }
  }
}

bool run_child(const std::string& dir, uint64_t acts, unsigned delay_us) {
  return killed_child(acts, delay_us, [&](int pipe) { train(dir, pipe); });
}

int64_t position(const std::optional<Checkpoint>& state) {
  if (!state) return 0;
  const auto stage = std::find(kStages.begin(), kStages.end(), state->stage) - kStages.begin();
  return stage * kStepsPerStage + state->step;
}

TEST_F(TrainRun, ResumesAfterSigkillAtAnyMoment) {
  const std::string run_dir = make().dir();
  Rng rng({3, 4});
  int64_t last = 0;
  int kills = 0;
  for (int round = 0; round < 20; ++round) {
    const bool done = run_child(run_dir, rng.below(20), static_cast<unsigned>(rng.below(3000)));
    kills += done ? 0 : 1;
    RunDir run = RunDir::resume(run_dir, kStages);
    const auto state = run.take_resumed();
    ASSERT_GE(position(state), last) << "progress was lost";
    last = position(state);
    if (state) {
      ASSERT_EQ(state->bytes, payload(state->stage, state->step));
    }
    std::ifstream file(run_dir + "/metrics.jsonl");
    int64_t lines = 0;
    for (std::string line; std::getline(file, line); ++lines) {
      const auto json = nlohmann::json::parse(line);
      ASSERT_EQ(json.at("stage"), kStages[static_cast<size_t>(lines / kStepsPerStage)]);
      ASSERT_EQ(json.at("step").get<int64_t>(), lines % kStepsPerStage + 1);
    }
    ASSERT_EQ(lines, last);
  }
  EXPECT_GE(kills, 10);
  EXPECT_GE(last, 20);
  EXPECT_TRUE(run_child(run_dir, ~0ull, 0)) << "nothing is left in the way of the end";
  EXPECT_EQ(position(latest_checkpoint(run_dir, kStages)), 3 * kStepsPerStage);
  for (const auto& stage : kStages)
    EXPECT_EQ(latest_checkpoint(run_dir, {stage})->bytes, payload(stage, kStepsPerStage));
}

TEST_F(TrainRun, CreationIsWholeOrNotAtAll) {
  Rng rng({5, 6});
  for (int round = 0; round < 10; ++round) {
    const bool done =
        killed_child(rng.below(4), static_cast<unsigned>(rng.below(2000)), [&](int pipe) {
          do RunDir::create(root, "k", "steps: 1\n", "{}\n", kStages);
          while (::write(pipe, "r", 1) == 1);
        });
    EXPECT_FALSE(done);
  }
  int runs = 0;
  for (const std::string& name : test::names_in(root)) {
    if (name[0] == '.') continue;
    EXPECT_EQ(error([&] { RunDir::resume(root + "/" + name, kStages); }), "");
    EXPECT_EQ(read_file(root + "/" + name + "/provenance.json"), "{}\n");
    ++runs;
  }
  EXPECT_GT(runs, 5);
}

}  // namespace
}  // namespace restage
