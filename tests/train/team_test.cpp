// Steps cut into micro-batches, computed by one process or by several: the same bits. Here the
// processes are threads; tests/train/mpi_team.py does the same with MPI.
#include <gtest/gtest.h>

#include <barrier>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <thread>

#include "autograd/base/parallel.h"
#include "autograd/ops/reduce.h"
#include "nn/models/deformation.h"
#include "nn/models/discriminator.h"
#include "nn/models/smrm.h"
#include "tests/support/errors.h"
#include "tests/train/tiny_codes.h"
#include "train/team.h"

namespace restage {
namespace {

using testing::choose;
using testing::deformation;
using testing::motion;
using testing::optimisers;
using testing::resize;
using testing::result_bytes;
using testing::skeleton;
using testing::tiny_stage;
using testing::tiny_training;

/// What threads that play processes have in common. One works at a time: processes share no memory,
/// so what threads would do to each other is not the question.
struct Table {
  explicit Table(int n)
      : size(n), together(n), rows(static_cast<size_t>(n)), numbers(static_cast<size_t>(n)) {}
  const int size;
  std::mutex turn;
  std::barrier<> together;
  void wait() {
    turn.unlock();
    together.arrive_and_wait();
    turn.lock();
  }
  std::vector<std::vector<std::vector<float>>> rows;      // of each rank
  std::vector<std::vector<std::vector<double>>> numbers;  // of each rank
  size_t width = 0;                                       // of the last sum's rows
};

class Thread final : public Team {
 public:
  Thread(Table* table, int rank) : table_(table), rank_(rank) {}
  int rank() const override { return rank_; }
  int size() const override { return table_->size; }
  int local_rank() const override { return rank_; }
  std::unique_ptr<Sum> sum(size_t width) override {
    table_->width = width;
    return std::make_unique<Rows>(table_, rank_);
  }
  std::vector<std::vector<double>> all(const std::vector<std::vector<double>>& mine) override {
    table_->numbers[static_cast<size_t>(rank_)] = mine;
    table_->wait();
    std::vector<std::vector<double>> out;
    for (size_t round = 0; round < mine.size(); ++round)
      for (const auto& of_rank : table_->numbers) out.push_back(of_rank.at(round));
    table_->wait();
    return out;
  }
  bool any(bool mine) override { return mine; }
  std::string of_first(std::string mine) override { return mine; }
  std::string name() const override { return "thread"; }
  [[noreturn]] void abort(int) override { std::abort(); }

 private:
  class Rows final : public Sum {
   public:
    Rows(Table* table, int rank) : table_(table), mine_(table->rows[static_cast<size_t>(rank)]) {
      mine_.clear();
    }
    void give(std::vector<float> row) override { mine_.push_back(std::move(row)); }
    std::vector<float> total() override {
      table_->wait();
      std::vector<float> out;
      for (size_t round = 0; round < mine_.size(); ++round)
        for (const auto& of_rank : table_->rows) {
          const auto& row = of_rank.at(round);
          if (out.empty())
            out = row;
          else
            for (size_t i = 0; i < row.size(); ++i) out[i] += row[i];
        }
      table_->wait();
      return out;
    }

