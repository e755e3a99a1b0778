// Processes that train together. Each process computes some of a step's micro-batches. All
// processes add up the same numbers in the same order, so the number of processes changes no bit
// (docs/decisions.md, "Devices and processes").
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace restage {

class Team {
 public:
  virtual ~Team() = default;
  virtual int rank() const = 0;  ///< from 0
  virtual int size() const = 0;
  /// The process's number among those of the team on its own host, from 0.
  virtual int local_rank() const = 0;

  /// A sum of rows, each given by one process.
  class Sum {
   public:
    virtual ~Sum() = default;
    /// The next row of this process: number rank, rank + size, rank + 2 size, ... The row travels
    /// while the caller goes on. All processes give the same number of rows.
    virtual void give(std::vector<float> row) = 0;
    /// The sum of all rows, added in the order of their numbers; waits for the other processes.
    virtual std::vector<float> total() = 0;
  };
  /// Begins a sum of rows of `width` numbers.
  virtual std::unique_ptr<Sum> sum(size_t width) = 0;
  /// The rows of all processes in the order of their numbers; for rows of few numbers.
  virtual std::vector<std::vector<double>> all(const std::vector<std::vector<double>>& mine) = 0;
  /// Whether any process says true.
  virtual bool any(bool mine) = 0;
  /// The bytes that the first process gives.
  virtual std::string of_first(std::string mine) = 0;

  /// Seconds that this process has stood still for the others' rows.
  virtual double waited() const { return 0; }
  /// "rank 2 of 4 on HOST"; empty for one process.
  virtual std::string name() const = 0;
  /// Ends all processes at once.
  [[noreturn]] virtual void abort(int code) = 0;
};

/// A team of this process alone.
Team& alone();

/// The processes that mpirun or srun has started with this one; alone() if there are no others.
/// InputError: there are others and the program was built without MPI, or Slurm says another number
/// of processes than MPI.
Team& team_of_processes();

}  // namespace restage
