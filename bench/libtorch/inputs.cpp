#include "inputs.h"

#include <fstream>
#include <nlohmann/json.hpp>

namespace bench {

std::map<std::string, Tensor> read_tensors(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  uint64_t length = 0;
  in.read(reinterpret_cast<char*>(&length), 8);
  TORCH_CHECK(in && length < (1u << 24), path, " is no safetensors file");
  std::string header(length, ' ');
  in.read(header.data(), static_cast<std::streamsize>(length));
  std::map<std::string, Tensor> out;
  const auto entries = nlohmann::json::parse(header);
  for (const auto& [name, about] : entries.items()) {
    const bool whole = name != "__metadata__" && about["dtype"] == "I32";
    if (name == "__metadata__" || (about["dtype"] != "F32" && !whole)) continue;
    Tensor t = torch::empty(about["shape"].get<std::vector<int64_t>>(),
                            whole ? torch::kInt : torch::kFloat);
    in.seekg(static_cast<std::streamoff>(8 + length + about["data_offsets"][0].get<uint64_t>()));
    in.read(static_cast<char*>(t.data_ptr()), static_cast<std::streamsize>(t.nbytes()));
    TORCH_CHECK(in, path, ": ", name, " is cut off");
    out[name] = whole ? t.to(torch::kLong) : t;
  }
  return out;
}

Inputs::Inputs(std::string folder)
    : folder_(std::move(folder)), tensors_(read_tensors(folder_ + "/inputs.safetensors")) {}

void Inputs::load(torch::nn::Module& module, const std::string& model, int64_t parameters,
                  const std::string& prefix) const {
  torch::NoGradGuard no_grad;
  const auto path = [&](const std::string& kind) {
    return folder_ + "/" + kind + "/" + model + ".safetensors";
  };
  const bool has = std::ifstream(path(variant)).good();
  const auto file = read_tensors(path(has ? variant : "initial"));
  size_t filled = 0, wanted = 0;
  int64_t count = 0;
  const auto fill = [&](const std::string& name, Tensor& value) {
    const auto it = file.find(prefix + name);
    TORCH_CHECK(it != file.end() && it->second.sizes() == value.sizes(), model, " has no ", name,
                " of shape ", value.sizes());
    value.copy_(it->second);
    ++filled;
  };
  for (auto& p : module.named_parameters()) {
    fill(p.key(), p.value());
    count += p.value().numel();
  }
  for (auto& b : module.named_buffers())
    if (b.value().is_floating_point()) fill(b.key(), b.value());
  for (const auto& entry : file) wanted += entry.first.rfind(prefix, 0) == 0;
  TORCH_CHECK(filled == wanted, model, ": ", wanted, " tensors in the file, ", filled,
              " in the model");
  TORCH_CHECK(parameters == 0 || count == parameters, model, " has ", count, " parameters");
}

}  // namespace bench