   private:
    Table* table_;
    std::vector<std::vector<float>>& mine_;
  };
  Table* table_;
  int rank_;
};

/// What each of so many processes does.
void by_processes(int processes, const std::function<void(Team&)>& what) {
  Table table(processes);
  std::vector<std::thread> threads;
  for (int rank = 0; rank < processes; ++rank)
    threads.emplace_back([&, rank] {
      const std::lock_guard turn(table.turn);
      Thread team(&table, rank);
      what(team);
    });
  for (std::thread& thread : threads) thread.join();
}

/// Three steps of a stage by so many processes, as each of them leaves it.
std::vector<std::string> trained(const std::string& name, TrainConfig config, int64_t micro_batches,
                                 int processes, std::vector<double>* losses = nullptr) {
  config.loop.micro_batches = 1;  // cut below, for a team of our own
  std::vector<std::string> out(static_cast<size_t>(processes));
  by_processes(processes, [&](Team& team) {
    const auto stage = tiny_stage(name, config);
    stage->cut_steps(micro_batches, team);
    for (int64_t i = 0; i < 3; ++i) {
      const NamedValues values = stage->step(i);
      for (const auto& value : values)
        if (team.rank() == 0 && losses != nullptr) losses->push_back(value.second);
    }
    out[static_cast<size_t>(team.rank())] = result_bytes(*stage);
  });
  return out;
}

/// Dropout, batch norm, a discriminator and its balance, windows of both kinds.
TrainConfig everything() {
  TrainConfig c = tiny_training(6);
  for (OptimiserConfig* o : optimisers(c)) o->batch = 8;
  choose(skeleton(c).model, "skeleton/pointnet", {"points=64", "dropout=0.3"});
  motion(c).weights.adversarial = 0.01;
  motion(c).balance_limit = 0.0;
  motion(c).windows.self_share = 0.5;
  deformation(c).skinning_steps = 1;
  return c;
}

TEST(Team, HowManyShareAStepChangesNoBit) {
  for (const std::string name : {"skeleton", "motion", "deformation"}) {
    const std::string one = trained(name, everything(), 4, 1)[0];
    for (const int processes : {2, 4})
      for (const std::string& each : trained(name, everything(), 4, processes))
        EXPECT_TRUE(each == one) << name << ", " << processes << " processes";
    // Dropout and statistics are of a micro-batch, so another number of them is another training.
    EXPECT_FALSE(trained(name, everything(), 2, 1)[0] == one) << name;
  }
}

/// Every number of what was seen, for comparison; what is not there counts as well.
std::vector<double> numbers_of(const SeenJoints& seen) {
  std::vector<double> out{static_cast<double>(seen.since), seen.turns ? 1.0 : 0.0,
                          seen.uncertainty ? 1.0 : 0.0, seen.left ? 1.0 : 0.0};
  const auto add = [&](const auto& v) { out.insert(out.end(), v.data(), v.data() + v.size()); };
  for (const auto& joint : seen.joints) add(joint);
  if (seen.turns)
    for (const auto& turn : *seen.turns) add(turn);
  if (seen.uncertainty) out.insert(out.end(), seen.uncertainty->begin(), seen.uncertainty->end());
  if (seen.left) add(*seen.left);
  return out;
}

TEST(Team, TheyAskTheExtractorTogether) {
  TrainConfig c = tiny_training(6);
  AnswersConfig& answers = motion(c).answers;
  answers.tracks.sequences = 5;  // which three processes cannot divide
  answers.tracks.frames = 3;
  answers.views = 1;
  Bundle network;
  network.add(tiny_stage("skeleton", c)->result());
  const Corpus& corpus = testing::tiny_data().train;
  const auto all = [&](Team& team) {
    std::vector<std::vector<double>> out;
    for (const JointTrack& track : ask(corpus, "train", answers, network, 3, {}, team))
      for (const SeenJoints& seen : track.frames) out.push_back(numbers_of(seen));
    return out;
  };
  const auto one = all(alone());
  ASSERT_EQ(one.size(), 15u);
  by_processes(3, [&](Team& team) { EXPECT_EQ(all(team), one) << team.rank(); });
  by_processes(7, [&](Team& team) { EXPECT_EQ(all(team), one) << "some of them ask for nothing"; });
}

TEST(Team, GroupsOfThreadsChangeNoBit) {
  TrainConfig c = everything();  // whose skeleton has batch norm, and takes turns
  motion(c).weights.adversarial = 0;
  const int before = threads();
  for (const std::string name : {"skeleton", "motion", "deformation"}) {
    set_threads(1);
    const std::string one = trained(name, c, 4, 1)[0];
    for (const int n : {2, 3, 8}) {
      set_threads(n);
      EXPECT_TRUE(trained(name, c, 4, 1)[0] == one) << name << ", " << n << " threads";
    }
  }
  set_threads(before);
}

TEST(Team, MicroBatchesAddUpToTheStep) {
  // Where nothing depends on who is in a micro-batch, it is the same sum in another order.
  TrainConfig c = tiny_training(6);
  for (OptimiserConfig* o : optimisers(c)) o->batch = 8;
  motion(c).weights.adversarial = 0;
  motion(c).self_first_pass = true;
  resize(deformation(c).model, {"dropout=0"});
  resize(motion(c).model, {"dropout=0"});
  for (const std::string name : {"skeleton", "motion", "deformation"}) {
    std::vector<double> whole, cut;
    trained(name, c, 1, 1, &whole);
    trained(name, c, 4, 1, &cut);
    for (size_t i = 0; i < whole.size(); ++i)
      EXPECT_NEAR(cut[i], whole[i], 2e-3 * std::abs(whole[i])) << name << ", value " << i;
  }
}

TEST(Team, BuffersThatNobodyChangesStayAsTheyAre) {
  TrainConfig c = tiny_training(6);
  for (OptimiserConfig* o : optimisers(c)) o->batch = 9;
  const auto constants = [&](int64_t steps) {
    const auto stage = tiny_stage("motion", c);
    stage->cut_steps(3, alone());  // thirds do not add up to one
    for (int64_t i = 0; i < steps; ++i) stage->step(i);
    std::string out;
    for (const StateEntry& entry : stage->weights())
      if (entry.parameter == nullptr)
        out.append(static_cast<const char*>(entry.value->bytes()),
                   static_cast<size_t>(entry.value->numel()) * size_of(entry.value->dtype()));
    return out;
  };
  ASSERT_FALSE(constants(0).empty());
  EXPECT_TRUE(constants(0) == constants(2));
}

/// A step adds up the parameters that are optimised and the buffers that steps change, each with a
/// flag. A body and a basis of motions, which H4D keeps as buffers, are larger than its network.
TEST(Team, BuffersThatNobodyChangesDoNotTravel) {
  TrainConfig norms = tiny_training(6);
  choose(skeleton(norms).model, "skeleton/pointnet", {"points=64"});
  for (const auto& [name, config] :
       {std::pair{"codes", testing::tiny_codes(6)}, {"skeleton", norms}}) {
    Table table(1);
    const std::lock_guard turn(table.turn);
    Thread team(&table, 0);
    const auto stage = tiny_stage(name, config);
    stage->cut_steps(2, team);
    stage->step(0);
    size_t travel = 0, stay = 0, change = 0;
    for (const StateEntry& entry : stage->weights()) {
      const size_t numbers = 1 + static_cast<size_t>(entry.value->numel());
      (entry.parameter != nullptr || entry.changes ? travel : stay) += numbers;
      change += entry.changes ? numbers : 0;
    }
    EXPECT_EQ(table.width, travel) << name;
    EXPECT_GT(stay + change, 100u) << name;
  }
}

/// A stage whose micro-batches do not all take the same part: what each of them does is given.
class Uneven final : public Stage {
 public:
  using Part = std::function<void(Uneven&, Context&, int64_t, Var*)>;
  explicit Uneven(Part part) : Stage("uneven", config(), {}), part_(std::move(part)) {
    const std::string model = "deformation/weights", judge = "smrm/discriminator";
    net = add_network<WeightNet>("deformation.weights", model, model_config(model, {"width=4"}),
                                 RngKey{1, 0});
    discriminator =
        add_network<Discriminator>("discriminator", judge, model_config(judge), RngKey{2, 0});
    optimiser_ = add_optimiser("optimiser", {"deformation.weights"}, config());
  }
  static OptimiserConfig config() {
    OptimiserConfig out;
    out.batch = 4;
    return out;
  }
  NamedValues step(int64_t) override {
    gradients = parts(*optimiser_, [&](const MicroBatch& micro) {
                  return differentiate(RngKey{3, 0}, [&](Context& ctx) {
                    Var total(Tensor::zeros({1}));
                    part_(*this, ctx, micro.index, &total);
                    return total;
                  });
                }).gradients;
    return {};
  }
  NamedTensors examples(int64_t) const override { return {}; }
  NamedValues validate() override { return {}; }

