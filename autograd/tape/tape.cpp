#include "autograd/tape/tape.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/update.h"

namespace restage {
namespace {

thread_local std::string current_path;  // of ModuleScope
std::atomic<int> finite_checks{0};

}  // namespace

ModuleScope::ModuleScope(const std::string& name) : previous_(current_path.size()) {
  if (name.empty()) return;
  if (!current_path.empty()) current_path += '.';
  current_path += name;
}

ModuleScope::~ModuleScope() { current_path.resize(previous_); }

std::string module_path() { return current_path.empty() ? "(no module)" : current_path; }

FiniteCheck::FiniteCheck() { ++finite_checks; }
FiniteCheck::~FiniteCheck() { --finite_checks; }
bool FiniteCheck::active() { return finite_checks > 0; }

void require_finite(const Tensor& t, const char* op, const std::string& path, const char* pass) {
  if (!t.defined() || (t.dtype() != DType::f32 && t.dtype() != DType::f64)) return;
  Tensor found = Tensor::empty({1}, DType::i32);
  launch(NonFiniteArgs{t, found});
  if (found.item() != 0)
    throw NonFiniteError(std::string("a value became infinite or NaN in the ") + pass +
                         " pass of '" + op + "' in " + path);
}

void shape_error(const char* op, const char* letters, Inputs inputs, const std::string& why) {
  std::string shapes;
  for (const Tensor& t : inputs)
    shapes += (shapes.empty() ? "" : ", ") + (t.defined() ? t.shape().str() : std::string("none")) +
              (t.defined() ? std::string(" ") + name_of(t.dtype()) : "");
  throw ShapeError(std::string(op) + " " + letters + ": " + why + "; got " + shapes + " in " +
                   module_path());
}

void too_many_inputs(const char* op, const char* letters, std::span<const Var> inputs) {
  std::vector<Tensor> values;
  for (const Var& v : inputs) values.push_back(v.value);
  shape_error(op, letters, values, "an op has at most " + std::to_string(kMaxInputs) + " inputs");
}

void require_floats(const char* op, const char* letters, Inputs inputs) {
  for (const Tensor& t : inputs)
    if (t.dtype() != inputs[0].dtype() || (t.dtype() != DType::f32 && t.dtype() != DType::f64))
      shape_error(op, letters, inputs, "needs equal float dtypes");
}

const Tensor* Gradients::find(uint64_t id) const {
  const auto it = by_id_.find(id);
  return it == by_id_.end() ? nullptr : &it->second;
}

double Gradients::norm() const {
  if (norm_) return *norm_;
  std::vector<uint64_t> ids;
  for (const auto& entry : by_id_) ids.push_back(entry.first);
  std::sort(ids.begin(), ids.end());
  double total = 0;
  for (const uint64_t id : ids) {
    Tensor squares = Tensor::empty({1}, DType::f64);
    launch(SquaredNormArgs{by_id_.at(id), squares});
    total += squares.item();
  }
  norm_ = std::sqrt(total);
  return *norm_;
}

bool Gradients::finite() const { return std::isfinite(norm()); }

Var Tape::leaf(const Tensor& value, uint64_t id) {
  const auto [it, fresh] = leaves_.emplace(id, first_ + static_cast<int64_t>(nodes_.size()));
  if (fresh) {
    Node node;
    node.id = id;
    nodes_.push_back(std::move(node));
  }
  Var v(value);
  v.tape = this;
  v.node = it->second;
  return v;
}

void Tape::require_own(const Var& v) const {
  if (v.tape != this) throw Error("an op was given values of two tapes");
  if (v.node < first_)
    throw Error("a value is used after the backward pass that consumed its tape");
}

Var Tape::record(std::unique_ptr<Function> function, std::span<const Var> inputs, Tensor output) {
  Node node;
  node.function = std::move(function);
  node.path = module_path();
  for (const Var& in : inputs) {
    if (in.tape != nullptr) require_own(in);
    node.inputs.push_back(in.tape == this ? in.node : -1);
  }
  Var v(std::move(output));
  v.tape = this;
  v.node = first_ + static_cast<int64_t>(nodes_.size());
  nodes_.push_back(std::move(node));
  return v;
}

Gradients Tape::backward(const Var& loss) {
  if (loss.tape != this) throw Error("backward: the loss does not depend on anything of this tape");
  if (loss.value.numel() != 1)
    throw ShapeError("backward: the loss has shape " + loss.shape().str() + ", not one number");
  require_own(loss);
  std::vector<Tensor> grads(nodes_.size());
  const auto at = [this](int64_t node) { return static_cast<size_t>(node - first_); };
  grads[at(loss.node)] = Tensor::full(loss.shape(), 1.0, loss.dtype());
  Gradients result;
  for (size_t i = at(loss.node) + 1; i-- > 0;) {
    Node& node = nodes_[i];
    if (!grads[i].defined()) continue;
    if (node.function == nullptr) {
      result.set(node.id, grads[i]);
      continue;
    }
    std::array<bool, kMaxInputs> needs{};
    for (size_t k = 0; k < node.inputs.size(); ++k) needs[k] = node.inputs[k] >= 0;
    Grads gx = node.function->backward(grads[i], Needs(needs.data(), node.inputs.size()));
    for (size_t k = 0; k < node.inputs.size(); ++k) {
      if (node.inputs[k] < 0 || k >= gx.size() || !gx[k].defined()) continue;
      if (FiniteCheck::active())
        require_finite(gx[k], node.function->name(), node.path, "backward");
      Tensor& target = grads[at(node.inputs[k])];
      if (target.defined()) {
        Tensor total = target.clone();  // the first gradient may be shared with another node
        launch(AccumulateArgs{gx[k], total});
        target = total;
      } else {
        target = gx[k];
      }
    }
    node.function.reset();  // frees what the op had kept
    grads[i] = Tensor();
  }
  first_ += static_cast<int64_t>(nodes_.size());
  nodes_.clear();
  leaves_.clear();
  return result;
}

}  // namespace restage
