// A case of the oracle while it is computed: its inputs as leaves, its modules, its answer.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/reduce.h"
#include "nn/weights/state.h"
#include "tests/oracle/oracle_case.h"

namespace restage::oracle {

inline bool starts_with(const std::string& text, const std::string& begin) {
  return text.compare(0, begin.size(), begin) == 0;
}

class Case {
 public:
  Case(const TensorFile& file, const std::string& where, Device device)
      : file_(file), where_(where), device_(device) {
    type_ = text("dtype") == "f64" ? DType::f64 : DType::f32;
    ctx_.tape = &tape_;
    ctx_.training = text("train") == "True";
  }

  std::string text(const std::string& key) const {
    const auto found = file_.metadata.find(key);
    if (found == file_.metadata.end())
      throw InputError(where_, "lacks the metadata '" + key + "'", "give a case of the oracle");
    return found->second;
  }
  double number(const std::string& key) const {
    try {
      return std::stod(text(key));
    } catch (const std::logic_error&) {
      throw InputError(where_, "has no number as '" + key + "'", "give a case of the oracle");
    }
  }
  int64_t count(const std::string& key) const {
    const double n = number(key);
    if (!(n >= 0 && n <= 1e6))
      throw InputError(where_, "has an impossible '" + key + "'", "give a case of the oracle");
    return static_cast<int64_t>(n);
  }

  /// An input, with and without a gradient.
  Var in(const std::string& name) {
    const auto known = inputs_.find(name);
    if (known != inputs_.end()) return known->second;
    const uint64_t id = Parameter::next_id();
    leaves_.emplace_back("g.in." + name, id);
    return inputs_[name] = tape_.leaf(constant(name), id);
  }
  Tensor constant(const std::string& name) const {
    return file_.at("in." + name, where_).to(device_);
  }
  /// With a gradient where the case asks for one.
  Var asked(const std::string& name) {
    return file_.find("g.in." + name) != nullptr ? in(name) : Var(constant(name));
  }
  Tensor probe(const std::string& name = "probe") const {
    return file_.at("out." + name, where_).to(device_);
  }

  bool has_parameter(const std::string& name) const { return file_.find("p." + name) != nullptr; }
  /// How many parameters are called prefix + "0" + suffix, prefix + "1" + suffix and so on.
  int64_t listed(const std::string& prefix, const std::string& suffix) const {
    int64_t n = 0;
    while (has_parameter(prefix + std::to_string(n) + suffix)) ++n;
    return n;
  }
  bool has_buffer(const std::string& name) const { return file_.find("buf." + name) != nullptr; }
  int64_t size(const std::string& parameter, int axis) const {
    const Tensor& t = file_.at("p." + parameter, where_);
    if (axis >= t.rank())
      throw InputError(where_, "has a wrongly shaped " + parameter, "give a case of the oracle");
    return t.size(axis);
  }

  /// Fills a module with the parameters and buffers of the case; `prefix` as in its names.
  void load(Module& module, const std::string& prefix = "") {
    name_scopes(module, prefix.empty() ? "net" : prefix.substr(0, prefix.size() - 1));
    cast_module(module, type_);
    TensorFile state;
    for (const auto& [name, tensor] : file_.tensors)
      for (const std::string kind : {"p.", "buf."})
        if (starts_with(name, kind + prefix))
          state.tensors.emplace(name.substr(kind.size() + prefix.size()), tensor);
    load_state(module, state, "", where_);
    move_module(module, device_);
    modules_.emplace_back(&module, prefix);
    for (const StateEntry& e : state_of(module, prefix))
      if (e.parameter != nullptr) leaves_.emplace_back("g." + e.name, e.parameter->id);
  }

  void out(const std::vector<std::pair<std::string, Var>>& values) {
    for (const auto& [name, value] : values) put("out." + name, value.value);
  }
  void index(const std::string& name, const Tensor& value) { put("idx." + name, value); }
  /// The loss, its gradients, and the buffers after the call.
  void finish(const Var& loss) {
    out({{"loss", loss}});
    const Gradients gradients = tape_.backward(loss);
    for (const auto& [name, id] : leaves_)
      if (const Tensor* g = gradients.find(id)) put(name, *g);
    if (!ctx_.training) return;
    for (const auto& [module, prefix] : modules_)
      for (const StateEntry& e : state_of(*module, prefix))
        if (e.parameter == nullptr) put("out.buf." + e.name, *e.value);
  }

  Context& ctx() { return ctx_; }
  const Init& init() const { return init_; }
  TensorFile& answer() { return answer_; }

 private:
  void put(const std::string& name, const Tensor& value) { answer_.tensors[name] = value.cpu(); }

  const TensorFile& file_;
  const std::string& where_;
  Device device_;
  DType type_ = DType::f64;
  Tape tape_;
  Context ctx_;
  Init init_;
  std::map<std::string, Var> inputs_;
  std::vector<std::pair<std::string, uint64_t>> leaves_;
  std::vector<std::pair<Module*, std::string>> modules_;
  TensorFile answer_;
};

inline Var dot(const Var& x, const Tensor& probe) { return sum_all(x * Var(probe)); }

struct Entry {
  const char* name;  ///< a case's name begins with it
  void (*run)(Case&);
};
/// The systems of others and their parts.
std::span<const Entry> system_cases();

}  // namespace restage::oracle
