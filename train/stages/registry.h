// The training stages by name. A stage is a pair of files here (its config struct with a visit(), a
// class derived from Stage) and one line in registry.cpp.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "train/stage.h"
#include "train/stages/stage_input.h"

namespace restage {

struct StageType {
  std::string name, help;
  AnyConfig config;  ///< the configuration with its defaults
  /// The roles that it may leave in a bundle; the first role always.
  std::vector<std::string> roles;
  std::vector<std::string> figures;  ///< figures of validate(); lower is better
  /// The stages whose networks this stage needs with such a configuration; they are trained before
  /// it.
  std::vector<std::string> (*reads)(const AnyConfig& config);
  std::unique_ptr<Stage> (*make)(const AnyConfig& config, const StageInput& input);
  /// For a forecast: makes what comes before the first step short, and returns how many times as
  /// long it would take in full. Null: there is nothing to shorten.
  double (*shorten)(AnyConfig& config) = nullptr;
  /// Its keys of the optimiser. Null: the configuration has no member `optimiser`.
  OptimiserConfig& (*optimiser)(AnyConfig& config) = nullptr;
};

/// The line of a stage: a class derived from Stage with a type `Config`, a static reads(Config), a
/// constructor from a Config and a StageInput, and, where it is needed, a static shorten(Config&).
template <class S>
StageType stage_of(const char* name, const char* help, std::vector<std::string> roles,
                   std::vector<std::string> figures) {
  double (*shorten)(AnyConfig&) = nullptr;
  if constexpr (requires(typename S::Config & c) { S::shorten(c); })
    shorten = [](AnyConfig& c) { return S::shorten(c.as<typename S::Config>()); };
  OptimiserConfig& (*optimiser)(AnyConfig&) = nullptr;
  if constexpr (requires(typename S::Config & c) { c.optimiser.schedule; })
    optimiser = [](AnyConfig& c) -> OptimiserConfig& {
      return c.as<typename S::Config>().optimiser;
    };
  return {name,
          help,
          AnyConfig(typename S::Config()),
          std::move(roles),
          std::move(figures),
          [](const AnyConfig& c) { return S::reads(c.as<typename S::Config>()); },
          [](const AnyConfig& c, const StageInput& input) -> std::unique_ptr<Stage> {
            return std::make_unique<S>(c.as<typename S::Config>(), input);
          },
          shorten,
          optimiser};
}

const std::deque<StageType>& stage_types();
/// Adds a stage of a program that uses this library, before anything else is done: its section is
/// then a section of every configuration. Error if there is one of that name.
void register_stage(StageType type);
std::vector<std::string> stage_names();
/// STAGE.FIGURE of all that a stage measures, that networks of its roles bring with them, and that
/// set_more_figures() named.
std::vector<std::string> known_figures(const StageType& type);
/// Figures, each STAGE.FIGURE, that an observer of the next trainings adds (TrainObserver).
void set_more_figures(std::vector<std::string> figures);
/// Those of a stage, without its name.
std::vector<std::string> more_figures_of(const std::string& stage);
/// The first of `names` that is not STAGE.FIGURE of some stage; "" if there is none.
std::string unknown_figure(const std::vector<std::string>& names);
/// The stage of this name. InputError with the nearest known name if there is none.
const StageType& stage_type(const std::string& name);
/// The networks that a stage would leave, taken from a weights file, run or artifact. InputError if
/// `path` has no such networks.
Bundle networks_of(const StageType& stage, const std::string& path);

}  // namespace restage
