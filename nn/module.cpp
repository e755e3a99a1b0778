#include "nn/module.h"

#include <cmath>

#include <atomic>

namespace restage {
namespace {

struct Collector final : Fields {
  std::vector<StateEntry> entries;
  std::string prefix;
  std::string path;
  const char* kind = "";
  bool changes = false;

  void operator()(const std::string& name, Parameter& p) override {
    entries.push_back({prefix + name, &p.value, &p, path, kind, false});
  }
  void operator()(const std::string& name, Tensor& buffer) override {
    entries.push_back({prefix + name, &buffer, nullptr, path, kind, changes});
  }
  void operator()(const std::string& name, Module& child) override {
    const std::string old_prefix = prefix, old_path = path;
    const char* old_kind = kind;
    const bool old_changes = changes;
    child.scope = name;
    path = prefix + name;
    prefix += name + ".";
    kind = child.kind();
    changes = child.changes_buffers();
    child.visit(*this);
    prefix = old_prefix;
    path = old_path;
    kind = old_kind;
    changes = old_changes;
  }
};

}  // namespace

uint64_t Parameter::next_id() {
  static std::atomic<uint64_t> next{1};
  return next++;
}

std::vector<StateEntry> state_of(Module& module, const std::string& prefix) {
  Collector c;
  c.prefix = prefix;
  c.kind = module.kind();
  c.changes = module.changes_buffers();
  module.visit(c);
  return c.entries;
}

void name_scopes(Module& root, const std::string& name) {
  root.scope = name;
  state_of(root);
}

std::vector<Parameter*> parameters_of(Module& module) {
  std::vector<Parameter*> out;
  for (const StateEntry& e : state_of(module))
    if (e.parameter != nullptr) out.push_back(e.parameter);
  return out;
}

int64_t count_parameters(Module& module) {
  int64_t n = 0;
  for (const Parameter* p : parameters_of(module)) n += p->value.numel();
  return n;
}

void cast_module(Module& module, DType type) {
  for (const StateEntry& e : state_of(module)) *e.value = e.value->cast(type);
}

void move_module(Module& module, Device device) {
  for (const StateEntry& e : state_of(module)) *e.value = e.value->to(device);
}

Device device_of(Module& module) {
  const std::vector<StateEntry> entries = state_of(module);
  return entries.empty() ? Device{} : entries.front().value->device();
}

namespace {

/// number(i) for each of a tensor's numbers.
template <class F>
Tensor drawn(const Init& init, const Shape& shape, F number) {
  if (init.budget != nullptr) {
    *init.budget -= shape.numel();
    if (*init.budget < 0)
      throw InputError("", "is too small for the network", "give the sizes it was trained with");
  }
  std::vector<double> values(static_cast<size_t>(shape.numel()));
  for (size_t i = 0; i < values.size(); ++i) values[i] = number(i);
  return Tensor::from<double>(shape, values).cast(init.type);
}

}  // namespace

Tensor Init::uniform(const Shape& shape, double bound, const std::string& name) const {
  const RngKey stream = key.fold(name);
  return drawn(*this, shape,
               [&](size_t i) { return bound * (2 * restage::uniform(stream, i) - 1); });
}

Tensor Init::weight(const Shape& shape, int64_t in, int64_t out) const {
  if (start == Start::pytorch)
    return uniform(shape, 1.0 / std::sqrt(static_cast<double>(in)), "weight");
  const double deviation =
      start == Start::normal ? 0.02 : 0.02 * std::sqrt(2.0 / static_cast<double>(in + out));
  const RngKey stream = key.fold("weight");
  return drawn(*this, shape, [&](size_t i) { return deviation * restage::normal(stream, i); });
}

Tensor Init::bias(int64_t in, int64_t out) const {
  const double bound = start == Start::xavier ? 0 : 1.0 / std::sqrt(static_cast<double>(in));
  return uniform({out}, bound, "bias");
}

}  // namespace restage
