// The object of Python behind a network of a user's own: its members, and calls of its methods.
#include <algorithm>
#include <cmath>

#include "autograd/base/log.h"
#include "autograd/base/module_path.h"
#include "autograd/base/words.h"
#include "python/model.h"
#include "python/own_network.h"

namespace restage::python {
namespace {

py::object value_for_python(const Var& v) {
  if (!v.value.defined()) return py::none();
  return py::cast(PyVar{v, nullptr, 0});
}

py::dict dict_of(const NamedVars& values) {
  py::dict out;
  for (const auto& [name, value] : values) out[py::str(name)] = value_for_python(value);
  return out;
}

/// restage.Input, whose attributes are the values.
py::object input_of(const NamedVars& values, const std::vector<Var>* state) {
  py::dict members = dict_of(values);
  if (state != nullptr) {
    py::list list;
    for (const Var& v : *state) list.append(value_for_python(v));
    members["state"] = list;
  }
  static const char* const kModule = "restage._network";
  return py::module_::import(kModule).attr("Input")(**members);
}

/// A Context of C++ in the hands of Python, for one call.
class Lent {
 public:
  Lent(Context& ctx, const std::unordered_set<uint64_t>& members)
      : lent_(std::make_shared<PyContext>(&ctx, &members)),
        before_(std::exchange(unrecorded(), false)) {
    ++networks_running();
  }
  ~Lent() {
    --networks_running();
    lent_->end();
    unrecorded() = before_;
  }
  Lent(const Lent&) = delete;
  Lent& operator=(const Lent&) = delete;
  py::object object() const { return py::cast(lent_); }

