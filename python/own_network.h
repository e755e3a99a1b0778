// Networks that are written in Python, as the interfaces of C++ (docs/design/python_networks.md).
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <unordered_set>
#include <variant>
#include <vector>

#include "nn/config/config_reader.h"
#include "nn/models/own_training.h"
#include "python/context.h"

namespace restage::python {

/// An object of Python that is let go under the GIL, wherever it is forgotten.
using Held = std::shared_ptr<const py::object>;
Held held(py::object o);

/// Sizes: the keyword arguments of a class of Python, with their defaults.
struct OwnSizes {
  struct Size {
    std::string name, help;
    std::variant<bool, int64_t, double, std::string> value;
  };
  std::vector<Size> sizes;
};

template <class V>
void visit(V& v, OwnSizes& c) {
  for (OwnSizes::Size& size : c.sizes)
    std::visit([&](auto& value) { v(size.name, value, size.help); }, size.value);
}

/// Goes on with an exception of Python that a network raised: as it is, or, in the program, with
/// its traceback printed and as an error of one line. `where`: "mine/net: forward()".
[[noreturn]] void fail(const py::error_already_set& error, const std::string& where);
/// Whether this process is the program: `python3 -m restage`.
void be_the_program();

/// The object of Python behind a network, and its members by name. Python keeps the objects.
class OwnObject : public OwnTraining {
 public:
  /// `made`: what build() of restage/_network.py gives, (instance, [(name, member, path of its
  /// layer, class of its layer)]). With the GIL.
  OwnObject(std::string name, std::string kind, const py::tuple& made);

  const py::object& instance() const { return *instance_; }
  bool has_loss() const override { return has_loss_; }
  Var loss(Context& ctx, const NamedVars& input, const NamedVars& batch) const override;
  std::vector<std::pair<std::string, double>> measure(
      const std::vector<std::pair<std::string, double>>& measured) const override;

 protected:
  void visit_members(Fields& fields);
  const char* kind_name() const { return kind_.c_str(); }
  bool has_changing_buffers() const { return changes_; }
  /// What forward() gives. With the GIL.
  py::object answer(Context& ctx, const NamedVars& input, const std::vector<Var>* state) const;
  /// A member of the answer (a dict), or the answer itself where it is a value and `only`. Sizes:
  /// -1 is any number. ShapeError; undefined where it is not there and not `needed`.
  Var part(const py::object& answer, const char* name, std::initializer_list<int64_t> sizes,
           bool needed = true, bool only = false) const;
  /// An attribute, or `other` where there is none. With the GIL.
  template <class T>
  T attribute(const char* name, T other) const {
    if (!py::hasattr(*instance_, name)) return other;
    try {
      return instance_->attr(name).cast<T>();
    } catch (const py::cast_error&) {
      throw ShapeError(name_ + ": '" + name + "' is of another type than it must be");
    }
  }
  const std::string& name() const { return name_; }
  /// ShapeError where none of the values that a training asked for hangs on a parameter.
  void require_learning(const Context& ctx, std::initializer_list<const Var*> answers) const;
  /// ShapeError where an attribute is another Parameter or Tensor than __init__ left. With the GIL.
  void require_same_members() const;
  [[noreturn]] void refuse(const std::string& what) const;
  /// Runs work; exceptions of Python as fail() says. With the GIL.
  template <class Work>
  auto in_python(const char* method, const Work& work) const -> decltype(work());

 private:
  struct Member {
    std::string name;
    PyParameter parameter;
    Tensor* buffer = nullptr;
    std::shared_ptr<Module> child;
    Held keeps;
    void visit(Fields& fields, const std::string& as);
  };
  /// Members that follow one another and belong to one object below the network, such as a layer.
  struct Layer final : Module {
    std::string path, of_class;
    bool changes = false;
    std::vector<Member> members;
    void visit(Fields& fields) override;
    const char* kind() const override { return of_class.c_str(); }
    bool changes_buffers() const override { return changes; }
  };
  static Member member_of(const std::string& name, const py::object& value);
  std::vector<std::string> figures() const;
  /// A figure that validate() gave. ShapeError where it is no number; tells once of one that is
  /// NaN.
  double number_of(const std::string& figure, const py::handle& value) const;
  std::string name_, kind_;
  Held instance_;
  std::vector<std::unique_ptr<Layer>> layers_;  // all members; path "": of the network itself
  std::unordered_set<uint64_t> parameters_;  // identities of all
  bool has_loss_ = false, changes_ = false;
  mutable std::atomic<bool> told_nan_ = false;
};

/// Ctrl-C in the middle of a network would lose the step. The network is called again, as its
/// answer depends on its input alone, and Python raises KeyboardInterrupt after the step.
template <class Work>
auto OwnObject::in_python(const char* method, const Work& work) const -> decltype(work()) {
  for (bool again = false;; again = true) {
    try {
      auto out = work();
      if (again) PyErr_SetInterrupt();
      return out;
    } catch (const py::error_already_set& error) {
      if (again || !error.matches(PyExc_KeyboardInterrupt))
        fail(error, name_ + ": " + method + "()");
    }
  }
}

/// One that C++ can make, by its role. With the GIL. InputError for roles without one.
std::unique_ptr<Module> own_network(const std::string& role, const std::string& name,
                                    const std::string& kind, const py::tuple& made);

}  // namespace restage::python
