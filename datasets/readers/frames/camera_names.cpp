#include "datasets/readers/frames/camera_names.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr std::string_view kCameras[] = {"cam",    "cams",  "camera",    "kinect",
                                         "sensor", "view",  "device",    "azure",
                                         "k4a",    "lidar", "viewpoint", "realsense"};
constexpr std::string_view kPlaces[] = {"left", "right",  "front",  "back", "rear",   "top",
                                        "side", "behind", "master", "sub",  "center", "centre"};

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool is_digit_of_name(char c) { return c >= '0' && c <= '9'; }

std::string without_marks(std::string text) {
  while (!text.empty() && std::string_view("_-. (#").find(text.back()) != std::string_view::npos)
    text.pop_back();
  return text;
}

}  // namespace

bool ends_in_camera(const std::string& text) {
  const std::string low = lower_case(without_marks(text));
  return std::any_of(std::begin(kCameras), std::end(kCameras), [&](std::string_view word) {
    return low.ends_with(word) &&
           (low.size() == word.size() || !is_letter(low[low.size() - word.size() - 1]));
  });
}

bool is_camera_name(const std::string& name) {
  size_t end = name.size();
  while (end > 0 && is_digit_of_name(name[end - 1])) --end;
  const size_t digits = name.size() - end;
  if (digits > 0) return digits <= 2 && ends_in_camera(name.substr(0, end));
  std::string low = lower_case(name);
  for (const std::string_view before : {"camera", "cam"})
    if (low.starts_with(before) && low.size() > before.size()) {
      low.erase(0, before.size());
      break;
    }
  low.erase(0, std::min(low.find_first_not_of("_-. "), low.size()));
  return std::find(std::begin(kPlaces), std::end(kPlaces), low) != std::end(kPlaces);
}

}  // namespace restage
