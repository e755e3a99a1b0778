// make_h5 FILE.h5 < DESCRIPTION.json: writes any HDF5 file for the tests of the command line, which
// run on a bare Python. {"datasets": {"/joints": {"type": "float64", "shape": [..], "values":
// [..]}}, "attributes": {"name": text or number}}; values may be numbers, "nan" or "inf"; one
// value fills the whole data set. make_h5 --read FILE.h5: all its data sets of numbers the other
// way round, {"/joints": {"shape": [..], "values": [..]}}.
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>

#include "autograd/base/error.h"
#include "datasets/hdf5/file.h"

namespace {

using nlohmann::json;

double number(const json& value) {
  if (value == "nan") return std::numeric_limits<double>::quiet_NaN();
  if (value == "inf") return std::numeric_limits<double>::infinity();
  return value.get<double>();
}

template <class T>
void write(restage::h5::File& file, const std::string& name, const json& set) {
  const auto shape = set["shape"].get<std::vector<int64_t>>();
  size_t count = 1;
  for (const int64_t n : shape) count *= static_cast<size_t>(n);
  std::vector<T> values;
  for (const json& value : set["values"]) values.push_back(static_cast<T>(number(value)));
  if (values.size() == 1) values.assign(count, values[0]);
  file.write<T>(name, shape, values);
}

void read(const restage::h5::File& file, const std::string& name, json& out) {
  const std::vector<std::string> children = file.children(name);
  for (const std::string& child : children) {
    const std::string path = (name == "/" ? "" : name) + "/" + child;
    try {
      const restage::h5::Dataset set = file.dataset(path);
      if (set.type() != restage::h5::Type::text)
        out[path] = {{"shape", set.shape()}, {"values", set.read<double>()}};
    } catch (const restage::InputError&) {  // a group
      read(file, path, out);
    }
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 3 && std::string(argv[1]) == "--read") {
    json out = json::object();
    read(restage::h5::File::open(argv[2]), "/", out);
    std::cout << out << "\n";
    return 0;
  }
  if (argc != 2) throw std::runtime_error("usage: make_h5 [--read] FILE.h5 < DESCRIPTION.json");
  const json description = json::parse(std::cin);
  restage::h5::File file = restage::h5::File::create(argv[1]);
  for (const auto& [name, set] : description["datasets"].items()) {
    const auto type = set["type"].get<std::string>();
    if (type == "float64") write<double>(file, name, set);
    if (type == "float32") write<float>(file, name, set);
    if (type == "int64") write<int64_t>(file, name, set);
  }
  for (const auto& [name, value] : description["attributes"].items()) {
    if (value.is_string()) file.set_text("/", name, value.get<std::string>());
    if (value.is_number_integer()) file.set_integer("/", name, value.get<int64_t>());
    if (value.is_number_float()) file.set_number("/", name, value.get<double>());
  }
  file.commit();
  return 0;
} catch (const std::exception& error) {
  std::cerr << "make_h5: " << error.what() << "\n";
  return 1;
}
