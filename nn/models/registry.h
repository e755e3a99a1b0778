// The models by the names that configurations, weights files and `restage info` use. A model is a
// pair of files here (its config struct with a visit(), the network) and one line in registry.cpp.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "nn/config/any_config.h"
#include "nn/module.h"

namespace restage {

struct ModelType {
  std::string name, help;
  std::string role;    ///< what it is used as (nn/weights/bundle.h)
  AnyConfig config;    ///< its sizes, at their defaults
  AnyConfig training;  ///< the same, as a training starts that does not say otherwise
  std::unique_ptr<Module> (*make)(const AnyConfig& config, const Init& init);
};

const std::vector<ModelType>& models();
/// InputError with the nearest known name if there is no such model.
const ModelType& model_type(const std::string& name);
/// `config` as model_type(name).config, perhaps changed.
std::unique_ptr<Module> make_model(const std::string& name, const AnyConfig& config,
                                   const Init& init);
/// The sizes of a model with some changed, each "name=value". InputError if it has no such size.
AnyConfig model_config(const std::string& name, const std::vector<std::string>& sizes = {});
/// The names of the models of a role.
std::vector<std::string> models_of_role(const std::string& role);

/// A model as what its role promises (SkeletonModel, MotionModel ...).
template <class M>
std::shared_ptr<M> make_model_as(const std::string& name, const AnyConfig& config,
                                 const Init& init) {
  auto model =
      std::dynamic_pointer_cast<M>(std::shared_ptr<Module>(make_model(name, config, init)));
  if (model == nullptr)
    throw InputError("", "'" + name + "' is a model of another kind than is needed here",
                     "'restage info --help' lists the models");
  return model;
}

}  // namespace restage
