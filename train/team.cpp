#include "train/team.h"

#include <cstdlib>

#include "autograd/base/error.h"

namespace restage {
namespace {

class Alone final : public Team {
  class Added final : public Sum {
    void give(std::vector<float> row) override {
      if (total_.empty()) {
        total_ = std::move(row);
        return;
      }
      for (size_t i = 0; i < total_.size(); ++i) total_[i] += row[i];
    }
    std::vector<float> total() override { return std::move(total_); }
    std::vector<float> total_;
  };

  int rank() const override { return 0; }
  int size() const override { return 1; }
  int local_rank() const override { return 0; }
  std::unique_ptr<Sum> sum(size_t) override { return std::make_unique<Added>(); }
  std::vector<std::vector<double>> all(const std::vector<std::vector<double>>& mine) override {
    return mine;
  }
  bool any(bool mine) override { return mine; }
  std::string of_first(std::string mine) override { return mine; }
  std::string name() const override { return ""; }
  [[noreturn]] void abort(int code) override { std::exit(code); }
};

}  // namespace

Team& alone() {
  static Alone team;
  return team;
}

#ifndef RESTAGE_MPI
Team& team_of_processes() {
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) {
    const char* value = std::getenv(variable);
    if (value != nullptr && std::atoi(value) > 1)
      throw InputError("",
                       std::string("there are ") + value + " processes (" + variable +
                           "), and this program was built without MPI",
                       "configure it with -DRESTAGE_MPI=ON, or start one process");
  }
  return alone();
}
#endif

}  // namespace restage
