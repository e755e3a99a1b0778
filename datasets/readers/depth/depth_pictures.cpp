#include "datasets/readers/depth/depth_pictures.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "datasets/readers/arrays/npz.h"
#include "datasets/readers/clouds/cloud_names.h"
#include "datasets/readers/depth/grey_png.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/frame_names.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

constexpr double kNoDepth = 65535;

constexpr double kFarthestDepth = 1e5;  // metres; what is farther was not seen

float depth_of(double metres) {
  return metres > 0 && metres < kFarthestDepth ? static_cast<float>(metres) : 0.0f;
}

/// The PNG files in a folder, or else in a folder `depth` in it; none: there are none.
std::vector<std::string> pngs_of(const std::string& folder) {
  for (const std::string& at : {folder, folder + "/depth"}) {
    std::vector<std::string> out;
    std::error_code ignored;
    for (fs::directory_iterator item(at, ignored), end; !ignored && item != end;
         item.increment(ignored)) {
      const bool hidden = item->path().filename().string().starts_with(".");
      if (std::error_code failed;
          !hidden && is_png_name(item->path().string()) && item->is_regular_file(failed))
        out.push_back(item->path().string());
    }
    std::sort(out.begin(), out.end(), natural_less);
    if (!out.empty()) return out;
  }
  return {};
}

/// The time that a name is, in seconds; nothing for other names.
std::optional<double> time_of_name(const std::string& path) {
  const std::string stem = fs::path(path).stem().string();
  const bool digits = std::all_of(stem.begin(), stem.end(),
                                  [](char c) { return (c >= '0' && c <= '9') || c == '.'; });
  double value = 0;
  if (!digits || !text::parse(stem, value)) return std::nullopt;
  if (stem.find('.') != std::string::npos) return value;
  if (stem.size() == 13) return value * 1e-3;
  if (stem.size() == 16) return value * 1e-6;
  if (stem.size() == 19) return value * 1e-9;
  return std::nullopt;
}

/// Of names that are times which rise evenly: most steps are within half the usual one.
std::optional<double> rate_of_names(const std::vector<std::string>& files) {
  std::vector<double> steps;
  double before = 0;
  for (const std::string& file : files) {
    const std::optional<double> at = time_of_name(file);
    if (!at) return std::nullopt;
    if (&file != &files[0]) steps.push_back(*at - before);
    before = *at;
  }
  if (steps.size() < 2) return std::nullopt;
  std::vector<double> sorted = steps;
  std::sort(sorted.begin(), sorted.end());
  const double usual = sorted[sorted.size() / 2];
  const auto is_even = [&](double step) { return std::abs(step - usual) < 0.5 * usual; };
  double sum = 0, even = 0;
  for (const double step : steps)
    if (is_even(step)) sum += step, even += 1;
  if (sorted[0] <= 0 || even < 0.8 * static_cast<double>(steps.size())) return std::nullopt;
  const double fps = even / sum;
  return fps >= 1 && fps <= 1000 ? std::optional(fps) : std::nullopt;
}

class PngPictures : public DepthPictures {
 public:
  PngPictures(FrameList list, double scale) : list_(std::move(list)) {
    scale_ = scale > 0 ? scale : 0.001;
  }
  DepthPicture picture(int64_t frame) const override {
    const std::string& file = list_.files.at(static_cast<size_t>(frame));
    const GreyPicture grey = read_grey_png(file);
    DepthPicture out{grey.width, grey.height, {}, file};
    out.depth.reserve(grey.values.size());
    for (const uint16_t value : grey.values)
      out.depth.push_back(value == kNoDepth ? 0.0f : depth_of(scale_ * value));
    return out;
  }
  int64_t frames() const override { return std::ssize(list_.files); }
  std::optional<double> fps() const override { return rate_of_names(list_.files); }
  std::string kind() const override { return "PNG of 16 bits"; }
  std::vector<std::string> files() const override { return list_.files; }
  std::vector<std::string> remarks() const override { return list_.remarks; }

 private:
  FrameList list_;
};

bool is_sequence(const std::vector<int64_t>& shape) {
  return shape.size() == 3 && shape.back() != 1;
}

