// restage.model: networks by name, their parameters, state dicts in files.
#include "python/model.h"

#include "nn/models/registry.h"
#include "nn/weights/bundle.h"
#include "nn/weights/safetensors.h"
#include "python/own_network.h"

namespace restage::python {
namespace {

PyModel make(const std::string& name, const py::dict& sizes, uint64_t seed) {
  std::vector<std::string> words;
  for (const auto& [key, value] : sizes) {
    const bool flag = PyBool_Check(value.ptr());
    const std::string text =
        flag ? (value.ptr() == Py_True ? "true" : "false") : std::string(py::str(value));
    words.push_back(std::string(py::str(key)) + "=" + text);
  }
  const AnyConfig config = model_config(name, words);
  const py::gil_scoped_release released;
  int64_t budget = int64_t{1} << 31;  // a size that is a mistake does not ask for all memory
  return {name,
          std::shared_ptr<Module>(
              make_model(name, config, Init{RngKey{seed, 0}.fold(name), DType::f32, &budget})),
          config};
}

PyModel load_of(const py::object& weights, const std::string& role) {
  const std::string path = path_of(weights);
  const py::gil_scoped_release released;
  const Bundle bundle = load_bundle(path);
  const TrainedModel& found = bundle.need(role, weights_path(path));
  return {found.model, found.net, found.config};
}

py::dict dict_of(const TensorFile& file) {
  py::dict out;
  for (const auto& [name, tensor] : file.tensors) out[py::str(name)] = py::cast(tensor);
  return out;
}

/// What pickle and copy carry: the name, numbers by name, and sizes as a weights file has them.
py::tuple model_state(const PyModel& model) {
  const std::string role = model_type(model.name).role;
  Bundle bundle;
  bundle.put(role, {model.name, model.sizes, model.net, {}});
  const TensorFile file = export_model(bundle, role, "model");
  return py::make_tuple(model.name, dict_of(file), py::cast(file.metadata));
}

PyModel model_of_state(const py::tuple& state) {
  if (state.size() != 3) throw py::value_error("this is no state of a Model");
  const auto name = state[0].cast<std::string>();
  TensorFile file;
  file.tensors = tensors_of(state[1].cast<py::dict>());
  file.metadata = state[2].cast<std::map<std::string, std::string>>();
  const TrainedModel made = import_model(name, {}, file, "model");
  return {made.model, made.net, made.config};
}

void load_dict(const PyModel& model, const py::dict& state) {
  TensorFile file;
  file.tensors = tensors_of(state);
  const py::gil_scoped_release released;
  load_state(*model.net, file, "", "state");
}

py::tuple load_file(const py::object& path) {
  const std::string from = path_of(path);
  TensorFile file;
  {
    const py::gil_scoped_release released;
    file = read_safetensors(from);
  }
  return py::make_tuple(dict_of(file), py::cast(file.metadata));
}

void save_file(const py::object& path, const py::dict& arrays,
               const std::map<std::string, std::string>& metadata) {
  const std::string to = path_of(path);
  TensorFile file;
  file.tensors = tensors_of(arrays);
  file.metadata = metadata;
  const py::gil_scoped_release released;
  write_safetensors(to, file);
}

py::list names() {
  py::list out;
  for (const ModelType& type : models()) out.append(type.name);
  return out;
}

}  // namespace

TensorMap tensors_of(const py::dict& arrays) {
  TensorMap out;
  for (const auto& [key, value] : arrays) {
    if (!py::isinstance<py::str>(key))
      throw InputError("",
                       "a tensor's name is " + std::string(py::repr(key)) + ", which is no text",
                       "name tensors by str");
    const bool parameter = py::isinstance<Parameter>(value);
    out[py::str(key)] = parameter ? value.cast<PyParameter>()->value.cpu() : tensor_of(value).cpu();
  }
  return out;
}

std::vector<std::pair<std::string, PyParameter>> PyModel::parameters() const {
  std::vector<std::pair<std::string, PyParameter>> out;
  for (const StateEntry& entry : state_of(*net))
    if (entry.parameter != nullptr) out.emplace_back(entry.name, PyParameter(net, entry.parameter));
  return out;
}

void add_model(py::module_& m) {
  py::class_<PyModel>(m, "Model",
                      "A network of the registry; restage.model() makes it. A copy of one has "
                      "parameters of its own.")
      .def_readonly("name", &PyModel::name)
      .def("parameters",
           [](const PyModel& model) {
             py::list out;
             for (const auto& [name, p] : model.parameters()) out.append(p);
             return out;
           })
      .def("named_parameters",
           [](const PyModel& model) {
             py::dict out;
             for (const auto& [name, p] : model.parameters()) out[py::str(name)] = p;
             return out;
           })
      .def(
          "count", [](const PyModel& model) { return count_parameters(*model.net); },
          "How many numbers its parameters hold.")
      .def(
          "state_dict", [](const PyModel& model) { return dict_of(to_file(*model.net)); },
          "Copies of parameters and buffers by their names (PyTorch's).")
      .def("load_state_dict", &load_dict, py::arg("state"),
           "Takes the tensors of a dict; InputError, and nothing is taken, unless all of them fit.")
      .def("__call__", &call_model, py::kw_only(), py::arg("tape") = nullptr,
           py::arg("ctx") = nullptr,  // not the last one, which pybind11 2.10 would not let be None
           py::arg("training") = false, py::arg("seed") = 0, py::arg("step") = 0,
           R"(Runs the network; with a tape its parameters are leaves of it.

transfer/*: pose [n, t, p, 3], identity [n, v, 3] -> Var [n, t, v, 3]
skeleton/*: cloud [n, points, 3], centred -> dict of Vars: joints [n, 22, 3], turns, uncertainty (or None)
motion, smrm/*: joints [n, t, 22, 3], trans [n, t, 3], rest [n, 22, 3] -> dict: rotations, joints, trans
deformation/weights: rest joints [n, 22, 3], points [n, v, 3] -> Var [n, v, 22]
other multilayer perceptrons: x [..., inputs] -> Var
All in metres. training: dropout and batch statistics, random by seed and step. ctx: inside a network of your own, the
Context that it was given, in the place of the others.)")
      .def_property_readonly(
          "own",
          [](const PyModel& model) {
            const auto* own = dynamic_cast<const OwnObject*>(model.net.get());
            return own == nullptr ? py::none() : own->instance();
          },
          "the object of a network that was written in Python, or None")
      .def(py::pickle(&model_state, &model_of_state));
  m.def(
      "model", &make, py::arg("name"), py::arg("sizes") = py::dict(), py::arg("seed") = 0,
      "A network by the name that `restage info` uses, with fresh weights; sizes change its own.");
  m.def("load_model", &load_of, py::arg("weights"), py::arg("role"),
        "A trained network of a weights file or run: role skeleton, motion, deformation.weights, "
        "transfer ...");
  m.def("models", &names, "The names of all networks.");
  m.def("load_safetensors", &load_file, py::arg("path"), "(tensors by name, metadata)");
  m.def("save_safetensors", &save_file, py::arg("path"), py::arg("tensors"),
        py::arg("metadata") = std::map<std::string, std::string>(),
        "Writes arrays, Tensors or Parameters by name; the file appears whole or not at all.");
}

}  // namespace restage::python
