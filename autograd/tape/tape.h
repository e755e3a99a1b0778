// The reverse-mode tape. Values are computed eagerly; an op is recorded only if one of its inputs
// lives on a tape, so inference, which has no tape, records nothing. The tape is a vector in order
// of execution: backward walks it in reverse and frees the nodes that it passes.
#pragma once

#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "autograd/base/error.h"
#include "autograd/base/inline_vector.h"
#include "autograd/base/module_path.h"
#include "autograd/tensor/tensor.h"

namespace restage {

class Tape;

/// Whether a tape is still there: the tape and all values on it share one. Null at the tape's end.
using TapeLink = std::shared_ptr<Tape*>;

/// A value and, if it depends on something differentiable, its place on a tape. A value may outlive
/// its tape: its numbers stay readable, and to compute with it is an Error (detach() makes a
/// constant of it).
struct Var {
  Tensor value;
  TapeLink link;  ///< null: a constant
  int64_t node = -1;

  Var() = default;
  Var(Tensor v) : value(std::move(v)) {}  // NOLINT: a tensor is a constant Var
  const Shape& shape() const { return value.shape(); }
  int64_t size(int axis) const { return value.size(axis); }
  int rank() const { return value.rank(); }
  DType dtype() const { return value.dtype(); }
  bool on_tape() const { return link != nullptr; }
  /// The tape of a value that is on one; null for a constant. Error if the tape is gone.
  Tape* tape() const;
  /// The same value as a constant.
  Var detach() const { return Var(value); }
};

inline constexpr size_t kMaxInputs = 16;  ///< most inputs, and results, of an op
using Inputs = std::span<const Tensor>;
/// Results of an op that has several, as tensors and as values.
using Tensors = InlineVector<Tensor, kMaxInputs>;
using Vars = InlineVector<Var, kMaxInputs>;
/// One gradient per input, of the input's shape and dtype; undefined only where it is not needed.
/// (Something that has no gradient, such as the index of gather, is a member of the op and not an
/// input.)
using Grads = std::vector<Tensor>;
/// needs[i]: whether the gradient of input i is wanted.
using Needs = std::span<const bool>;

/// What is kept of a call for its backward pass: shapes and dtypes of the inputs in any case, and
/// the tensors that the op keeps. Nothing is kept if there will be no backward pass.
class Saved {
 public:
  Saved() = default;  ///< there will be no backward pass
  Saved(Inputs inputs, Needs needs);
  bool on() const { return !inputs_.empty(); }
  /// Whether the gradient of this input will be asked for.
  bool needs(size_t input) const { return on() && inputs_[input].needed; }
  const Shape& shape(size_t input) const { return inputs_[input].shape; }
  DType dtype(size_t input) const { return inputs_[input].dtype; }

  /// Keeps tensors that are complete: if one is changed before the backward pass, that pass is an
  /// Error. An op whose gradient needs shapes only keeps none.
  void keep(std::initializer_list<Tensor> tensors) {
    if (on()) keep_all(tensors);  // nothing is taken from the heap where nothing is kept
  }
  /// The same of any number of tensors.
  void keep_all(std::vector<Tensor> tensors);
  const Tensor& operator[](size_t i) const { return tensors_[i]; }
  const std::vector<Tensor>& tensors() const { return tensors_; }
  /// Whether none of the kept tensors was written to since.
  bool intact() const;

 private:
  struct Input {
    Shape shape;
    DType dtype;
    bool needed;
  };
  std::vector<Input> inputs_;
  std::vector<Tensor> tensors_;
  std::vector<uint64_t> versions_;
};

/// Result of backward: a value, not a field of the parameters, so that two players of one game
/// (generator, discriminator) cannot mix their gradients.
class Gradients {
 public:
  size_t size() const { return by_id_.size(); }  ///< leaves that took part
  /// Gradient of a leaf with this identity (Parameter::id), or null if it did not take part.
  const Tensor* find(uint64_t id) const;
  /// Gradient of a value that Tape::keep_gradient() named, or null.
  const Tensor* find(const Var& inner) const;
  void set_tape(TapeLink link) { link_ = std::move(link); }
  void set_inner(int64_t node, Tensor gradient) { inner_[node] = std::move(gradient); }
  void set(uint64_t id, Tensor gradient) { by_id_[id] = {std::move(gradient), {}, 0}; }
  /// Euclidean norm over these leaves, in double, summed in the order given; a leaf without a
  /// gradient adds nothing. The part of each leaf is computed once, unless it is written to.
  double norm(std::span<const uint64_t> ids) const;
  /// Euclidean norm over all leaves, in the order of their identities.
  double norm() const;
  bool finite() const;

