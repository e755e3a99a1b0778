// A config struct whose type is known at run time only: the config of a model or a stage that YAML
// names. Visitors go through to the visit() of the struct that it holds.
#pragma once

#include <memory>
#include <string>
#include <typeinfo>

#include "nn/config/config_reader.h"

namespace restage {

class AnyConfig {
 public:
  /// A struct without keys.
  AnyConfig() = default;
  template <class C>
  requires(!std::is_same_v<std::decay_t<C>, AnyConfig>) explicit AnyConfig(C value)
      : held_(std::make_unique<Held<C>>(std::move(value))) {}
  AnyConfig(const AnyConfig& other) : held_(other.held_ ? other.held_->clone() : nullptr) {}
  AnyConfig(AnyConfig&&) noexcept = default;
  AnyConfig& operator=(AnyConfig other) noexcept {
    held_ = std::move(other.held_);
    return *this;
  }
  ~AnyConfig() = default;

  template <class C>
  bool holds() const {
    return dynamic_cast<const Held<C>*>(held_.get()) != nullptr;
  }
  /// Error if it holds another type.
  template <class C>
  const C& as() const {
    const auto* held = dynamic_cast<const Held<C>*>(held_.get());
    if (held == nullptr) throw Error(std::string("this config is no ") + typeid(C).name());
    return held->value;
  }
  template <class C>
  C& as() {
    return const_cast<C&>(std::as_const(*this).as<C>());
  }

  template <class V>
  void visit_held(V& v) {
    if (held_) held_->visit_with(v);
  }

 private:
  struct Base {
    virtual ~Base() = default;
    virtual std::unique_ptr<Base> clone() const = 0;
    virtual void visit_with(ConfigReader& v) = 0;
    virtual void visit_with(ConfigWriter& v) = 0;
    virtual void visit_with(ConfigReference& v) = 0;
  };
  template <class C>
  struct Held final : Base {
    explicit Held(C v) : value(std::move(v)) {}
    std::unique_ptr<Base> clone() const override { return std::make_unique<Held>(value); }
    void visit_with(ConfigReader& v) override { visit(v, value); }
    void visit_with(ConfigWriter& v) override { visit(v, value); }
    void visit_with(ConfigReference& v) override { visit(v, value); }
    C value;
  };

  std::unique_ptr<Base> held_;
};

template <class V>
void visit(V& v, AnyConfig& c) {
  c.visit_held(v);
}

}  // namespace restage
