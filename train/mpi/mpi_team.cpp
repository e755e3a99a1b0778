// A team by MPI: compiled with RESTAGE_MPI only.
#define OMPI_SKIP_MPICXX 1  // C++ bindings that no MPI has any more
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <climits>
#include <cstdlib>
#include <thread>

#include "autograd/base/error.h"
#include "autograd/base/host.h"
#include "train/team.h"

namespace restage {
namespace {

int number_in(const char* variable) {
  const char* value = std::getenv(variable);
  return value == nullptr ? 0 : std::atoi(value);
}

/// Slices of a row, one for each rank, as even as can be.
struct Slices {
  Slices(size_t width, int ranks) {
    const size_t each = (width + static_cast<size_t>(ranks) - 1) / static_cast<size_t>(ranks);
    if (each > INT_MAX / static_cast<size_t>(ranks))
      throw WorkError("a gradient is too long for MPI's counts");
    for (size_t r = 0, from = 0; r < static_cast<size_t>(ranks); ++r, from += each) {
      const size_t begin = std::min(from, width), end = std::min(from + each, width);
      first.push_back(static_cast<int>(begin));
      count.push_back(static_cast<int>(end - begin));
    }
  }
  std::vector<int> first, count;
};

class MpiSum final : public Team::Sum {
 public:
  MpiSum(size_t width, int rank, int size, double* waited)
      : width_(width),
        size_(size),
        slices_(width, size),
        mine_(slices_.count[rank]),
        waited_(*waited) {
    for (int r = 0; r < size; ++r) {
      received_count_.push_back(mine_);
      received_first_.push_back(r * mine_);
    }
  }
  ~MpiSum() override { finish_round(); }

  void give(std::vector<float> row) override {
    finish_round();
    sent_ = std::move(row);
    received_.resize(static_cast<size_t>(size_) * static_cast<size_t>(mine_));
    MPI_Ialltoallv(sent_.data(), slices_.count.data(), slices_.first.data(), MPI_FLOAT,
                   received_.data(), received_count_.data(), received_first_.data(), MPI_FLOAT,
                   MPI_COMM_WORLD, &request_);
    mover_ = std::jthread([this](const std::stop_token& stop) { move(stop); });
  }

  std::vector<float> total() override {
    finish_round();
    std::vector<float> out(width_);
    const double start = MPI_Wtime();
    MPI_Allgatherv(slice_.data(), mine_, MPI_FLOAT, out.data(), slices_.count.data(),
                   slices_.first.data(), MPI_FLOAT, MPI_COMM_WORLD);
    waited_ += MPI_Wtime() - start;
    return out;
  }

 private:
  /// MPI moves nothing while nobody calls it, and the caller computes. So a thread of its own calls
  /// MPI now and then.
  void move(const std::stop_token& stop) {
    for (int done = 0; !done && !stop.stop_requested();) {
      MPI_Test(&request_, &done, MPI_STATUS_IGNORE);
      if (!done) std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  }

  /// Adds the rows of the last round in the order of the ranks, which is the order of the rows'
  /// numbers.
  void finish_round() {
    if (!mover_.joinable()) return;
    const double start = MPI_Wtime();
    mover_.request_stop();
    mover_.join();
    MPI_Wait(&request_, MPI_STATUS_IGNORE);
    waited_ += MPI_Wtime() - start;
    const float* row = received_.data();
    int r = 0;
    if (slice_.empty()) {
      slice_.assign(row, row + mine_);
      r = 1;
    }
    for (; r < size_; ++r)
      for (int i = 0; i < mine_; ++i) slice_[static_cast<size_t>(i)] += row[r * mine_ + i];
  }

  const size_t width_;
  const int size_;
  const Slices slices_;
  const int mine_;  // numbers of this rank's slice
  double& waited_;
  std::vector<int> received_count_, received_first_;
  std::vector<float> sent_, received_, slice_;
  MPI_Request request_ = MPI_REQUEST_NULL;
  std::jthread mover_;  // while this thread runs, no other thread calls MPI
};

class MpiTeam final : public Team {
 public:
  MpiTeam() {
    int threads = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &threads);
    if (threads < MPI_THREAD_SERIALIZED)
      throw WorkError("this MPI library lets one thread only call it; build with another");
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    MPI_Comm host = MPI_COMM_NULL;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &host);
    MPI_Comm_rank(host, &local_rank_);
    MPI_Comm_free(&host);
    std::atexit([] { MPI_Finalize(); });
  }
  int rank() const override { return rank_; }
  int size() const override { return size_; }
  int local_rank() const override { return local_rank_; }
  std::unique_ptr<Sum> sum(size_t width) override {
    return std::make_unique<MpiSum>(width, rank_, size_, &waited_);
  }