class ArrayPictures : public DepthPictures {
 public:
  ArrayPictures(std::string path, NpyArray array, double scale, std::optional<double> fps,
                std::optional<Intrinsics> camera)
      : path_(std::move(path)), array_(std::move(array)), fps_(fps), camera_(std::move(camera)) {
    const bool whole = array_.header().kind != 'f';
    scale_ = scale > 0 ? scale : whole ? 0.001 : 1;
    const std::vector<int64_t>& shape = array_.shape();
    const size_t first = is_sequence(shape) || shape.size() == 4 ? 1 : 0;
    frames_ = first == 1 ? shape[0] : 1;
    height_ = shape[first];
    width_ = shape[first + 1];
  }
  DepthPicture picture(int64_t frame) const override {
    DepthPicture out{static_cast<int>(width_),
                     static_cast<int>(height_),
                     {},
                     frames_ == 1 ? path_ : cat(path_, ": depth picture ", frame)};
    const int64_t n = width_ * height_;
    const bool whole = array_.header().kind != 'f';
    out.depth.reserve(static_cast<size_t>(n));
    for (int64_t i = frame * n; i < (frame + 1) * n; ++i) {
      const double value = array_[i];
      out.depth.push_back(whole && value == kNoDepth ? 0.0f : depth_of(scale_ * value));
    }
    return out;
  }
  int64_t frames() const override { return frames_; }
  std::optional<double> fps() const override { return fps_; }
  std::optional<Intrinsics> intrinsics() const override { return camera_; }
  std::string kind() const override { return "array " + shape_text(array_.shape()); }
  std::vector<std::string> files() const override { return {path_}; }

 private:
  std::string path_;
  NpyArray array_;
  std::optional<double> fps_;
  std::optional<Intrinsics> camera_;
  int64_t frames_ = 1, height_ = 0, width_ = 0;
};

/// Its depth pictures by their name; empty if it has none.
std::string depth_array_of(const Npz& file) {
  for (const std::string& name : file.names()) {
    try {
      if (are_depth_pictures(name, file.header(name).shape)) return name;
    } catch (const InputError&) {  // an object: no depth
    }
  }
  return "";
}

void check_pictures(const NpyArray& array) {
  const std::vector<int64_t>& shape = array.shape();
  const bool pictures =
      shape.size() == 2 || shape.size() == 3 || (shape.size() == 4 && shape.back() == 1);
  constexpr int64_t kMostSide = 16384;
  const size_t first = is_sequence(shape) || shape.size() == 4 ? 1 : 0;
  if (array.is_text() || !pictures || array.size() == 0 || shape[first] > kMostSide ||
      shape[first + 1] > kMostSide || shape[first] < 8 || shape[first + 1] < 8)
    throw InputError(array.where(), "holds no depth pictures: " + shape_text(shape),
                     "store them as [frames, height, width]");
}

std::unique_ptr<DepthPictures> open_array_pictures(const std::string& path, double scale,
                                                   uint64_t max_memory) {
  if (!is_npz_name(path)) {
    NpyArray array = read_npy(path, max_memory);
    check_pictures(array);
    return std::make_unique<ArrayPictures>(path, std::move(array), scale, std::nullopt,
                                           std::nullopt);
  }
  const Npz file(path, max_memory);
  const std::string name = depth_array_of(file);
  if (name.empty())
    throw InputError(path, "holds no depth pictures: " + list_of(file.names()),
                     "name the array [frames, height, width] 'depth'");
  std::optional<Intrinsics> camera;
  for (const char* beside : {"K", "intrinsics", "intrinsic", "depth_intrinsics", "camera_matrix"})
    if (!camera && file.has(beside)) camera = intrinsics_of(file.array(beside));
  NpyArray array = file.array(name);
  check_pictures(array);
  return std::make_unique<ArrayPictures>(path, std::move(array), scale,
                                         stated_fps(path, max_memory), std::move(camera));
}

}  // namespace

std::unique_ptr<DepthPictures> open_depth_pictures(const std::string& path, double scale,
                                                   uint64_t max_memory) {
  std::error_code ignored;
  if (is_array_name(path)) return open_array_pictures(path, scale, max_memory);
  FrameList list;
  if (!fs::is_directory(path, ignored)) {
    list.files = {path};
    return std::make_unique<PngPictures>(std::move(list), scale);
  }
  const std::vector<std::string> files = pngs_of(path);
  if (files.empty())
    throw InputError(path, "holds no depth pictures",
                     "give a folder of PNG files of 16 bits, or leave {intrinsics} out");
  list = order_frames(files, path);
  return std::make_unique<PngPictures>(std::move(list), scale);
}

bool holds_depth_pictures(const std::string& path, uint64_t max_memory) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    const std::vector<std::string> files = pngs_of(path);
    return !files.empty() && is_grey_png(files[0]);
  }
  if (!is_npz_name(path)) return is_png_name(path) && is_grey_png(path);
  try {
    const Npz file(path, max_memory);
    return !named_cloud(file) && !depth_array_of(file).empty();
  } catch (const InputError&) {
    return false;  // who reads it says what is wrong
  }
}

}  // namespace restage
