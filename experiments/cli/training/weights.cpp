// restage weights: what a weights file holds; single models into and out of it; between two files.
#include <type_traits>

#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/base/words.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/training/weights_list.h"
#include "nn/models/motion.h"
#include "nn/weights/bundle.h"
#include "nn/weights/state.h"

namespace restage::cli {
namespace {

// ---- show --------------------------------------------------------------------------------------

Json json_of(const std::string& text) {
  Json json = Json::parse(text, nullptr, false);
  return json.is_discarded() ? Json(text) : json;
}

Json shape_json(const Shape& shape) {
  Json out = Json::array();
  for (int i = 0; i < shape.rank(); ++i) out.push_back(shape[i]);
  return out;
}

/// A row for each network of the file; where it is written in Python, also what defines it. "": the
/// file says nothing of networks.
std::string networks_table(const TensorFile& file) {
  const auto said = file.metadata.find("restage");
  if (said == file.metadata.end()) return "";
  const Json json = json_of(said->second);
  if (!json.is_object() || !json.contains("models") || !json["models"].is_object()) return "";
  std::vector<std::vector<std::string>> rows = {{"for", "network", "parameters", "defined in"}};
  for (const auto& [place, entry] : json["models"].items()) {
    const auto text = [&entry = entry](const char* key, const char* other) {
      return entry.is_object() && entry.contains(key) && entry[key].is_string()
                 ? entry[key].get<std::string>()
                 : std::string(other);
    };
    int64_t values = 0;
    for (const auto& [name, t] : file.tensors)
      if (name.starts_with(place + ".")) values += t.numel();
    rows.push_back({place, text("model", "?"), std::to_string(values), text("module", "restage")});
  }
  return rows.size() > 1 ? markdown_table(rows) + "\n" : "";
}

/// `given`: a safetensors file, a run, or the name of weights that come with the program.
int run_show(const std::string& given, const Common& common) {
  const std::string path = weights_path(given);
  const TensorFile file = read_safetensors(path);
  int64_t values = 0;
  for (const auto& item : file.tensors) values += item.second.numel();
  if (common.json) {
    Json tensors = Json::array(), metadata = Json::object();
    for (const auto& [name, t] : file.tensors)
      tensors.push_back(
          {{"name", name}, {"dtype", name_of(t.dtype())}, {"shape", shape_json(t.shape())}});
    for (const auto& [key, text] : file.metadata) metadata[key] = json_of(text);
    print_json({{"file", path}, {"values", values}, {"metadata", metadata}, {"tensors", tensors}});
    return 0;
  }
  std::vector<std::vector<std::string>> rows = {{"tensor", "dtype", "shape"}};
  for (const auto& [name, t] : file.tensors)
    rows.push_back({name, name_of(t.dtype()), t.shape().str()});
  std::string text = path + ": " + std::to_string(file.tensors.size()) + " tensors, " +
                     std::to_string(values) + " values\n";
  for (const auto& item : file.metadata) text += item.first + ": " + item.second + "\n";
  print(text + "\n" + networks_table(file) + markdown_table(rows));
  return 0;
}

// ---- import and export -------------------------------------------------------------------------

struct Transfer {
  std::string from, model, map, out, with, role;
  std::vector<std::string> sizes, settings;
};

/// All that does not fit goes to standard output, since the error has but one line.
void print_misfits(const StateError& e, const Common& common) {
  print(common.json, {{"missing", e.missing}, {"unexpected", e.unexpected}, {"unfit", e.unfit}},
        e.details());
}

int report(const Transfer& t, const TensorFile& written, const Common& common) {
  print(common.json, {{"out", t.out}, {"model", t.model}, {"tensors", written.tensors.size()}},
        "wrote " + t.out + ": " + std::to_string(written.tensors.size()) + " tensors\n");
  return 0;
}

/// What is to be asked for late answers has to look ahead.
void check_ahead(const Transfer& t, const TrainedModel& model) {
  const auto* motion = dynamic_cast<const MotionModel*>(model.net.get());
  if (t.role == kLateMotion && motion != nullptr && motion->latency() == 0)
    throw InputError(t.from, "does not look ahead", "leave --role out");
}

/// What the state dict does not say of itself is as in the model of --with that it replaces: sizes,
/// where those of the paper do not fit, and settings, such as what the motion network's path means.
TrainedModel imported(const Transfer& t, const TensorFile& state, const TrainedModel* like) {
  TrainedModel model;
  try {
    model = import_model(t.model, t.sizes, state, t.from);
  } catch (const StateError&) {
    if (like == nullptr || !t.sizes.empty()) throw;
    model = *like;
    model.settings.clear();
    model.net = make_model(like->model, like->config, Init{RngKey{}, DType::f32});
    load_state(*model.net, state, "", t.from);
  }
  for (const std::string& setting : t.settings) {
    const size_t equals = setting.find('=');
    if (equals == std::string::npos || equals == 0)
      throw InputError("", "'" + setting + "' is no setting", "give NAME=VALUE");
    model.settings[setting.substr(0, equals)] = setting.substr(equals + 1);
  }
  if (like == nullptr) return model;
  std::vector<std::string> kept;
  for (const auto& [name, value] : like->settings)
    if (model.settings.emplace(name, value).second) kept.push_back(name + "=" + value);
  if (!kept.empty())
    log_info("as the model that it replaces: " + joined(kept) + " (--setting says otherwise)");
  return model;
}

/// A file may be extended in place: --with and --out may be the same.
int run_weights_import(const Transfer& t, const Common& common) {
  check_output(t.out, {t.from, t.map});
  TensorFile state = read_safetensors(t.from);
  for (const std::string& size : t.sizes)
    if (size.find('=') == std::string::npos || size.find('.') < size.find('='))
      throw InputError("", "'" + size + "' is no size of a model", "give NAME=VALUE");
  if (!t.map.empty()) state = NameMap::read(t.map).apply(state, t.from);
  Bundle models;
  if (!t.with.empty()) models = load_bundle(t.with);
  const std::string role = t.role.empty() ? model_type(t.model).role : t.role;
  const TrainedModel* like = models.find(role);
  if (like != nullptr && like->model != t.model) like = nullptr;
  try {
    TrainedModel model = imported(t, state, like);
    check_ahead(t, model);
    models.put(role, std::move(model));
  } catch (const StateError& e) {
    print_misfits(e, common);
    throw;
  }
  const TensorFile out = to_file(models);
  write_safetensors(t.out, out);
  return report(t, out, common);
}

int run_weights_export(const Transfer& t, const Common& common) {
  check_output(t.out, {t.from});
  const TensorFile out = export_model(load_bundle(t.from), t.model, t.from);
  write_safetensors(t.out, out);
  return report(t, out, common);
}

// ---- average -----------------------------------------------------------------------------------

struct Average {
  std::string from, other, out;
  double share = 0.5;
};

/// `from` plus `share` of the way to `other`, number by number.
Tensor between(const Tensor& from, const Tensor& other, double share) {
  Tensor out = from.clone();
  const auto mix = [&](auto* to, const auto* there) {
    for (int64_t i = 0; i < out.numel(); ++i)
      to[i] = static_cast<std::remove_reference_t<decltype(to[i])>>((1 - share) * to[i] +
                                                                    share * there[i]);
  };
  if (out.dtype() == DType::f32)
    mix(out.data<float>(), other.data<float>());
  else if (out.dtype() == DType::f64)
    mix(out.data<double>(), other.data<double>());
  return out;
}

int run_average(const Average& a, const Common& common) {
  check_output(a.out, {a.from, a.other});
  if (!(a.share >= 0 && a.share <= 1))
    throw InputError("", cat("--share ", a.share, " is out of range"), "give 0 to 1");
  TensorFile out = read_safetensors(a.from);
  const TensorFile other = read_safetensors(a.other);
  for (auto& [name, tensor] : out.tensors) {
    const auto there = other.tensors.find(name);
    if (there == other.tensors.end() || there->second.shape() != tensor.shape() ||
        there->second.dtype() != tensor.dtype())
      throw InputError(
          a.other,
          "has no tensor '" + name.substr(0, 60) + "' of " + tensor.shape().str() + " as " + a.from,
          "give weights of the same models and sizes");
    tensor = between(tensor, there->second, a.share);
  }
  if (other.tensors.size() != out.tensors.size())
    throw InputError(a.other, "has more tensors than " + a.from,
                     "give weights of the same models and sizes");
  write_safetensors(a.out, out);
  print(common.json, {{"out", a.out}, {"tensors", out.tensors.size()}},
        "wrote " + a.out + ": " + counted(out.tensors.size(), "tensor") + "\n");
  return 0;
}

void add_average(Program& program, CommandOptions group) {
  auto [app, a] = program.add(
      group, "average", "weights between those of two files, of one network trained further",
      "restage weights average --source before.safetensors --other after.safetensors --share 0.75 "
      "--out between.safetensors",
      run_average);
  app.add_option("--source", a.from, "weights file").required();
  app.add_option("--other", a.other, "weights file of the same models and sizes").required();
  app.add_option("--share", a.share, "how far to go from the first to the other, 0 to 1");
  app.add_option("--out", a.out, "weights file to write").required();
}

void add_import(Program& program, CommandOptions group) {
  auto [app, t] = program.add(
      group, "import", "put a state dict from elsewhere into a weights file",
      "restage weights import --source pt.safetensors --model skeleton/point_transformer "
      "--out w.safetensors\n"
      "restage weights import --source s.safetensors --model smrm/rot6d --size hidden=256 --out "
      "w.safetensors\n"
      "restage weights import --source smrm.safetensors --map names.yaml --model smrm/rot6d "
      "--with w.safetensors --setting remove_heading=false --out all.safetensors\n"
      "restage weights import --source late.safetensors --model smrm/hybrid --role motion.late "
      "--with w.safetensors --out all.safetensors",
      run_weights_import);
  app.add_option("--source", t.from, "state dict (safetensors; docs/convert_pytorch.py makes one)")
      .required()
      .formerly("--from");
  app.add_option("--model", t.model, "which model it is, as in 'restage info'").required();
  app.add_option(
      "--map", t.map,
      "YAML lines \"foreign name: our name\", * for any text (default: the names are ours)");
  app.add_option("--size", t.sizes,
                 "a size unlike the paper's, such as hidden=256 (default: the paper's)")
      .one_at_a_time();
  app.add_option("--setting", t.settings,
                 "how it was trained, such as translation=velocity (default: what its file says, "
                 "else as the model of --with that it replaces)")
      .one_at_a_time();
  app.add_option(
      "--role", t.role,
      "what it is for, where the model may be several things: motion, or motion.late for "
      "one that looks ahead, which 'restage retarget' then prefers (default: the model's only "
      "one)");
  app.add_option(
      "--with", t.with,
      "weights file whose other models are kept, and sizes and settings of the model that is "
      "replaced");
  app.add_option("--out", t.out, "weights file to write").required();
}

void add_export(Program& program, CommandOptions group) {
  auto [app, t] = program.add(
      group, "export", "take one model out of a weights file, as a plain state dict",
      "restage weights export --source w.safetensors --model smrm --out smrm.safetensors",
      run_weights_export);
  app.add_option("--source", t.from, "weights file").required().formerly("--from");
  app.add_option("--model", t.model,
                 "its name (smrm/rot6d), role (motion, motion.late) or prefix (smrm)")
      .required();
  app.add_option("--out", t.out, "state dict to write (safetensors)").required();
}

}  // namespace

void add_weights(Program& program) {
  CommandOptions group = program.add_group("weights", "look into weights files, import and export");
  add_weights_list(program, group);
  auto [show, file] =
      program.add(group, "show", "list what a safetensors file holds",
                  "restage weights show w.safetensors\nrestage weights show w.safetensors --json\n"
                  "restage weights show standard",
                  run_show);
  show.add_option("FILE", file, "safetensors file; or a run, standard or lite").required();
  add_import(program, group);
  add_export(program, group);
  add_average(program, group);
}

}  // namespace restage::cli
