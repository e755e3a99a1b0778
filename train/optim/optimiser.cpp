#include "train/optim/optimiser.h"

#include <algorithm>

namespace restage {
namespace {

using Modules = std::vector<std::pair<std::string, Module*>>;

std::vector<uint64_t> sorted_ids(const Modules& modules) {
  std::vector<uint64_t> out;
  for (const NamedParameter& p : named_parameters(modules)) out.push_back(p.parameter->id);
  std::sort(out.begin(), out.end());
  return out;
}

/// The parameters that Muon is to take (`of_muon`), or all others.
std::vector<NamedParameter> share(const Modules& modules, const OptimiserConfig& config,
                                  bool of_muon) {
  std::vector<NamedParameter> out = named_parameters(modules);
  std::erase_if(out, [&](const NamedParameter& p) {
    const bool by_muon = config.kind == OptimiserConfig::Kind::muon && Muon::takes(*p.parameter);
    return by_muon != of_muon;
  });
  return out;
}

int64_t count(const std::vector<NamedParameter>& parameters) {
  int64_t out = 0;
  for (const NamedParameter& p : parameters) out += p.parameter->value.numel();
  return out;
}

}  // namespace

Optimiser::Optimiser(const Modules& modules, const OptimiserConfig& config)
    : ids_(sorted_ids(modules)),
      muon_(share(modules, config, true), config.muon),
      adam_(share(modules, config, false), config.adam),
      clip_(config.clip),
      numbers_{count(share(modules, config, true)), count(share(modules, config, false))} {}

void Optimiser::step(const Gradients& gradients, double rate) {
  double scale = 1;
  if (clip_ > 0) scale = std::min(1.0, clip_ / (gradients.norm(ids_) + 1e-6));
  muon_.step(gradients, rate, scale);
  adam_.step(gradients, rate, scale);
}

void Optimiser::save(const std::string& prefix, TensorFile& file) const {
  muon_.save(prefix, file);
  adam_.save(prefix, file);
}

void Optimiser::load(const std::string& prefix, const TensorFile& file, const std::string& where) {
  muon_.load(prefix, file, where);
  adam_.load(prefix, file, where);
}

}  // namespace restage