 private:
  struct Leaf {
    Tensor gradient;
    mutable std::optional<double> squares;  // the sum of its squares
    mutable uint64_t version = 0;           // of the gradient that these are of
  };
  void measure(std::span<const uint64_t> ids) const;
  std::unordered_map<uint64_t, Leaf> by_id_;
  std::unordered_map<int64_t, Tensor> inner_;  // by node of link_; in no norm
  TapeLink link_;
};

class Tape {
 public:
  Tape() : link_(std::make_shared<Tape*>(this)) {}
  ~Tape() { *link_ = nullptr; }
  Tape(const Tape&) = delete;
  Tape& operator=(const Tape&) = delete;

  /// A differentiable leaf. The same id always gives the same node.
  Var leaf(const Tensor& value, uint64_t id);
  /// Gradients of all leaves of a scalar. Consumes the recorded ops, also when it ends with an
  /// error: values recorded before are stale afterwards, and using one with this tape again is an
  /// Error. It is also an Error if the gradients of an op have not the number, shapes and dtypes of
  /// its inputs, or if a tensor that an op keeps was changed since.
  Gradients backward(const Var& loss);
  /// The same of a value of any shape, whose own gradient is given (a vector-Jacobian product).
  Gradients backward(const Var& y, const Tensor& gradient);
  /// Has the next backward pass give the gradient of a value between the leaves and the loss, too
  /// (PyTorch's retain_grad): Gradients::find(v).
  void keep_gradient(const Var& v);
  size_t size() const { return nodes_.size(); }
  /// What node i is: an op by its name, "leaf", or "another result" of the op before it.
  const char* name(size_t i) const { return nodes_[i].name(); }
  /// What node i keeps for the backward pass; null for a leaf.
  const Saved* saved(size_t i) const {
    return nodes_[i].function ? &nodes_[i].function->saved() : nullptr;
  }

  struct Function {
    virtual ~Function() = default;
    /// From a gradient for each result; undefined are those of results that the loss does not
    /// depend on, but never all of them.
    virtual Grads backward(std::span<const Tensor> gy, Needs needs) const = 0;
    /// Adds the gradient of the only input to what there is of it, where that takes less than to
    /// make it; false: it does not.
    virtual bool add_to(Tensor& /*total*/, const Tensor& /*gy*/) const { return false; }
    virtual const char* name() const = 0;
    virtual const Saved& saved() const = 0;
  };
  /// Used by call(): enters an op with its result, or with its results.
  Var record(std::unique_ptr<Function> function, std::span<const Var> inputs, Tensor result);
  Vars record(std::unique_ptr<Function> function, std::span<const Var> inputs,
              const Tensors& results);

 private:
  /// A leaf, or an op with its first result. An op's other results have nodes behind that one.
  struct Node {
    std::unique_ptr<Function> function;  // null: a leaf, or another result
    std::vector<int64_t> inputs;         // node of each input, -1: constant
    uint64_t id = 0;                     // of a leaf
    std::string path;
    size_t results = 1;  // 0: another result
    const char* name() const {
      return function ? function->name() : results == 1 ? "leaf" : "another result";
    }
    Grads backward(std::span<const Tensor> gy) const;
  };
  void require_own(const Var& v) const;
  int64_t enter(std::unique_ptr<Function> function, std::span<const Var> inputs, size_t results);
  Var value_at(int64_t node, Tensor value) const;

