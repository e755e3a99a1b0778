#include "nn/checkpointed.h"

#include <utility>
#include <vector>

namespace restage {
namespace {

/// Keeps what a pass through the module changes, and puts it back.
class Buffers {
 public:
  explicit Buffers(Module& module) {
    for (const StateEntry& entry : state_of(module))
      if (entry.changes) kept_.emplace_back(entry.value, entry.value->clone());
  }
  void put_back() {
    for (auto& [buffer, before] : kept_) *buffer = before;
  }

 private:
  std::vector<std::pair<Tensor*, Tensor>> kept_;
};

/// The module's pass as one op, whose inputs are those of the module and then its parameters.
class Recomputed final : public Tape::Function {
 public:
  Recomputed(const Context& ctx, Module& module, std::span<const Var> inputs,
             std::vector<Parameter*> parameters, ModuleForward forward, Saved saved)
      : ctx_(ctx),
        module_(module),
        inputs_(inputs.size()),
        parameters_(std::move(parameters)),
        forward_(std::move(forward)),
        saved_(std::move(saved)) {}

  Grads backward(const Tensor& gy, Needs needs) const override {
    Buffers buffers(module_);
    Tape tape;
    Context ctx = ctx_;
    ctx.tape = &tape;
    std::vector<uint64_t> ids;
    std::vector<Var> inputs;
    for (size_t i = 0; i < inputs_; ++i) {
      ids.push_back(Parameter::next_id());
      inputs.push_back(needs[i] ? tape.leaf(saved_[i], ids[i]) : Var(saved_[i]));
    }
    for (const Parameter* p : parameters_) ids.push_back(p->id);
    const Var y = forward_(ctx, inputs);
    buffers.put_back();
    const Gradients g = y.on_tape() ? tape.backward(y, gy) : Gradients();
    require_known(g, ids);
    Grads out;
    for (size_t i = 0; i < ids.size(); ++i) {
      const Tensor* found = needs[i] ? g.find(ids[i]) : nullptr;
      out.push_back(found != nullptr || !needs[i]
                        ? (found != nullptr ? *found : Tensor())
                        : Tensor::zeros(saved_.shape(i), saved_.dtype(i), gy.device()));
    }
    return out;
  }
  const char* name() const override { return "checkpointed"; }
  const Saved& saved() const override { return saved_; }

 private:
  static void require_known(const Gradients& g, const std::vector<uint64_t>& ids) {
    size_t known = 0;
    for (const uint64_t id : ids) known += g.find(id) != nullptr ? 1 : 0;
    if (known != g.size())
      throw Error(
          "checkpointed: the pass uses parameters of another module; give the module "
          "that holds them all");
  }

  Context ctx_;  // as it was before the pass
  Module& module_;
  size_t inputs_;
  std::vector<Parameter*> parameters_;
  ModuleForward forward_;
  Saved saved_;
};

}  // namespace

Var checkpointed(Context& ctx, Module& module, std::span<const Var> inputs,
                 const ModuleForward& forward) {
  if (ctx.tape == nullptr) return forward(ctx, inputs);
  std::vector<Var> all(inputs.begin(), inputs.end());
  std::vector<Parameter*> parameters;
  if (!ctx.frozen) parameters = parameters_of(module);
  for (const Parameter* p : parameters) all.push_back(ctx.bind(*p));
  std::vector<Tensor> values;
  std::vector<Var> constants;
  bool recorded = false;
  auto needs = std::make_unique<bool[]>(all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    values.push_back(all[i].value);
    if (i < inputs.size()) constants.push_back(all[i].detach());
    needs[i] = all[i].on_tape();
    recorded = recorded || needs[i];
  }
  if (!recorded) return forward(ctx, inputs);
  Saved saved(values, Needs(needs.get(), all.size()));
  saved.keep_all(values);
  const Context before = ctx;
  Tape* tape = std::exchange(ctx.tape, nullptr);
  Tensor y = forward(ctx, constants).value;
  ctx.tape = tape;
  return tape->record(std::make_unique<Recomputed>(before, module, inputs, std::move(parameters),
                                                   forward, std::move(saved)),
                      all, std::move(y));
}

}  // namespace restage
