// The models by the names that configurations, weights files and `restage info` use. A model is a
// pair of files here (its config struct with a visit(), the network) and one line in registry.cpp.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "nn/config/any_config.h"
#include "nn/module.h"

namespace restage {

struct ModelType {
  std::string name, help;
  std::string role;    ///< the role that it fills in a system (nn/weights/bundle.h)
  AnyConfig config;    ///< its sizes, at their defaults
  AnyConfig training;  ///< sizes with which a training starts that does not name any
  std::function<std::unique_ptr<Module>(const AnyConfig& config, const Init& init)> make;
  // Of a network that is written in Python (docs/design/python_networks.md), else empty.
  std::string module = {};                ///< the module of Python that defines it
  std::string code = {};                  ///< a checksum of its source, for identities
  std::vector<std::string> figures = {};  ///< of its own, after those of its stage
};

/// The line of a model whose class has a type `Config` with a visit(), and a constructor from one
/// and an Init. `config`: its sizes where they are not named.
template <class M>
ModelType model_of(const char* name, const char* role, const char* help,
                   typename M::Config config = {}) {
  return {name,
          help,
          role,
          AnyConfig(config),
          AnyConfig(config),
          [](const AnyConfig& c, const Init& init) -> std::unique_ptr<Module> {
            return std::make_unique<M>(c.as<typename M::Config>(), init);
          }};
}

const std::deque<ModelType>& models();
/// Who can import a file of Python that defines networks: a process of Python, no other one.
using NetworkImporter = std::function<void(const std::string& file)>;
void set_network_importer(NetworkImporter importer);
bool has_network_importer();
/// Imports files that were not imported so far; makes their names absolute. InputError for one that
/// cannot be imported. Does nothing without an importer.
void import_networks(std::vector<std::string>& files);
/// Adds a model of a program that uses this library, before anything else is done; model_of() makes
/// its line. Error if there is one of that name.
void register_model(ModelType type);
/// The same of a network that is written in Python: it takes the place of one of that name that
/// came from Python, too. Networks that exist stay what they are.
void register_own_model(ModelType type);
/// The model of this name, which stays where it is. InputError with the nearest known name if there
/// is none.
const ModelType& model_type(const std::string& name);
/// Builds a network. `config` is of the type of model_type(name).config.
std::unique_ptr<Module> make_model(const std::string& name, const AnyConfig& config,
                                   const Init& init);
/// The default sizes of a model, changed by `sizes`, each "name=value". InputError if the model has
/// no such size.
AnyConfig model_config(const std::string& name, const std::vector<std::string>& sizes = {});
/// The names of the models of a role.
std::vector<std::string> models_of_role(const std::string& role);

/// Builds a network as the interface of its role (SkeletonModel, MotionModel ...).
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
