#include "train/stage.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "autograd/base/log.h"
#include "autograd/base/parallel.h"
#include "autograd/base/thread_groups.h"

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
    *entry.value = found->second->clone().to(entry.value->device());
  }
}

/// A model of the same weights in the host's memory.
TrainedModel copied(const TrainedModel& of) {
  TrainedModel out = of;
  out.net = make_model(of.model, of.config, Init{RngKey{}, DType::f32});
  load_state(*out.net, to_file(*of.net), "", of.model);
  return out;
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
    if (n.handed_on) out.put(n.role, device_ == Device{} ? n.model : copied(n.model));
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

void Stage::cut_steps(int64_t micro_batches, Team& team) {
  if (examples_per_step() % micro_batches != 0)
    throw InputError(name_ + ".optimiser.batch",
                     "of " + std::to_string(examples_per_step()) + " cannot be cut into " +
                         std::to_string(micro_batches) + " micro-batches",
                     "give a batch that loop.micro_batches divides");
  if (micro_batches % team.size() != 0)
    throw InputError("loop.micro_batches",
                     "is " + std::to_string(micro_batches) + ", which " +
                         std::to_string(team.size()) + " processes cannot divide",
                     "give a multiple of that, or start fewer");
  micro_batches_ = micro_batches;
  team_ = &team;
}

std::vector<StateEntry> Stage::state() const {
  std::vector<StateEntry> out;
  for (const Network& n : networks_)
    for (StateEntry& entry : state_of(*n.model.net, prefix_of(n.role)))
      out.push_back(std::move(entry));
  return out;
}

namespace {

/// Gradients and buffers of a micro-batch as one row of numbers.
class Row {
 public:
  /// Those that a micro-batch has or changes; all have and change the same.
  explicit Row(std::vector<StateEntry> entries) : entries_(std::move(entries)) {
    for (const StateEntry& entry : entries_) width_ += static_cast<size_t>(entry.value->numel());
  }
  size_t width() const { return width_; }
  bool has_buffers() const {
    return std::any_of(entries_.begin(), entries_.end(),
                       [](const StateEntry& entry) { return entry.parameter == nullptr; });
  }

  std::vector<float> of(const Gradients& gradients) const {
    std::vector<float> out;
    out.reserve(width_);
    for (const StateEntry& entry : entries_) {
      const Tensor& t =
          entry.parameter == nullptr ? *entry.value : *gradients.find(entry.parameter->id);
      const Tensor here = t.cpu();
      out.insert(out.end(), here.data<float>(), here.data<float>() + t.numel());
    }
    return out;
  }
  /// Buffers go to where they are, gradients into `gradients`.
  void spread(const std::vector<float>& row, Gradients* gradients) const {
    const float* from = row.data();
    for (const StateEntry& entry : entries_) {
      Tensor here = Tensor::empty(entry.value->shape());
      std::copy_n(from, here.numel(), here.data<float>());
      from += here.numel();
      const Tensor t = here.to(entry.value->device());
      if (entry.parameter == nullptr)
        *entry.value = t;
      else
        gradients->set(entry.parameter->id, t);
    }
  }

 private:
  std::vector<StateEntry> entries_;
  size_t width_ = 0;
};

}  // namespace

/// Micro-batches whose networks have batch norm change them, and take turns; so do a GPU's.
bool Stage::side_by_side() const {
  return buffers_change_ && !*buffers_change_ && device_ == Device{} && threads() > 1;
}

Differentiated Stage::parts(const std::function<Differentiated(const MicroBatch&)>& compute) {
  if (micro_batches_ == 1) return compute({});
  const std::vector<StateEntry> all = state();
  std::map<Tensor*, Tensor> before, began;  // what buffers are, and copies that a micro-batch gets
  for (const StateEntry& entry : all)
    if (entry.parameter == nullptr) before[entry.value] = *entry.value;
  const auto belongs = [&](const StateEntry& entry, const Gradients& gradients) {
    if (entry.parameter != nullptr) return gradients.find(entry.parameter->id) != nullptr;
    const Tensor &now = *entry.value, &then = began[entry.value];
    return now.address() != then.address() || now.version() != then.version();
  };
  std::optional<Row> row;
  std::unique_ptr<Team::Sum> sum;
  std::vector<std::vector<double>> mine;
  const auto give = [&](const Differentiated& d) {
    if (!row) {
      std::vector<StateEntry> those;
      std::copy_if(all.begin(), all.end(), std::back_inserter(those),
                   [&](const StateEntry& entry) { return belongs(entry, d.gradients); });
      row.emplace(std::move(those));
      sum = team_->sum(row->width());
      buffers_change_ = buffers_change_.value_or(false) || row->has_buffers();
    }
    sum->give(row->of(d.gradients));
    mine.push_back(d.values);
    mine.back().push_back(d.loss);
  };
  const auto number = [&](int64_t k) {
    return MicroBatch{team_->rank() + k * team_->size(), micro_batches_};
  };
  const int64_t own = micro_batches_ / team_->size();
  if (side_by_side()) {
    for (const auto& [buffer, value] : before) began[buffer] = value;  // nobody changes them
    const int64_t at_once = std::min<int64_t>(own, threads());
    for (int64_t from = 0; from < own; from += at_once) {  // gradients travel in the meantime
      std::vector<Differentiated> done(static_cast<size_t>(std::min(at_once, own - from)));
      in_groups(std::ssize(done), threads(),
                [&](int64_t k) { done[static_cast<size_t>(k)] = compute(number(from + k)); });
      for (const Differentiated& d : done) give(d);
    }
  } else {
    for (int64_t k = 0; k < own; ++k) {
      for (const auto& [buffer, value] : before) *buffer = began[buffer] = value.clone();
      give(compute(number(k)));
    }
  }
  const double share = 1.0 / static_cast<double>(micro_batches_);
  Differentiated out;
  std::vector<float> total = sum->total();
  for (float& x : total) x *= static_cast<float>(share);
  row->spread(total, &out.gradients);
  out.norm = out.gradients.norm();
  for (const auto& values : team_->all(mine)) {  // in order
    out.values.resize(values.size());
    for (size_t i = 0; i < values.size(); ++i) out.values[i] += share * values[i];
  }
  out.loss = out.values.back();
  out.values.pop_back();
  return out;
}

Differentiated differentiate(const RngKey& key, const std::function<Var(Context&)>& loss) {
  const auto run = [&] {
    Tape tape;
    Context ctx{&tape, true, key};
    const Var value = loss(ctx);
    Differentiated out;
    out.gradients = tape.backward(value);
    out.loss = value.value.cpu().item();
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
