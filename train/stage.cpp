#include "train/stage.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "autograd/base/log.h"

namespace restage {
namespace {

/// Copies those of `from`'s tensors whose names, after `prefix`, match one of `names`; notes which
/// patterns matched.
void copy_matching(Module& to, Module* from, const std::string& prefix,
                   const std::vector<std::string>& names, std::vector<bool>* used,
                   const std::string& where) {
  std::map<std::string, Tensor*> given;
  if (from != nullptr)
    for (const StateEntry& entry : state_of(*from)) given[entry.name] = entry.value;
  for (const StateEntry& entry : state_of(to)) {
    bool wanted = false;
    for (size_t i = 0; i < names.size(); ++i)
      if (::fnmatch(names[i].c_str(), (prefix + entry.name).c_str(), 0) == 0)
        wanted = (*used)[i] = true;
    if (!wanted) continue;
    const auto found = given.find(entry.name);
    if (found == given.end() || !(found->second->shape() == entry.value->shape()))
      throw InputError(where,
                       "has no tensor " + name_in_quotes(prefix + entry.name) + " of shape " +
                           entry.value->shape().str(),
                       "take weights of the same model and sizes, or name fewer in init_names");
    *entry.value = found->second->clone();
  }
}

}  // namespace

Points points_of(const Tensor& points, int64_t row, int64_t count) {
  Points out;
  for (int64_t i = row * count; i < (row + 1) * count; ++i)
    out.emplace_back(Eigen::Map<const Point>(points.data<float>() + 3 * i));
  return out;
}

Joints joints_of(const Tensor& joints, int64_t row) {
  Joints out;
  const Points points = points_of(joints, row, kJoints);
  for (size_t j = 0; j < kJoints; ++j) out[j] = points[j].cast<double>();
  return out;
}

Optimiser* Stage::add_optimiser(const std::string& name, const std::vector<std::string>& roles,
                                const OptimiserConfig& config) {
  std::vector<std::pair<std::string, Module*>> modules;
  for (const Network& n : networks_)
    if (std::find(roles.begin(), roles.end(), n.role) != roles.end())
      modules.emplace_back(prefix_of(n.role), n.model.net.get());
  for (const auto& [prefix, module] : modules)
    if (optimisation_.steps > 0 && count_parameters(*module) == 0)
      throw InputError("", "the model of stage '" + name_ + "' has nothing to learn",
                       "set " + name_ + ".optimiser.steps=0 to use it as it is");
  optimisers_.push_back({name, std::make_unique<Optimiser>(modules, config)});
  return optimisers_.back().optimiser.get();
}

void Stage::save(TensorFile& file) const {
  for (const Network& n : networks_) append(&file, *n.model.net, prefix_of(n.role));
  for (const NamedOptimiser& o : optimisers_) o.optimiser->save(o.name + ".", file);
  save_more(file);
}

void Stage::load(const TensorFile& file, const std::string& where) {
  for (const Network& n : networks_) load_state(*n.model.net, file, prefix_of(n.role), where);
  for (const NamedOptimiser& o : optimisers_) o.optimiser->load(o.name + ".", file, where);
  load_more(file, where);
}

void Stage::start_from(const Bundle& weights, const std::vector<std::string>& names,
                       const std::string& where) {
  started_from_weights_ = true;
  std::vector<bool> used(names.size(), false);
  for (const Network& n : networks_) {
    if (!n.handed_on) continue;
    const TrainedModel* given = weights.find(n.role);
    copy_matching(*n.model.net, given ? given->net.get() : nullptr, prefix_of(n.role), names, &used,
                  where);
    if (given == nullptr) continue;
    for (const auto& [key, value] : n.model.settings) {
      const auto other = given->settings.find(key);
      if (other != given->settings.end() && other->second != value)
        log_warning(where + " was trained with " + key + " " + other->second + ", this stage has " +
                    value);
    }
  }
  for (size_t i = 0; i < names.size(); ++i)
    if (!used[i])
      throw InputError(where, "has nothing for " + name_in_quotes(names[i]) + " of this stage",
                       "'restage weights show' lists its tensors");
}

Bundle Stage::result() const {
  Bundle out;
  for (const Network& n : networks_)
    if (n.handed_on) out.put(n.role, n.model);
  return out;
}

std::vector<StateEntry> Stage::weights() const {
  std::vector<StateEntry> out;
  for (const Network& n : networks_)
    if (n.handed_on)
      for (StateEntry& entry : state_of(*n.model.net, prefix_of(n.role)))
        out.push_back(std::move(entry));
  return out;
}

Differentiated differentiate(const RngKey& key, const std::function<Var(Context&)>& loss) {
  const auto run = [&] {
    Tape tape;
    Context ctx{&tape, true, key};
    const Var value = loss(ctx);
    Differentiated out;
    out.loss = value.value.item();
    out.gradients = tape.backward(value);
    out.norm = out.gradients.norm();
    return out;
  };
  Differentiated out = run();
  if (!std::isfinite(out.loss) || !std::isfinite(out.norm)) {
    const FiniteCheck check;
    run();
    throw NonFiniteError(
        "the loss or the norm of its gradient became infinite or NaN by adding up finite values");
  }
  return out;
}

}  // namespace restage
