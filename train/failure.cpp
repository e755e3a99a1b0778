#include "train/failure.h"

#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"

namespace restage {
namespace {

constexpr const char* kKey = "restage_failure";

void put(const std::string& prefix, const TensorFile& from, TensorFile* to) {
  for (const auto& [name, tensor] : from.tensors) to->tensors[prefix + name] = tensor;
}

TensorFile part(const std::string& prefix, const TensorFile& from) {
  TensorFile out;
  for (const auto& [name, tensor] : from.tensors)
    if (name.starts_with(prefix)) out.tensors[name.substr(prefix.size())] = tensor;
  return out;
}

}  // namespace

void write_failure(const std::string& path, const Failure& f) {
  TensorFile file;
  put("state.", f.state, &file);
  for (const auto& [name, tensor] : f.examples) file.tensors["examples." + name] = tensor;
  const TensorFile given = to_file(f.given);
  put("given.", given, &file);
  const nlohmann::json about = {{"stage", f.stage},        {"step", f.step},
                                {"from", f.from},          {"said", f.said},
                                {"config", f.config_yaml}, {"given", given.metadata}};
  file.metadata[kKey] = about.dump();
  write_file_atomically(path, safetensors_bytes(file));
}

Failure read_failure(const std::string& path) {
  const TensorFile file = parse_safetensors(read_file(path), path);
  const auto found = file.metadata.find(kKey);
  const auto about = found == file.metadata.end()
                         ? nlohmann::json()
                         : nlohmann::json::parse(found->second, nullptr, false);
  Failure out;
  try {
    out.stage = about.at("stage"), out.said = about.at("said"), out.step = about.at("step");
    out.from = about.at("from");
    out.config_yaml = about.at("config");
    TensorFile given = part("given.", file);
    given.metadata = about.at("given").get<std::map<std::string, std::string>>();
    if (!given.tensors.empty()) out.given = bundle_of(given, path);
  } catch (const nlohmann::json::exception&) {
    throw InputError(path, "holds no failed step", "give a file of RUN/nonfinite");
  }
  out.state = part("state.", file);
  for (auto& [name, tensor] : part("examples.", file).tensors)
    out.examples.emplace_back(name, tensor);
  return out;
}

}  // namespace restage