 private:
  std::shared_ptr<PyContext> lent_;
  bool before_;
};

std::string shape_text(std::initializer_list<int64_t> sizes) {
  return "[" + joined(sizes, [](int64_t n) { return n < 0 ? "any" : std::to_string(n); }) + "]";
}

}  // namespace

Held held(py::object o) {
  return {new py::object(std::move(o)), [](const py::object* p) {
            if (!Py_IsInitialized()) return;
            const py::gil_scoped_acquire acquired;
            delete p;
          }};
}

OwnObject::OwnObject(std::string name, std::string kind, const py::tuple& made)
    : name_(std::move(name)), kind_(std::move(kind)), instance_(held(made[0])) {
  has_loss_ = py::hasattr(*instance_, "loss");
  changes_ = attribute("changes_buffers", false);
  for (const py::handle entry : made[1]) {
    const auto said = py::reinterpret_borrow<py::tuple>(entry);
    Member member = member_of(said[0].cast<std::string>(), said[1]);
    if (member.parameter) parameters_.insert(member.parameter->id);
    if (member.child)
      for (const Parameter* of_child : parameters_of(*member.child))
        parameters_.insert(of_child->id);
    const auto path = said[2].cast<std::string>();
    if (layers_.empty() || layers_.back()->path != path) {
      layers_.push_back(std::make_unique<Layer>());
      layers_.back()->path = path;
      layers_.back()->of_class = said[3].cast<std::string>();
      layers_.back()->changes = changes_;
    }
    layers_.back()->members.push_back(std::move(member));
  }
}

OwnObject::Member OwnObject::member_of(const std::string& name, const py::object& value) {
  Member member;
  member.name = name;
  member.keeps = held(value);
  if (py::isinstance<Parameter>(value)) {
    member.parameter = value.cast<PyParameter>();
    member.parameter->value = member.parameter->value.cast(DType::f32);
  } else if (py::isinstance<PyModel>(value)) {
    member.child = value.cast<const PyModel&>().net;
  } else {
    member.buffer = &value.cast<Tensor&>();
  }
  return member;
}

void OwnObject::Member::visit(Fields& fields, const std::string& as) {
  if (parameter)
    fields(as, *parameter);
  else if (child)
    fields(as, *child);
  else
    fields(as, *buffer);
}

void OwnObject::Layer::visit(Fields& fields) {
  for (Member& member : members) member.visit(fields, member.name.substr(path.size() + 1));
}

void OwnObject::visit_members(Fields& fields) {
  for (const auto& layer : layers_) {
    if (!layer->path.empty())
      fields(layer->path, *layer);
    else
      for (Member& member : layer->members) member.visit(fields, member.name);
  }
}

py::object OwnObject::answer(Context& ctx, const NamedVars& input,
                             const std::vector<Var>* state) const {
  const ModuleScope path(name_);
  const Lent lent(ctx, parameters_);
  const uint64_t masks = ctx.masks;
  return in_python("forward", [&] {
    ctx.masks = masks;
    return instance_->attr("forward")(lent.object(), input_of(input, state));
  });
}

Var OwnObject::loss(Context& ctx, const NamedVars& input, const NamedVars& batch) const {
  const py::gil_scoped_acquire acquired;
  const ModuleScope path(name_);
  const Lent lent(ctx, parameters_);
  const uint64_t masks = ctx.masks;
  const py::object given = in_python("loss", [&] {
    ctx.masks = masks;
    std::vector<Var> state;
    return instance_->attr("loss")(lent.object(), input_of(input, &state), dict_of(batch));
  });
  if (!py::isinstance<PyVar>(given) || given.cast<const PyVar&>().var.value.numel() != 1)
    refuse("loss() gave no single number; return a Var of shape [1]");
  Var out = given.cast<const PyVar&>().var;
  if (!out.on_tape() && ctx.tape != nullptr)
    refuse("loss() depends on no parameter; use ctx.leaf(parameter)");
  return out;
}

std::vector<std::pair<std::string, double>> OwnObject::measure(
    const std::vector<std::pair<std::string, double>>& measured) const {
  const py::gil_scoped_acquire acquired;
  std::vector<std::pair<std::string, double>> out;
  if (!py::hasattr(*instance_, "validate")) return out;
  return in_python("validate", [&] {
    py::dict known;
    for (const auto& [name, value] : measured) known[py::str(name)] = value;
    const py::object given = instance_->attr("validate")(known);
    if (!py::isinstance<py::dict>(given)) refuse("validate() gave no dict of figures");
    const auto dict = py::reinterpret_borrow<py::dict>(given);
    const std::vector<std::string> names = figures();
    for (const auto& item : dict)
      if (std::find(names.begin(), names.end(), std::string(py::str(item.first))) == names.end())
        refuse("validate() gave '" + std::string(py::str(item.first)) +
               "', which 'figures' does not name; add it there");
    for (const std::string& name : names) {
      if (!dict.contains(name))
        refuse("validate() gave no '" + name + "', which 'figures' names; give it, or take it out");
      out.emplace_back(name, number_of(name, dict[py::str(name)]));
    }
    return out;
  });
}

std::vector<std::string> OwnObject::figures() const {
  const py::object given = attribute<py::object>("figures", py::tuple());
  if (py::isinstance<py::str>(given)) return {py::str(given)};
  std::vector<std::string> out;
  for (const py::handle name : given) out.emplace_back(py::str(name));
  return out;
}

double OwnObject::number_of(const std::string& figure, const py::handle& value) const {
  double out = 0;
  try {
    out = value.cast<double>();
  } catch (const py::cast_error&) {
    refuse("validate() gave " + std::string(py::repr(value)) + " for '" + figure +
           "', which is no number");
  }
  if (std::isnan(out) && !told_nan_.exchange(true))
    log_warning(name_ + ": validate() gave nan for '" + figure + "'");
  return out;
}

void OwnObject::require_learning(const Context& ctx,
                                 std::initializer_list<const Var*> answers) const {
  if (ctx.tape == nullptr || !ctx.training || ctx.frozen) return;
  if (std::none_of(members_.begin(), members_.end(),
                   [](const Member& m) { return m.parameter != nullptr; }))
    return;
  if (std::none_of(answers.begin(), answers.end(), [](const Var* v) { return v->on_tape(); }))
    refuse("forward()'s result depends on no parameter; use ctx.leaf(parameter)");
}

void OwnObject::require_same_members() const {
  static const char* const kModule = "restage._network";
  const py::list now = py::module_::import(kModule).attr("members")(*instance_);
  size_t i = 0;
  bool same = true;
  for (const auto& layer : layers_)
    for (const Member& member : layer->members) {
      same = same && i < now.size() &&
             py::object(py::reinterpret_borrow<py::tuple>(now[i])[1]).is(*member.keeps);
      ++i;
    }
  same = same && i == now.size();
  if (!same)
    refuse("a Parameter or Tensor of __init__ was replaced; change it with assign() instead");
}

void OwnObject::refuse(const std::string& what) const { throw ShapeError(name_ + ": " + what); }

Var OwnObject::part(const py::object& answer, const char* name,
                    std::initializer_list<int64_t> sizes, bool needed, bool only) const {
  py::object value = py::none();
  if (py::isinstance<py::dict>(answer)) {
    const auto dict = py::reinterpret_borrow<py::dict>(answer);
    if (dict.contains(name)) value = dict[name];
  } else if (only) {
    value = answer;
  } else if (needed) {
    refuse(std::string("forward() gave no dict with '") + name + "'");
  }
  if (value.is_none() && needed) refuse(std::string("forward() gave no '") + name + "'");
  if (value.is_none()) return {};
  const DType type = DType::f32;
  Var out = var_of(value, &type).var;
  bool fits = out.dtype() == DType::f32 && out.rank() == static_cast<int>(sizes.size());
  int axis = 0;
  for (const int64_t size : sizes) {
    fits = fits && (size < 0 || out.size(axis) == size);
    ++axis;
  }
  if (!fits)
    refuse(std::string("forward() gave '") + name + "' as " + out.shape().str() + " " +
           name_of(out.dtype()) + ", and it must be " + shape_text(sizes) + " float32");
  return out;
}

}  // namespace restage::python
