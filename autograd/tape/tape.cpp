#include "autograd/tape/tape.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "autograd/base/op_watch.h"
#include "autograd/base/words.h"
#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/update.h"

namespace restage {
namespace {

std::atomic<int> finite_checks{0};

std::string text_of(const Tensor& t) {
  return t.defined() ? t.shape().str() + " " + name_of(t.dtype()) : "none";
}

/// The same numbers where whoever writes changes nothing of others: nodes may share a gradient.
Tensor to_write(Tensor gradient) { return gradient.shared() ? gradient.clone() : gradient; }

/// total += gradient; an undefined total is none yet.
void accumulate(Tensor& total, Tensor gradient) {
  if (!total.defined()) {
    total = std::move(gradient);
  } else {
    total = to_write(std::move(total));
    launch(AccumulateArgs{gradient, total});
  }
}

}  // namespace

FiniteCheck::FiniteCheck() { ++finite_checks; }
FiniteCheck::~FiniteCheck() { --finite_checks; }
bool FiniteCheck::active() { return finite_checks > 0; }

void require_finite(const Tensor& t, const char* op, const std::string& path, const char* pass) {
  if (!t.defined() || (t.dtype() != DType::f32 && t.dtype() != DType::f64)) return;
  if (!all_finite(t))
    throw NonFiniteError(std::string("a value became infinite or NaN in the ") + pass +
                         " pass of '" + op + "' in " + path);
}

void shape_error(const char* op, const char* letters, Inputs inputs, const std::string& why) {
  throw ShapeError(std::string(op) + " " + letters + ": " + why + "; got " +
                   joined(inputs, text_of) + " in " + module_path());
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

void require_one_device(Inputs tensors) {
  const Tensor* first = nullptr;
  for (const Tensor& t : tensors) {
    if (!t.defined()) continue;
    if (first != nullptr && t.device() != first->device())
      throw Error(running_op() + " is given tensors of two devices, " + name_of(first->device()) +
                  " and " + name_of(t.device()) + "; take to() of one of them first");
    first = &t;
  }
}

Saved::Saved(Inputs inputs, Needs needs) {
  inputs_.reserve(inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i)
    inputs_.push_back({inputs[i].shape(), inputs[i].dtype(), needs[i]});
}

void Saved::keep_all(std::vector<Tensor> tensors) {
  if (!on()) return;
  tensors_ = std::move(tensors);
  versions_.clear();
  for (const Tensor& t : tensors_) versions_.push_back(t.version());
}

bool Saved::intact() const {
  for (size_t i = 0; i < tensors_.size(); ++i)
    if (tensors_[i].version() != versions_[i]) return false;
  return true;
}

const Tensor* Gradients::find(uint64_t id) const {
  const auto it = by_id_.find(id);
  return it == by_id_.end() ? nullptr : &it->second.gradient;
}

const Tensor* Gradients::find(const Var& inner) const {
  const auto it = inner_.find(inner.node);
  return inner.link != link_ || it == inner_.end() ? nullptr : &it->second;
}

/// Computes the sums of squares that are not known yet, and waits for them once.
void Gradients::measure(std::span<const uint64_t> ids) const {
  std::vector<const Leaf*> open;
  for (const uint64_t id : ids) {
    const auto it = by_id_.find(id);
    if (it == by_id_.end()) continue;
    const Leaf& leaf = it->second;
    if (!leaf.squares || leaf.version != leaf.gradient.version()) open.push_back(&leaf);
  }
  if (open.empty()) return;
  std::vector<Tensor> gradients;
  for (const Leaf* leaf : open) gradients.push_back(leaf->gradient);
  Tensor sums = Tensor::empty({std::ssize(open)}, DType::f64, gradients.front().device());
  launch(SquaredNormArgs{gradients, sums});
  const Tensor known = sums.cpu();
  for (size_t i = 0; i < open.size(); ++i) {
    open[i]->squares = known.item(static_cast<int64_t>(i));
    open[i]->version = open[i]->gradient.version();
  }
}

double Gradients::norm(std::span<const uint64_t> ids) const {
  measure(ids);
  double total = 0;
  for (const uint64_t id : ids) {
    const auto it = by_id_.find(id);
    if (it != by_id_.end()) total += *it->second.squares;
  }
  return std::sqrt(total);
}

double Gradients::norm() const {
  std::vector<uint64_t> ids;
  for (const auto& entry : by_id_) ids.push_back(entry.first);
  std::sort(ids.begin(), ids.end());
  return norm(ids);
}

bool Gradients::finite() const { return std::isfinite(norm()); }

Tape* Var::tape() const {
  if (link != nullptr && *link == nullptr)
    throw Error("a value is used after the end of its tape (" + running_op() +
                "); keep the tape, or take detach() of the value");
  return link == nullptr ? nullptr : *link;
}

Var Tape::leaf(const Tensor& value, uint64_t id) {
  const auto [it, fresh] = leaves_.emplace(id, first_ + static_cast<int64_t>(nodes_.size()));
  if (fresh) {
    Node node;
    node.id = id;
    nodes_.push_back(std::move(node));
  }
  return value_at(it->second, value);
}

void Tape::require_own(const Var& v) const {
  if (v.tape() != this) throw Error("an op was given values of two tapes");
  if (v.node < first_)
    throw Error("a value is used after the backward pass that consumed its tape");
}

int64_t Tape::enter(std::unique_ptr<Function> function, std::span<const Var> inputs,
                    size_t results) {
  Node node;
  node.function = std::move(function);
  node.path = module_path();
  for (const Var& in : inputs) {
    if (in.on_tape()) require_own(in);
    node.inputs.push_back(in.on_tape() ? in.node : -1);
  }
  node.results = results;
  const auto number = first_ + static_cast<int64_t>(nodes_.size());
  nodes_.push_back(std::move(node));
  for (size_t i = 1; i < results; ++i) nodes_.emplace_back().results = 0;
  return number;
}

Var Tape::value_at(int64_t node, Tensor value) const {
  Var v(std::move(value));
  v.link = link_;
  v.node = node;
  return v;
}

Var Tape::record(std::unique_ptr<Function> function, std::span<const Var> inputs, Tensor result) {
  return value_at(enter(std::move(function), inputs, 1), std::move(result));
}

Vars Tape::record(std::unique_ptr<Function> function, std::span<const Var> inputs,
                  const Tensors& results) {
  int64_t node = enter(std::move(function), inputs, results.size());
  Vars out;
  for (const Tensor& y : results) out.push_back(value_at(node++, y));
  return out;
}

/// The gradients of the op's inputs; checks what Grads promises.
Grads Tape::Node::backward(std::span<const Tensor> gy) const {
  const Saved& saved = function->saved();
  const auto fail = [this](const std::string& what) {
    throw Error(std::string("backward of '") + name() + "' in " + path + ": " + what);
  };
  if (!saved.intact())
    fail("a tensor that it keeps was changed after the forward pass; change a clone");
  InlineVector<bool, kMaxInputs> needs;
  for (const int64_t input : inputs) needs.push_back(input >= 0);
  Grads g = function->backward(gy, Needs(needs.data(), needs.size()));
  if (g.size() != inputs.size())
    fail("gave " + std::to_string(g.size()) + " gradients for " + std::to_string(inputs.size()) +
         " inputs");
  for (size_t k = 0; k < g.size(); ++k) {
    if (!needs[k] && !g[k].defined()) continue;
    if (!g[k].defined() || !(g[k].shape() == saved.shape(k)) || g[k].dtype() != saved.dtype(k))
      fail("the gradient of input " + std::to_string(k) + " is " + text_of(g[k]) +
           ", the input is " + saved.shape(k).str() + " " + name_of(saved.dtype(k)));
    if (FiniteCheck::active() && needs[k]) require_finite(g[k], name(), path, "backward");
  }
  return g;
}

Gradients Tape::backward(const Var& loss) {
  if (loss.tape() != this)
    throw Error("backward: the loss does not depend on anything of this tape");
  if (loss.value.numel() != 1)
    throw ShapeError("backward: the loss has shape " + loss.shape().str() + ", not one number");
  return backward(loss, Tensor::full(loss.shape(), 1.0, loss.dtype(), loss.value.device()));
}

void Tape::keep_gradient(const Var& v) {
  if (!v.on_tape()) throw Error("keep_gradient: the value is a constant");
  require_own(v);
  kept_.push_back(v.node);
}

Gradients Tape::backward(const Var& loss, const Tensor& gradient) {
  require_own(loss);
  if (!(gradient.shape() == loss.shape()) || gradient.dtype() != loss.dtype())
    throw ShapeError("backward: the value is " + text_of(loss.value) + ", its gradient " +
                     text_of(gradient));
  const int64_t first = first_;
  const auto at = [first](int64_t node) { return static_cast<size_t>(node - first); };
  // The nodes leave the tape before anything can fail, since a tape that is half consumed must not
  // be walked again.
  std::vector<Node> nodes = std::move(nodes_);
  first_ += static_cast<int64_t>(nodes.size());
  nodes_.clear();
  leaves_.clear();
  std::vector<Tensor> grads(nodes.size());
  grads[at(loss.node)] = gradient;
  const std::unordered_set<int64_t> kept(kept_.begin(), kept_.end());
  kept_.clear();
  Gradients result;
  result.set_tape(link_);
  for (size_t i = at(loss.node) + 1; i-- > 0;) {
    Node& node = nodes[i];
    const std::span gy(&grads[i], node.results);  // none: what is there is taken by the op's node
    bool any = false;
    for (size_t k = 0; k < gy.size(); ++k) {
      const int64_t number = first + static_cast<int64_t>(i + k);
      any = any || gy[k].defined();
      if (gy[k].defined() && kept.contains(number)) result.set_inner(number, gy[k].clone());
    }
    if (!any) continue;  // the loss does not depend on it
    if (node.function == nullptr) {
      result.set(node.id, to_write(std::move(gy[0])));
      continue;
    }
    const BackwardPath path(node.path);
    const OpScope running(node.name());
    const bool alone = node.inputs.size() == 1 && node.inputs[0] >= 0;
    Tensor* total = alone ? &grads[at(node.inputs[0])] : nullptr;
    if (!alone || !total->defined() || !node.function->add_to(*total, gy[0])) {
      Grads gx = node.backward(gy);
      std::fill(gy.begin(), gy.end(), Tensor());  // not shared any more, unless by gx
      for (size_t k = 0; k < node.inputs.size(); ++k)
        if (node.inputs[k] >= 0) accumulate(grads[at(node.inputs[k])], std::move(gx[k]));
    }
    std::fill(gy.begin(), gy.end(), Tensor());
    node.function.reset();  // frees what the op had kept
  }
  return result;
}

}  // namespace restage
