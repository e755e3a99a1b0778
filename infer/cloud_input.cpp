#include "infer/cloud_input.h"

#include <algorithm>
#include <charconv>

#include "autograd/base/error.h"
#include "nn/config/rules.h"
#include "nn/models/extraction.h"

namespace restage {
namespace {

constexpr int64_t kUsualPoints = 1024;

}  // namespace

int64_t trained_points(const TrainedModel& model, const std::string& where) {
  const auto found = model.settings.find("points");
  if (found == model.settings.end()) return kUsualPoints;
  const std::string& text = found->second;
  int64_t out = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc() || end != text.data() + text.size() || out < 0 || out > kMostPoints)
    throw InputError(where, "says that its network sees '" + text.substr(0, 20) + "' points",
                     "give weights as a training left them");
  return out;
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
