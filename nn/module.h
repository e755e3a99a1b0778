// Parameters and modules. A module is a plain struct whose members are parameters, buffers and
// modules; visit() names them once, and counting, initialising, saving, loading and optimising all
// follow from it. Names are PyTorch's state-dict names.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "autograd/base/rng.h"
#include "autograd/tape/tape.h"

namespace restage {

/// A trainable tensor. Its identity ties gradients to it (Gradients::find).
struct Parameter {
  Tensor value;
  uint64_t id = next_id();
  static uint64_t next_id();
  Parameter() = default;
  explicit Parameter(Tensor v) : value(std::move(v)) {}
  Parameter(const Parameter&) = delete;  // two parameters never share an identity
  Parameter& operator=(const Parameter&) = delete;
};

struct Module;

/// Receives the members of a module, in PyTorch's order.
class Fields {
 public:
  virtual ~Fields() = default;
  virtual void operator()(const std::string& name, Parameter& parameter) = 0;
  virtual void operator()(const std::string& name, Tensor& buffer) = 0;
  virtual void operator()(const std::string& name, Module& child) = 0;
};

/// What a forward pass needs besides its inputs; passed down, never global.
struct Context {
  Tape* tape = nullptr;   ///< null: nothing is recorded
  bool training = false;  ///< dropout on, batch statistics in batch norm
  RngKey rng;             ///< of this step
  uint64_t masks = 0;     ///< dropout masks drawn so far
  bool frozen = false;    ///< parameters are constants (Frozen)

  /// The parameter as a value: a leaf of the tape, or a constant where it has no gradient.
  Var bind(const Parameter& p) const {
    return tape && !frozen ? tape->leaf(p.value, p.id) : Var(p.value);
  }
  /// Stream of the next dropout mask: a function of `rng` and of how many came before, so no two of
  /// a step are equal. Calls follow each other in an order that the source fixes: two layers that
  /// drop must not be called within one expression.
  RngKey next_mask() { return rng.fold("dropout").fold(masks++); }
};

/// While it lives, parameters that `ctx` binds are constants: gradients go through a module to its
/// inputs and cost nothing for what it holds. Batch norm behaves as ever.
class Frozen {
 public:
  explicit Frozen(Context& ctx) : ctx_(ctx), before_(ctx.frozen) { ctx.frozen = true; }
  ~Frozen() { ctx_.frozen = before_; }
  Frozen(const Frozen&) = delete;
  Frozen& operator=(const Frozen&) = delete;

 private:
  Context& ctx_;
  bool before_;
};

struct Module {
  Module() = default;
  virtual ~Module() = default;
  Module(const Module&) = delete;
  Module& operator=(const Module&) = delete;
  virtual void visit(Fields& fields) = 0;
  /// Short kind for layer tables, e.g. "Linear".
  virtual const char* kind() const = 0;
  /// Whether a training pass changes buffers of the module's own, as batch norm does its averages.
  virtual bool changes_buffers() const { return false; }
  std::string scope;  ///< name within the parent, set by name_scopes(); for error messages
};

/// One entry of a state dict.
struct StateEntry {
  std::string name;  ///< "backbone.fc1.0.weight"
  Tensor* value;
  Parameter* parameter;  ///< null: a buffer
  std::string module;    ///< path of the owning module, "backbone.fc1.0"
  const char* kind;      ///< its kind
  bool changes;          ///< whether a training pass changes it: Module::changes_buffers()
};
/// All parameters and buffers, depth first in declaration order, names joined with dots.
std::vector<StateEntry> state_of(Module& module, const std::string& prefix = "");
std::vector<Parameter*> parameters_of(Module& module);
int64_t count_parameters(Module& module);
/// Gives every module below `root` its scope name; model factories call it once.
void name_scopes(Module& root, const std::string& name);
/// Casts every parameter and buffer.
void cast_module(Module& module, DType type);
/// Takes every parameter and buffer to a device.
void move_module(Module& module, Device device);
/// Where they are; the CPU's of a module that has none.
Device device_of(Module& module);

/// PyTorch's default start: uniform in +-1/sqrt(fan_in) (spec 7), from a named stream.
struct Init {
  RngKey key;
  DType type = DType::f32;
  /// How many numbers a network may still take, where a file says how large it is to be (null: as
  /// many as it likes). So a damaged size cannot ask for all memory.
  int64_t* budget = nullptr;
  /// InputError if the budget is spent.
  Tensor uniform(const Shape& shape, double bound, const std::string& name) const;
  Init sub(const std::string& name) const { return {key.fold(name), type, budget}; }
};

}  // namespace restage
