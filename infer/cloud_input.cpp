#include "infer/cloud_input.h"

#include <algorithm>
#include <charconv>

#include "autograd/base/error.h"
#include "nn/config/rules.h"
#include "nn/models/extraction.h"

namespace restage {
namespace {

constexpr int64_t kUsualPoints = 1024;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw InputError(where, what, "give weights as a training left them");
}

/// The number that a setting holds, 0 to `most`; `usual` if there is no such setting.
int64_t count_of(const TrainedModel& model, const char* setting, int64_t usual, int64_t most,
                 const std::string& where) {
  const auto found = model.settings.find(setting);
  if (found == model.settings.end()) return usual;
  const std::string& text = found->second;
  int64_t out = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc() || end != text.data() + text.size() || out < 0 || out > most)
    refuse(where, "says that its network sees '" + text.substr(0, 20) + "' " + setting);
  return out;
}

}  // namespace

int64_t trained_points(const TrainedModel& model, const std::string& where) {
  return count_of(model, "points", kUsualPoints, kMostPoints, where);
}

int64_t trained_vertices(const TrainedModel& model, const std::string& where) {
  return count_of(model, "vertices", 0, 1'000'000, where);
}

std::vector<int32_t> kept_vertices(const TrainedModel& model, const std::string& where) {
  const auto found = model.settings.find("kept");
  std::vector<int32_t> out;
  if (found == model.settings.end()) refuse(where, "does not say which vertices its network moves");
  const char *at = found->second.data(), *const end = at + found->second.size();
  while (at < end) {
    int32_t vertex = -1;
    const auto [next, error] = std::from_chars(at, end, vertex);
    if (error != std::errc() || (next < end && *next != ',') || vertex < 0 ||
        (!out.empty() && vertex <= out.back()))
      refuse(where, "has a damaged list of the vertices that its network moves");
    out.push_back(vertex);
    at = next + (next < end);
  }
  if (found->second.ends_with(',') || std::ssize(out) != trained_vertices(model, where))
    refuse(where, "has a damaged list of the vertices that its network moves");
  return out;
}

int64_t kept_of(const TrainedModel& model, const std::string& where) {
  return count_of(model, "kept_of", 0, 1'000'000, where);
}

void require_body(const Points& cloud, const std::string& source) {
  if (cloud.size() < kLeastDistinctPoints)
    throw UnusableCloud(source,
                        "holds " + std::to_string(cloud.size()) + " points, too few for a body",
                        "give at least " + std::to_string(kLeastDistinctPoints));
  for (const Point& p : cloud)
    if (!p.allFinite())
      throw UnusableCloud(source, "holds a coordinate that is not finite", "remove such points");
}

Points some_of(const Points& cloud, size_t count, const RngKey& key) {
  Rng rng(key);
  Points rest = cloud, out;
  while (out.size() < count) {
    if (rest.empty()) rest = cloud;
    std::swap(rest[rng.below(rest.size())], rest.back());
    out.push_back(rest.back());
    rest.pop_back();
  }
  return out;
}

Tensor tensor_of_points(const Points& points, const Shape& shape) {
  Tensor out = Tensor::empty(shape);
  float* to = out.data<float>();
  for (const Point& p : points) to = std::copy(p.data(), p.data() + 3, to);
  return out;
}

}  // namespace restage
