#include "train/optim/optimiser.h"

#include <algorithm>

#include "autograd/kernels/elementwise.h"
#include "train/phases.h"

namespace restage {
namespace {

using Kind = OptimiserConfig::Kind;
using Modules = std::vector<std::pair<std::string, Module*>>;
using Rules = std::vector<std::unique_ptr<UpdateRule>>;

std::vector<uint64_t> sorted_ids(const std::vector<NamedParameter>& parameters) {
  std::vector<uint64_t> out;
  out.reserve(parameters.size());
  for (const NamedParameter& p : parameters) out.push_back(p.parameter->id);
  std::sort(out.begin(), out.end());
  return out;
}

/// The parameters that Muon is to take (`of_muon`), or all others.
std::vector<NamedParameter> share(std::vector<NamedParameter> out, Kind kind, bool of_muon) {
  std::erase_if(out, [&](const NamedParameter& p) {
    const bool by_muon = kind == Kind::muon && Muon::takes(*p.parameter);
    return by_muon != of_muon;
  });
  return out;
}

int64_t count(const std::vector<NamedParameter>& parameters) {
  int64_t out = 0;
  for (const NamedParameter& p : parameters) out += p.parameter->value.numel();
  return out;
}

Rules rules_of(const std::vector<NamedParameter>& parameters, const OptimiserConfig& c) {
  Rules out;
  switch (c.kind) {
    case Kind::muon:
      out.push_back(std::make_unique<Muon>(share(parameters, c.kind, true), c.muon));
      out.push_back(std::make_unique<Adam>(share(parameters, c.kind, false), c.adam));
      break;
    case Kind::adam:
      out.push_back(std::make_unique<Adam>(parameters, c.adam));
      break;
    case Kind::adamw:
      out.push_back(std::make_unique<Adam>(parameters, c.adam, Adam::Decay::of_weights));
      break;
    case Kind::sgd:
      out.push_back(std::make_unique<Sgd>(parameters, c.sgd));
      break;
    case Kind::lion:
      out.push_back(std::make_unique<Lion>(parameters, c.lion));
      break;
  }
  return out;
}

}  // namespace

Optimiser::Optimiser(const Modules& modules, const OptimiserConfig& config,
                     const std::string& where)
    : clip_(config.clip), clip_value_(config.clip_value) {
  const std::vector<NamedParameter> all = named_parameters(modules);
  ids_ = sorted_ids(all);
  const auto shares = grouped(all, config.groups, where);
  for (size_t i = 0; i < shares.size(); ++i)
    add(shares[i], i == 0 ? ParameterGroup{} : config.groups[i - 1], config);
  std::sort(frozen_.begin(), frozen_.end());
  if (config.steps > 0 && !ids_.empty() && frozen_.size() == ids_.size())
    throw InputError(where, "freezes every parameter",
                     "leave some to be learned, or set optimiser.steps=0");
}

void Optimiser::add(const std::vector<NamedParameter>& parameters, const ParameterGroup& group,
                    const OptimiserConfig& config) {
  for (const NamedParameter& p : parameters) {
    if (group.frozen) frozen_.push_back(p.parameter->id);
    if (group.frozen_until > 0) later_.emplace_back(p.parameter->id, group.frozen_until);
  }
  if (group.frozen) {
    numbers_.frozen += count(parameters);
    return;
  }
  OptimiserConfig own = config;
  if (group.decay)
    own.adam.weight_decay = own.sgd.weight_decay = own.lion.weight_decay = *group.decay;
  numbers_.muon += count(share(parameters, config.kind, true));
  numbers_.adam += count(share(parameters, config.kind, false));
  parts_.push_back({group, rules_of(parameters, own)});
}

std::vector<uint64_t> Optimiser::moving(int64_t step) const {
  std::vector<uint64_t> out = ids_;
  std::erase_if(out, [&](uint64_t id) {
    return frozen(id) || std::any_of(later_.begin(), later_.end(), [&](const auto& later) {
             return later.first == id && step < later.second;
           });
  });
  return out;
}

bool Optimiser::frozen(uint64_t id) const {
  return std::binary_search(frozen_.begin(), frozen_.end(), id);
}

void Optimiser::step(const Gradients& gradients, double rate, int64_t step) {
  const PhaseScope moving_weights(Phase::optimise);
  const bool some_rest = !frozen_.empty() || !later_.empty();
  const std::vector<uint64_t> ids = some_rest ? moving(step) : ids_;
  std::optional<Gradients> small;
  if (clip_value_ > 0) small = clipped(gradients, ids, clip_value_);
  const Gradients& g = small ? *small : gradients;
  double scale = 1;
  if (clip_ > 0) scale = std::min(1.0, clip_ / (g.norm(ids) + 1e-6));
  for (const Part& part : parts_)
    if (part.group.moves_in(step))
      for (const auto& rule : part.rules) rule->step(g, rate * part.group.rate, scale);
}

void Optimiser::save(const std::string& prefix, TensorFile& file) const {
  for (const Part& part : parts_)
    for (const auto& rule : part.rules) rule->save(prefix, file);
}

void Optimiser::load(const std::string& prefix, const TensorFile& file, const std::string& where) {
  for (const Part& part : parts_)
    for (const auto& rule : part.rules) rule->load(prefix, file, where);
}

}  // namespace restage
