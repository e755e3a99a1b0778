// `model: NAME` in a configuration, and `sizes:` with the keys of that model.
#pragma once

#include <string>

#include "nn/models/registry.h"

namespace restage {

struct ModelChoice {
  explicit ModelChoice(const std::string& model)
      : role(model_type(model).role), name(model), sizes(model_type(model).training) {}
  std::string role;  ///< models of this role can be chosen
  std::string name;
  AnyConfig sizes;
};

/// The keys stand in the section that the choice belongs to.
template <class V>
void visit_choice(V& v, ModelChoice& c) {
  const std::string before = c.name;
  v("model", c.name, "the network ('restage info')", one_of(models_of_role(c.role)));
  if (c.name != before) c.sizes = model_type(c.name).training;
  v("sizes", c.sizes, "sizes that differ from the model's own");
}

}  // namespace restage