  WeightNet* net;
  Discriminator* discriminator;
  Gradients gradients;

 private:
  Part part_;
  Optimiser* optimiser_;
};

/// Adds to a loss what gives every number of a parameter this gradient.
void pull(Context& ctx, const Parameter& p, double gradient, Var* total) {
  *total = *total + reshape(scale(sum_all(ctx.bind(p)), gradient), {1});
}

TEST(Team, AParameterMayTakePartInSomeMicroBatchesOnly) {
  const Uneven::Part part = [](Uneven& s, Context& ctx, int64_t micro, Var* total) {
    Mlp3& net = s.net->net;
    pull(ctx, net.fc2.bias, 0, total);                  // something is always differentiable
    if (micro <= 1) pull(ctx, net.fc1.bias, 4, total);  // the first have it, later ones not
    if (micro >= 1) pull(ctx, net.fc3.bias, 8.0 * static_cast<double>(micro), total);
  };
  for (const int processes : {1, 2, 4})
    by_processes(processes, [&](Team& team) {
      Uneven stage(part);
      stage.cut_steps(4, team);
      stage.step(0);
      const Mlp3& net = stage.net->net;
      const Gradients& g = stage.gradients;
      ASSERT_NE(g.find(net.fc1.bias.id), nullptr) << processes << " processes";
      ASSERT_NE(g.find(net.fc3.bias.id), nullptr) << processes << " processes";
      EXPECT_EQ(g.find(net.fc1.bias.id)->item(), 2) << "4 in two of four micro-batches";
      EXPECT_EQ(g.find(net.fc3.bias.id)->item(), 12) << "8, 16 and 24 in three of four";
      EXPECT_EQ(g.find(net.fc2.bias.id)->item(), 0);
      EXPECT_EQ(g.find(net.fc1.weight.id), nullptr) << "takes part in none";
    });
}

TEST(Team, ABufferMayChangeInSomeMicroBatchesOnly) {
  const auto running = [](const Uneven& stage, size_t layer) {
    return stage.discriminator->bns[layer].running_mean.clone();
  };
  const auto judged = [](Uneven& s, Context& ctx, double input) {
    const Frozen frozen(ctx);
    (*s.discriminator)(ctx, Var(Tensor::full({2, 8, 69}, input)), Var(Tensor::full({2, 63}, 1)));
  };
  const auto stepped = [&](const std::vector<double>& inputs, Team& team, int64_t micro_batches) {
    auto stage = std::make_unique<Uneven>([&](Uneven& s, Context& ctx, int64_t micro, Var* total) {
      pull(ctx, s.net->net.fc1.bias, 1, total);
      if (inputs[static_cast<size_t>(micro)] != 0)
        judged(s, ctx, inputs[static_cast<size_t>(micro)]);
    });
    stage->cut_steps(micro_batches, team);
    stage->step(0);
    return stage;
  };
  const Tensor untouched = running(Uneven(nullptr), 0);
  const Tensor whole = running(*stepped({5}, alone(), 1), 0);
  ASSERT_GT(std::abs(whole.item(0) - untouched.item(0)), 1e-4);
  for (const int processes : {1, 2, 4})
    by_processes(processes, [&](Team& team) {
      const auto stage = stepped({0, 0, 5, 0}, team, 4);
      const Tensor now = running(*stage, 0);
      for (int64_t i = 0; i < now.numel(); ++i)
        EXPECT_NEAR(now.item(i), 0.75 * untouched.item(i) + 0.25 * whole.item(i), 1e-6)
            << processes << " processes";
      const Tensor none = running(*stepped({0, 0, 0, 0}, team, 4), 0);
      for (int64_t i = 0; i < none.numel(); ++i) EXPECT_EQ(none.item(i), untouched.item(i));
    });
}

TEST(Team, WhatAStepMustNotDoIsAnError) {
  // Batch norm makes the stage above take turns; this one's micro-batches may be computed at once.
  class SideBySide final : public Stage {
   public:
    explicit SideBySide(std::function<void(SideBySide&, Context&, int64_t, Var*)> part)
        : Stage("side by side", Uneven::config(), {}), part_(std::move(part)) {
      net = add_network<Smrm>("motion", "smrm/rot6d",
                              model_config("smrm/rot6d", {"hidden=4", "standardise=true"}),
                              RngKey{1, 0});
      other =
          add_network<WeightNet>("deformation.weights", "deformation/weights",
                                 model_config("deformation/weights", {"width=4"}), RngKey{2, 0});
      optimiser_ = add_optimiser("optimiser", {"motion"}, Uneven::config());
    }
    NamedValues step(int64_t) override {
      parts(*optimiser_, [&](const MicroBatch& micro) {
        return differentiate(RngKey{3, 0}, [&](Context& ctx) {
          Var total(Tensor::zeros({1}));
          pull(ctx, net->fc_trans.bias, 1, &total);
          part_(*this, ctx, micro.index, &total);
          return total;
        });
      });
      return {};
    }
    NamedTensors examples(int64_t) const override { return {}; }
    NamedValues validate() override { return {}; }
    Smrm* net;
    WeightNet* other;

   private:
    std::function<void(SideBySide&, Context&, int64_t, Var*)> part_;
    Optimiser* optimiser_;
  };
  const auto with = [](const std::function<void(SideBySide&, Context&, int64_t, Var*)>& part) {
    SideBySide stage(part);
    stage.cut_steps(4, alone());
    stage.step(0);
  };
  with([](SideBySide&, Context&, int64_t, Var*) {});
  test::expect_error<Error>(
      [&] {
        with([](SideBySide& s, Context&, int64_t micro, Var*) {
          if (micro == 2) s.net->joint_mean = s.net->joint_mean.clone();
        });
      },
      {"have changed the buffer 'smrm.joint_mean'", "changes_buffers"});
  test::expect_error<Error>(
      [&] {
        with([](SideBySide& s, Context& ctx, int64_t, Var* total) {
          pull(ctx, s.other->net.fc1.bias, 1, total);
        });
      },
      {"gradients of 1 parameters that the step's optimiser does not hold"});
}

TEST(Team, EveryProcessOfAHostHasAGpuOfItsOwn) {
  EXPECT_EQ(alone().local_rank(), 0);
  EXPECT_EQ(local_rank(), 0) << "until somebody says another";
  for (const int count : {1, 2, 4, 8})
    for (int rank = 0; rank < 9; ++rank) EXPECT_EQ(gpu_of(rank, count), rank % count);
  set_local_rank(3);
  EXPECT_EQ(local_rank(), 3);
  set_local_rank(0);
}

TEST(Team, WhatCannotBeDividedIsRefused) {
  TrainConfig c = tiny_training(6);
  c.loop.micro_batches = 3;  // batches are of 4
  for (const std::string name : {"skeleton", "motion", "deformation"})
    EXPECT_HAS(test::refusal_of([&] { tiny_stage(name, c); }), "loop.micro_batches divides");
  Table table(3);
  Thread team(&table, 0);
  EXPECT_HAS(test::refusal_of([&] { tiny_stage("motion", tiny_training(6))->cut_steps(4, team); }),
             "3 processes cannot divide");
}

}  // namespace
}  // namespace restage
