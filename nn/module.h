// Parameters and modules. A module is a plain struct whose members are parameters, buffers and
// modules; visit() names them once, and counting, initialising, saving, loading and optimising
// follow from visit(). Names are PyTorch's state-dict names.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "autograd/base/rng.h"
#include "autograd/tape/tape.h"

namespace restage {

/// A trainable tensor. Gradients are found by its identity (Gradients::find).
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

/// What a forward pass needs besides its inputs. It is passed down and never global.
struct Context {
  Tape* tape = nullptr;   ///< null: nothing is recorded
  bool training = false;  ///< dropout on, batch statistics in batch norm
  RngKey rng;             ///< the key of everything random in this step
  uint64_t masks = 0;     ///< dropout masks drawn so far
  bool frozen = false;    ///< parameters are constants (Frozen)

  /// The parameter as a value: a leaf of the tape, or a constant without a tape or where parameters
  /// are frozen.
  Var bind(const Parameter& p) const {
    return tape && !frozen ? tape->leaf(p.value, p.id) : Var(p.value);
  }
  /// The key of the next dropout mask: a function of `rng` and of how many masks came before, so no
  /// two masks of a step are equal. The order of the calls must be fixed by the source, so two
  /// layers with dropout must not be called within one expression.
  RngKey next_mask() { return rng.fold("dropout").fold(masks++); }
};

/// While an object lives, parameters that `ctx` binds are constants: gradients go through a module
/// to its inputs, and none are computed for its parameters. Batch norm behaves as ever.
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
  /// A short name of the kind of module for tables of layers, such as "Linear".
  virtual const char* kind() const = 0;
  /// Whether a training pass changes buffers of this module, as batch norm changes its running
  /// averages.
  virtual bool changes_buffers() const { return false; }
  std::string scope;  ///< name within the parent, set by name_scopes(); for error messages
};

/// One entry of a state dict.
struct StateEntry {
  std::string name;  ///< "backbone.fc1.0.weight"
  Tensor* value;
  Parameter* parameter;  ///< null: a buffer
  std::string module;    ///< path of the owning module, "backbone.fc1.0"
  const char* kind;      ///< kind of the owning module
  bool changes;  ///< a buffer: whether a training pass changes it (Module::changes_buffers())
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
/// The device of the parameters and buffers of a module; the CPU if the module has none.
Device device_of(Module& module);

/// How the weights of linear maps begin. `pytorch`: uniform in +-1/sqrt(inputs), as do biases (spec
/// 7). `normal`: a normal distribution of deviation 0.02, biases as PyTorch's (NPT, AniFormer).
/// `xavier`: a normal distribution of deviation 0.02 sqrt(2 / (inputs + outputs)), biases 0
/// (3D-CoreNet).
enum class Start { pytorch, normal, xavier };

/// Where the numbers of a new network come from: named streams of a key.
struct Init {
  RngKey key;
  DType type = DType::f32;
  /// How many more numbers the parameters of a network may hold, where a file says how large the
  /// network is (null: any number). So a damaged size in a file cannot ask for all memory.
  int64_t* budget = nullptr;
  Start start = Start::pytorch;
  /// InputError if the budget is spent.
  Tensor uniform(const Shape& shape, double bound, const std::string& name) const;
  /// Of a map from `in` to `out` channels, in the shape in which the map keeps them.
  Tensor weight(const Shape& shape, int64_t in, int64_t out) const;
  Tensor bias(int64_t in, int64_t out) const;
  Init sub(const std::string& name) const { return {key.fold(name), type, budget, start}; }
  /// With another start, if the network has one of its `own`.
  Init begun(bool own, Start how) const { return {key, type, budget, own ? how : Start::pytorch}; }
};

}  // namespace restage
