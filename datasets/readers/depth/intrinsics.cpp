#include "datasets/readers/depth/intrinsics.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

using Json = nlohmann::json;

constexpr const char* kGiveCamera =
    "give FX,FY,CX,CY in pixels, or a file of them, of a 3 x 3 matrix or of the camera's JSON";
constexpr uint64_t kLargestCamera = 1 << 20;  // bytes of a file

/// Of four numbers or of a matrix, by rows or by columns.
Intrinsics of_numbers(const std::vector<double>& n, const std::string& where) {
  Intrinsics out;
  out.where = where;
  if (n.size() == 4) {
    out.fx = n[0], out.fy = n[1], out.cx = n[2], out.cy = n[3];
  } else if (n.size() == 9) {
    const bool by_columns = n[2] == 0 && n[5] == 0 && (n[6] != 0 || n[7] != 0);
    out.fx = n[0], out.fy = n[4];
    out.cx = by_columns ? n[6] : n[2], out.cy = by_columns ? n[7] : n[5];
  } else {
    throw InputError(where, cat("has ", n.size(), " numbers of a camera, but must have 4 or 9"),
                     kGiveCamera);
  }
  const auto is_focal = [](double f) { return f >= 1 && f <= 1e6; };
  const auto is_middle = [](double c) { return std::abs(c) <= 1e6; };
  if (!is_focal(out.fx) || !is_focal(out.fy) || !is_middle(out.cx) || !is_middle(out.cy))
    throw InputError(where,
                     format("are no camera's numbers in pixels: fx %.4g, fy %.4g, cx %.4g, cy %.4g",
                            out.fx, out.fy, out.cx, out.cy),
                     kGiveCamera);
  return out;
}

/// All numbers of a text with commas, brackets or white space between them; nothing if there is
/// something else.
std::optional<std::vector<double>> numbers_in(std::string text) {
  for (char& c : text)
    if (std::string_view(",;[]()\t\r\n").find(c) != std::string_view::npos) c = ' ';
  std::string_view rest = text;
  std::vector<double> out;
  while (out.size() < 16) {
    const std::string_view word = text::take_word(rest);
    double value = 0;
    if (word.empty()) return out;
    if (!text::parse(word, value)) return std::nullopt;
    out.push_back(value);
  }
  return out;
}

double number_at(const Json& json, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const auto at = json.find(name); at != json.end() && at->is_number())
      return at->get<double>();
  return 0;
}

int size_at(const Json& json, std::initializer_list<const char*> names) {
  const double size = number_at(json, names);
  return size >= 1 && size <= 1e5 ? static_cast<int>(size) : 0;
}

void flatten(const Json& json, std::vector<double>& out, int depth = 0) {
  if (json.is_number()) out.push_back(json.get<double>());
  if (!json.is_array() || depth > 2) return;
  for (const Json& one : json) {
    flatten(one, out, depth + 1);
    if (out.size() > 16) return;
  }
}

std::optional<Intrinsics> of_json(const Json& json, const std::string& where, int depth = 0) {
  if (!json.is_object() || depth > 2) return std::nullopt;
  std::optional<Intrinsics> out;
  for (const char* name : {"intrinsic_matrix", "K", "camera_matrix"}) {
    const auto at = json.find(name);
    if (at == json.end()) continue;
    std::vector<double> numbers;
    // OpenCV keeps a matrix as {"rows": 3, "cols": 3, "data": [...]}.
    flatten(at->is_object() && at->contains("data") ? (*at)["data"] : *at, numbers);
    out = of_numbers(numbers, where);
    break;
  }
  if (const double fx = number_at(json, {"fx"}); !out && fx > 0)
    out = of_numbers({fx, number_at(json, {"fy"}), number_at(json, {"cx", "ppx"}),
                      number_at(json, {"cy", "ppy"})},
                     where);
  if (out) {
    out->width = size_at(json, {"w", "width"});
    out->height = size_at(json, {"h", "height"});
    out->other_width = size_at(json, {"dw"});
    out->other_height = size_at(json, {"dh"});
    const double fps = number_at(json, {"fps"});
    if (fps >= 1 && fps <= 1000) out->fps = fps;
    return out;
  }
  for (const char* name : {"depth", "depth_intrinsics", "depth_camera", "intrinsics", "intrinsic",
                           "camera", "parameters"})
    if (const auto at = json.find(name); at != json.end())
      if (auto found = of_json(*at, where, depth + 1)) return found;
  return std::nullopt;
}

}  // namespace

Intrinsics read_intrinsics(const std::string& numbers_or_file) {
  const std::string& given = numbers_or_file;
  const auto direct = numbers_in(given);
  if (direct && direct->size() > 1) return of_numbers(*direct, "");
  if (!is_there(given))
    throw InputError(
        "",
        "{intrinsics} '" + given.substr(0, 60) + "' is neither the numbers of a camera nor a file",
        kGiveCamera);
  const std::string content = read_file(given, kLargestCamera);
  const std::string_view text = text::without_mark(content, given);
  if (const auto numbers = numbers_in(std::string(text)); numbers && !numbers->empty())
    return of_numbers(*numbers, given);
  const Json json = Json::parse(text, nullptr, false);
  if (const auto found = of_json(json, given)) return *found;
  throw InputError(given, "holds no numbers of a camera", kGiveCamera);
}

Intrinsics intrinsics_of(const NpyArray& array) {
  const std::vector<int64_t>& shape = array.shape();
  const bool several = shape.size() == 3 || (shape.size() == 2 && shape[1] == 4);
  const int64_t n = several && array.size() > 0 ? array.size() / shape[0] : array.size();
  if (array.is_text() || (n != 4 && n != 9))
    throw InputError(array.where(), "holds no numbers of a camera: " + shape_text(shape),
                     "store [3, 3], or [4]: fx, fy, cx, cy");
  std::vector<double> numbers;
  for (int64_t i = 0; i < n; ++i) numbers.push_back(array[i]);
  return of_numbers(numbers, array.where());
}

Intrinsics fitted_to(const Intrinsics& camera, int width, int height, const std::string& picture,
                     bool force) {
  Intrinsics out = camera;
  const bool known = camera.width > 0 && camera.height > 0;
  if (known && (camera.width != width || camera.height != height)) {
    if (camera.other_width != width || camera.other_height != height)
      throw InputError(camera.where.empty() ? picture : camera.where,
                       cat("is of pictures of ", camera.width, " x ", camera.height, ", but ",
                           picture, " has ", width, " x ", height),
                       "give the numbers of the depth camera at this size");
    const double across = static_cast<double>(width) / camera.width,
                 down = static_cast<double>(height) / camera.height;
    out.fx *= across, out.cx *= across, out.fy *= down, out.cy *= down;
    out.width = width, out.height = height;
  }
  const auto is_near_middle = [](double c, int size) { return c > 0.3 * size && c < 0.7 * size; };
  if (!known && !force && !(is_near_middle(out.cx, width) && is_near_middle(out.cy, height)))
    throw InputError(picture,
                     format("is %d x %d, but the camera's middle is at %.5g, %.5g, as in pictures "
                            "of %.0f x %.0f",
                            width, height, out.cx, out.cy, 2 * out.cx, 2 * out.cy),
                     "give the camera's numbers at this size, or {force} for cut pictures");
  return out;
}

}  // namespace restage