  std::vector<std::vector<double>> all(const std::vector<std::vector<double>>& mine) override {
    const size_t width = mine.at(0).size(), rows = mine.size();
    std::vector<double> sent, received(width * rows * static_cast<size_t>(size_));
    for (const auto& row : mine) sent.insert(sent.end(), row.begin(), row.end());
    const int count = static_cast<int>(sent.size());
    MPI_Allgather(sent.data(), count, MPI_DOUBLE, received.data(), count, MPI_DOUBLE,
                  MPI_COMM_WORLD);
    std::vector<std::vector<double>> out;
    for (size_t round = 0; round < rows; ++round)
      for (size_t r = 0; r < static_cast<size_t>(size_); ++r) {
        const auto from =
            received.begin() + static_cast<std::ptrdiff_t>((r * rows + round) * width);
        out.emplace_back(from, from + static_cast<std::ptrdiff_t>(width));
      }
    return out;
  }

  bool any(bool mine) override {
    int one = mine ? 1 : 0, all = 0;
    MPI_Allreduce(&one, &all, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    return all != 0;
  }

  std::string of_first(std::string mine) override {
    unsigned long long size = mine.size();
    MPI_Bcast(&size, 1, MPI_UNSIGNED_LONG_LONG, 0, MPI_COMM_WORLD);
    mine.resize(size);
    for (size_t at = 0; at < mine.size(); at += INT_MAX)
      MPI_Bcast(mine.data() + at, static_cast<int>(std::min<size_t>(INT_MAX, mine.size() - at)),
                MPI_CHAR, 0, MPI_COMM_WORLD);
    return mine;
  }

  double waited() const override { return waited_; }
  std::string name() const override {
    return "rank " + std::to_string(rank_) + " of " + std::to_string(size_) + " on " + host_name();
  }
  [[noreturn]] void abort(int code) override {
    MPI_Abort(MPI_COMM_WORLD, code);
    std::_Exit(code);
  }

 private:
  int rank_ = 0, size_ = 1, local_rank_ = 0;
  double waited_ = 0;
};

[[noreturn]] void refuse(int slurm, int here) {
  throw InputError("",
                   "Slurm has started " + std::to_string(slurm) + " tasks, and MPI joins " +
                       std::to_string(here) + " of them",
                   "start with srun --mpi=pmix, or mpirun with as many as --ntasks says");
}

}  // namespace

Team& team_of_processes() {
  const bool launched = number_in("OMPI_COMM_WORLD_SIZE") > 0 || number_in("PMI_SIZE") > 0 ||
                        std::getenv("PMIX_RANK") != nullptr;
  if (!launched) {
    if (const int tasks = number_in("SLURM_STEP_NUM_TASKS"); tasks > 1) refuse(tasks, 1);
    return alone();
  }
  static MpiTeam team;
  const int tasks = number_in("SLURM_NTASKS");
  if (tasks > 0 && tasks != team.size()) refuse(tasks, team.size());
  if (team.size() == 1) return alone();
  return team;
}

}  // namespace restage
