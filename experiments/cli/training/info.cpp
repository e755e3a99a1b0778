// restage info: the layers of a model and how many parameters each has, counted from the model.

#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "nn/models/registry.h"

namespace restage::cli {
namespace {

struct Layer {
  std::string name, kind;
  int64_t width = 0;  ///< of its output's last axis
  int64_t parameters = 0;

  std::string output() const { return "[..., " + std::to_string(width) + "]"; }
};

/// Modules that own parameters, in order; every parameter belongs to one.
std::vector<Layer> layers_of(Module& model) {
  std::vector<Layer> out;
  for (const StateEntry& e : state_of(model)) {
    if (e.parameter == nullptr) continue;
    if (out.empty() || out.back().name != e.module) out.push_back({e.module, e.kind});
    Layer& layer = out.back();
    // A recurrent layer has the weights of its gates below one another, and one state.
    const int64_t gates = layer.kind == "GRU" ? 3 : layer.kind == "LSTM" ? 4 : 1;
    const Shape& shape = e.value->shape();
    if (layer.parameters == 0) layer.width = shape[0] / gates;
    layer.parameters += shape.numel();
  }
  return out;
}

/// The model of that name. InputError if there is none: it says where all names stand.
const ModelType& asked_model(const std::string& name) {
  try {
    return model_type(name);
  } catch (const InputError& e) {
    throw InputError(e.where(), e.cause(), e.mend() + " ('restage info --help' lists all models)");
  }
}

int run_info(const std::string& name, const Common& common) {
  const auto model = make_model(name, asked_model(name).config, Init{});
  const int64_t total = count_parameters(*model);
  const std::vector<Layer> layers = layers_of(*model);
  if (common.json) {
    Json modules = Json::array();
    for (const Layer& l : layers)
      modules.push_back({{"name", l.name},
                         {"kind", l.kind},
                         {"output", l.output()},
                         {"parameters", l.parameters}});
    print_json({{"model", name}, {"parameters", total}, {"modules", modules}});
    return 0;
  }
  std::vector<std::vector<std::string>> rows = {{"module", "kind", "output", "parameters"}};
  for (const Layer& l : layers)
    rows.push_back({l.name.empty() ? "itself" : l.name, l.kind, l.output(), std::to_string(l.parameters)});
  rows.push_back({"all", model->kind(), "", std::to_string(total)});
  print(name + "\n\n" + markdown_table(rows));
  return 0;
}

std::string model_names() {
  std::string out;
  for (const ModelType& type : models()) out += "\n  " + type.name + ": " + type.help;
  return out;
}

}  // namespace

void add_info(Program& program) {
  auto [app, name] = program.add("info", "layers and parameter counts of a model",
                                 "restage info skeleton/point_transformer\n"
                                 "restage info smrm/rot6d --json",
                                 run_info);
  app.add_option("MODEL", name, "one of:" + model_names()).required();
}

}  // namespace restage::cli
