#include "train/stage.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "autograd/base/log.h"
#include "autograd/base/parallel.h"
#include "autograd/base/thread_groups.h"
#include "autograd/kernels/kernel.h"
#include "nn/models/own_training.h"
#include "train/gradient_watch.h"
#include "train/phases.h"

namespace restage {
namespace {

/// Copies from `from` the tensors whose names, after `prefix`, match one of `names`; notes in
/// `used` which of `names` matched.
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

/// A copy of a model in the host's memory, with the same weights.
TrainedModel copied(const TrainedModel& of) {
  TrainedModel out = of;
  out.net = make_model(of.model, of.config, Init{RngKey{}, DType::f32});
  load_state(*out.net, to_file(*of.net), "", of.model);
  return out;
}

/// Cloud number `number` of a tensor [..., v, 3].
Points points_of(const Tensor& x, int64_t number) {
  const int64_t v = x.size(-2);
  Points out;
  for (int64_t i = number * v; i < (number + 1) * v; ++i)
    out.emplace_back(Eigen::Map<const Point>(x.data<float>() + 3 * i));
  return out;
}

}  // namespace

Shown clouds_of(const std::string& label, const Tensor& x, const std::vector<int64_t>& numbers) {
  Shown out{label, {}};
  for (const int64_t number : numbers) out.clouds.push_back(points_of(x, number));
  return out;
}

Shown skeletons_of(const std::string& label, const Tensor& x, const std::vector<int64_t>& numbers) {
  Shown out{label, {}};
  for (const int64_t number : numbers) {
    const Points points = points_of(x, number);
    for (size_t j = 0; j < kJoints; ++j)
      (j == 0 ? out.skeletons.emplace_back() : out.skeletons.back())[j] = points[j].cast<double>();
  }
  return out;
}

std::vector<int64_t> spaced(int64_t n, int64_t first, int64_t every) {
  std::vector<int64_t> out;
  for (int64_t i = 0; i < n; ++i) out.push_back(first + i * every);
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
  optimisers_.push_back(
      {name, std::make_unique<Optimiser>(modules, config, name_ + ".optimiser.groups")});
  return optimisers_.back().optimiser.get();
}

OptimisedNumbers Stage::optimised() const {
  OptimisedNumbers out;
  for (const NamedOptimiser& o : optimisers_) {
    out.muon += o.optimiser->numbers().muon;
    out.adam += o.optimiser->numbers().adam;
    out.frozen += o.optimiser->numbers().frozen;
  }
  return out;
}

bool Stage::frozen(uint64_t id) const {
  return std::any_of(optimisers_.begin(), optimisers_.end(),
                     [id](const NamedOptimiser& o) { return o.optimiser->frozen(id); });
}

NamedValues Stage::measure() {
  NamedValues out = validate();
  const NamedValues measured = out;
  for (const Network& n : networks_)
    if (const auto* own = dynamic_cast<const OwnTraining*>(n.model.net.get()))
      for (auto& figure : own->measure(measured)) out.push_back(std::move(figure));
  return out;
}

std::vector<std::string> Stage::own_figures() const {
  std::vector<std::string> out;
  for (const Network& n : networks_)
    for (const std::string& figure : model_type(n.model.model).figures) out.push_back(figure);
  return out;
}

void Stage::save(TensorFile& file) const {
  for (const Network& n : networks_) append(&file, *n.model.net, prefix_of(n.role));
  for (const NamedOptimiser& o : optimisers_) o.optimiser->save(o.name + ".", file);
  if (noise_) noise_->save(&file);
  save_more(file);
}

void Stage::load(const TensorFile& file, const std::string& where) {
  for (const Network& n : networks_) load_state(*n.model.net, file, prefix_of(n.role), where);
  for (const NamedOptimiser& o : optimisers_) o.optimiser->load(o.name + ".", file, where);
  if (noise_) noise_->load(file, where);
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

bool Stage::may_draw_ahead() const { return backend(device_).works_later(); }

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

/// What a micro-batch leaves, as a row of numbers that is the same width for all micro-batches of
/// all processes: a flag for each optimised parameter and each buffer that passes change, then the
/// numbers of all of them. The flag of a parameter says whether it has a gradient (else its numbers
/// are zero), that of a buffer whether the micro-batch has changed it.
class Row {
 public:
  /// `optimised`: identities of parameters, ascending.
  Row(const std::vector<StateEntry>& state, const std::vector<uint64_t>& optimised) {
    for (const StateEntry& entry : state) {
      const Parameter* p = entry.parameter;
      if (p != nullptr && !std::binary_search(optimised.begin(), optimised.end(), p->id)) continue;
      const bool travels = p != nullptr || entry.changes;
      (travels ? entries_ : constants_).push_back({entry, *entry.value, *entry.value});
      if (travels) width_ += 1 + static_cast<size_t>(entry.value->numel());
    }
  }
  size_t width() const { return width_; }
  /// Whether micro-batches can be computed at once: no pass changes a buffer that all of them use.
  bool can_share() const {
    return std::none_of(entries_.begin(), entries_.end(),
                        [](const Entry& e) { return e.is_buffer(); });
  }

  /// Gives a micro-batch copies of the buffers as they were before the step.
  void begin() {
    for (Entry& e : entries_)
      if (e.is_buffer()) *e.state.value = e.begun = e.before.clone();
  }
  /// Error if a micro-batch has changed a buffer that does not travel.
  void require_unchanged() const {
    for (const Entry& e : constants_)
      if (e.changed())
        throw Error("micro-batches have changed the buffer '" + e.state.name +
                    "'; its module must say so (Module::changes_buffers)");
  }

  std::vector<float> of(const Gradients& gradients) const {
    std::vector<float> out(width_, 0.0f);
    size_t flag = 0, at = entries_.size(), found = 0;
    for (const Entry& e : entries_) {
      const Tensor* t = e.is_buffer() ? e.state.value : gradients.find(e.state.parameter->id);
      const bool takes_part = e.is_buffer() ? e.changed() : t != nullptr;
      out[flag++] = takes_part ? 1.0f : 0.0f;
      if (t != nullptr) {
        const Tensor here = t->cpu();
        std::copy_n(here.data<float>(), here.numel(),
                    out.begin() + static_cast<std::ptrdiff_t>(at));
        found += e.is_buffer() ? 0 : 1;
      }
      at += static_cast<size_t>(e.before.numel());
    }
    if (found != gradients.size())
      throw Error("a micro-batch gives gradients of " + std::to_string(gradients.size() - found) +
                  " parameters that the step's optimiser does not hold");
    return out;
  }

  /// What the sum of the rows of `rows` micro-batches means: means of buffers go to where the
  /// buffers are, means of gradients into `gradients`.
  void spread(const std::vector<float>& sum, int64_t rows, Gradients* gradients) const {
    const auto share = static_cast<float>(1.0 / static_cast<double>(rows));
    size_t flag = 0, at = entries_.size();
    for (const Entry& e : entries_) {
      const float* from = sum.data() + at;
      at += static_cast<size_t>(e.before.numel());
      if (sum[flag++] == 0) {
        if (e.is_buffer()) *e.state.value = e.before;
        continue;
      }
      Tensor mean = Tensor::empty(e.before.shape());
      for (int64_t i = 0; i < mean.numel(); ++i) mean.data<float>()[i] = from[i] * share;
      mean = mean.to(e.before.device());
      if (e.is_buffer())
        *e.state.value = mean;
      else
        gradients->set(e.state.parameter->id, mean);
    }
  }

 private:
  struct Entry {
    StateEntry state;
    Tensor before;  ///< its value before the step
    Tensor begun;   ///< a buffer: what the micro-batch began with
    bool is_buffer() const { return state.parameter == nullptr; }
    bool changed() const {
      return state.value->address() != begun.address() || state.value->version() != begun.version();
    }
  };
  std::vector<Entry> entries_;    ///< of a row
  std::vector<Entry> constants_;  ///< the other buffers
  size_t width_ = 0;
};

}  // namespace

void Stage::measure_noise() {
  if (micro_batches_ < 2)
    throw InputError("loop.gradient_noise", "needs steps of several micro-batches",
                     "set loop.micro_batches to 2 or more, or leave it out");
  noise_.emplace(examples_per_step(), micro_batches_);
}

NamedValues Stage::noise() const { return noise_ ? noise_->values() : NamedValues{}; }

Differentiated Stage::parts(const Optimiser& optimiser,
                            const std::function<Differentiated(const MicroBatch&)>& compute) {
  Differentiated out = micro_batches_ == 1 ? compute({}) : summed(optimiser, compute);
  if (watch_ != nullptr) watch_->look(&optimiser, out.gradients, out.norm);
  return out;
}

Differentiated Stage::summed(const Optimiser& optimiser,
                             const std::function<Differentiated(const MicroBatch&)>& compute) {
  Row row(state(), optimiser.parameters());
  const std::unique_ptr<Team::Sum> sum = team_->sum(row.width());
  const bool noisy = noise_ && &optimiser == optimisers_.front().optimiser.get();
  std::vector<std::vector<double>> mine;
  const auto give = [&](const Differentiated& d) {
    sum->give(row.of(d.gradients));
    mine.push_back(d.values);
    if (noisy) mine.back().push_back(std::pow(d.gradients.norm(optimiser.parameters()), 2));
    mine.back().push_back(d.loss);
  };
  const auto number = [&](int64_t k) {
    return MicroBatch{team_->rank() + k * team_->size(), micro_batches_};
  };
  const int64_t own = micro_batches_ / team_->size();
  if (device_ == Device{} && row.can_share()) {
    const int64_t at_once = std::min<int64_t>(own, threads());
    // Gradients of the last few travel in the meantime.
    for (int64_t from = 0; from < own; from += at_once) {
      std::vector<Differentiated> done(static_cast<size_t>(std::min(at_once, own - from)));
      in_groups(std::ssize(done), threads(),
                [&](int64_t k) { done[static_cast<size_t>(k)] = compute(number(from + k)); });
      for (const Differentiated& d : done) give(d);
    }
  } else {  // a GPU also computes micro-batches one after the other
    for (int64_t k = 0; k < own; ++k) {
      row.begin();
      give(compute(number(k)));
    }
  }
  row.require_unchanged();
  Differentiated out;
  row.spread(sum->total(), micro_batches_, &out.gradients);
  out.norm = out.gradients.norm();
  const double share = 1.0 / static_cast<double>(micro_batches_);
  for (const auto& values : team_->all(mine)) {  // in order
    out.values.resize(values.size());
    for (size_t i = 0; i < values.size(); ++i) out.values[i] += share * values[i];
  }
  out.loss = out.values.back();
  out.values.pop_back();
  if (noisy) {
    noise_->add(out.values.back(), std::pow(out.gradients.norm(optimiser.parameters()), 2));
    out.values.pop_back();
  }
  return out;
}

Differentiated differentiate(const RngKey& key, const std::function<Var(Context&)>& loss) {
  const auto run = [&] {
    Tape tape;
    Context ctx{&tape, true, key};
    const Var value = [&] {
      const PhaseScope phase(Phase::forward);
      return loss(ctx);
    }();
    const PhaseScope phase(Phase::backward);
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