  TapeLink link_;
  std::vector<Node> nodes_;
  int64_t first_ = 0;  // number of nodes_[0]; grows with every backward, so stale values show
  std::unordered_map<uint64_t, int64_t> leaves_;
  std::vector<int64_t> kept_;  // nodes whose gradients are wanted
};

/// While an object lives, every result of every op is checked for NaN and infinity. This is slow:
/// the trainer repeats a failed step in this way to name the op and module where the value
/// appeared.
class FiniteCheck {
 public:
  FiniteCheck();
  ~FiniteCheck();
  FiniteCheck(const FiniteCheck&) = delete;
  FiniteCheck& operator=(const FiniteCheck&) = delete;
  static bool active();
};

/// NonFiniteError naming `op` and the module path if t holds NaN or infinity.
void require_finite(const Tensor& t, const char* op, const std::string& path, const char* pass);
/// Throws ShapeError: "op: [letters] message; got shapes; in module path".
[[noreturn]] void shape_error(const char* op, const char* letters, Inputs inputs,
                              const std::string& why);
/// Throws ShapeError: an op was given more than kMaxInputs.
[[noreturn]] void too_many_inputs(const char* op, const char* letters, std::span<const Var> inputs);
/// ShapeError unless all inputs have the same floating dtype.
void require_floats(const char* op, const char* letters, Inputs inputs);
/// Error naming the op that runs and both devices, unless all tensors that are defined live on one
/// device.
void require_one_device(Inputs tensors);

namespace detail {

template <class Op>
struct Recorded final : Tape::Function {
  Recorded(Op o, Saved s) : op(std::move(o)), kept(std::move(s)) {}
  Grads backward(std::span<const Tensor> gy, Needs needs) const override {
    if constexpr (requires { op.backward(kept, gy, needs); }) {
      return op.backward(kept, gy, needs);
    } else {
      return op.backward(kept, gy[0], needs);
    }
  }
  bool add_to(Tensor& total, const Tensor& gy) const override {
    if constexpr (requires { op.add_to(total, gy); }) {
      if (total.shared()) total = total.clone();
      op.add_to(total, gy);
      return true;
    }
    return false;
  }
  const char* name() const override { return Op::name; }
  const Saved& saved() const override { return kept; }
  Op op;
  Saved kept;
};

inline void require_finite_result(const Tensor& y, const char* op) {
  require_finite(y, op, module_path(), "forward");
}
inline void require_finite_result(const Tensors& results, const char* op) {
  for (const Tensor& y : results) require_finite_result(y, op);
}
inline Var constant(Tensor y) { return Var(std::move(y)); }
inline Vars constant(const Tensors& results) {
  Vars out;
  for (const Tensor& y : results) out.push_back(Var(y));
  return out;
}

}  // namespace detail

/// Runs an op: checks, computes, records. The only door through which ops are called: a Var. An op
/// is a struct with: `static constexpr const char* name`, `letters` (its dimension letters, for
/// messages), `void check(Inputs) const` (throws through shape_error), `Tensor forward(Inputs,
/// Saved&) const`, `Grads backward(const Saved&, const Tensor& gy, Needs) const`. Of an op with
/// several results (call() gives Vars) forward() gives Tensors, and backward() takes a
/// `std::span<const Tensor> gy` as Tape::Function does. An op that keeps
/// nothing and whose gradient is mostly zeros may have `void add_to(Tensor& total, const Tensor&
/// gy) const`, which adds the gradient of its only input to `total`.
template <class Op>
auto call(const Op& op, std::span<const Var> inputs) {
  if (inputs.size() > kMaxInputs) too_many_inputs(Op::name, Op::letters, inputs);
  const OpScope running(Op::name);
  InlineVector<Tensor, kMaxInputs> values;
  InlineVector<bool, kMaxInputs> needs;
  Tape* tape = nullptr;
  for (const Var& v : inputs) {
    values.push_back(v.value);
    needs.push_back(v.on_tape());
    if (v.on_tape()) tape = v.tape();
  }
  const Inputs in(values.data(), values.size());
  require_one_device(in);
  op.check(in);
  Saved saved = tape ? Saved(in, Needs(needs.data(), needs.size())) : Saved();
  auto y = op.forward(in, saved);
  if (FiniteCheck::active()) detail::require_finite_result(y, Op::name);
  if (tape == nullptr) return detail::constant(std::move(y));
  return tape->record(std::make_unique<detail::Recorded<Op>>(op, std::move(saved)), inputs,
                      std::move(y));
}

template <class Op>
auto call(const Op& op, std::initializer_list<Var> inputs) {
  return call(op, std::span<const Var>(inputs.begin(), inputs.size()));
}

}  // namespace restage
