#include <gif_lib.h>

#include <algorithm>
#include <cmath>

#include "autograd/base/error.h"
#include "infer/render/animation.h"
#include "infer/render/palette.h"

namespace restage {
namespace {

constexpr int kSeen = 255;  // colours; one number more means "as before"

struct GifRectangle {
  int x0, y0, x1, y1;
};

/// What differs between two pictures; one pixel where nothing does.
GifRectangle changed(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b, int width,
                     int height) {
  GifRectangle out{width, height, 0, 0};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (a[y * width + x] != b[y * width + x])
        out = {std::min(out.x0, x), std::min(out.y0, y), std::max(out.x1, x + 1), y + 1};
  return out.x1 > 0 ? out : GifRectangle{0, 0, 1, 1};
}

class GifWriter final : public AnimationWriter {
 public:
  GifWriter(double fps, const std::vector<Image>& samples)
      : fps_(fps),
        width_(samples.at(0).width),
        height_(samples.at(0).height),
        palette_(samples, kSeen) {
    int error = 0;
    gif_ = EGifOpen(&bytes_, append_bytes, &error);
    if (gif_ == nullptr) fail(error);
    EGifSetGifVersion(gif_, true);
    ColorMapObject* map = GifMakeMapObject(256, nullptr);
    if (map == nullptr) fail(E_GIF_ERR_NOT_ENOUGH_MEM);
    for (size_t k = 0; k < palette_.colours().size(); ++k) {
      const Rgb& c = palette_.colours()[k];
      map->Colors[k] = {c[0], c[1], c[2]};
    }
    const int done = EGifPutScreenDesc(gif_, width_, height_, 8, 0, map);
    GifFreeMapObject(map);
    check(done);
    const unsigned char for_ever[3] = {1, 0, 0};
    check(EGifPutExtensionLeader(gif_, APPLICATION_EXT_FUNC_CODE));
    check(EGifPutExtensionBlock(gif_, 11, "NETSCAPE2.0"));
    check(EGifPutExtensionBlock(gif_, 3, for_ever));
    check(EGifPutExtensionTrailer(gif_));
  }
  ~GifWriter() override {
    if (gif_ != nullptr) EGifCloseFile(gif_, nullptr);
  }
  GifWriter(const GifWriter&) = delete;
  GifWriter& operator=(const GifWriter&) = delete;

  void push(const Image& image) override {
    if (image.width != width_ || image.height != height_)
      throw WorkError("gif: pictures of two sizes; make the picture smaller");
    const std::vector<uint8_t> shown = palette_.indices(image);
    const GifRectangle part = before_.empty() ? GifRectangle{0, 0, width_, height_}
                                              : changed(before_, shown, width_, height_);
    GraphicsControlBlock control{DISPOSE_DO_NOT, false, time(frames_ + 1) - time(frames_), kSeen};
    GifByteType block[4];
    EGifGCBToExtension(&control, block);
    check(EGifPutExtension(gif_, GRAPHICS_EXT_FUNC_CODE, 4, block));
    check(EGifPutImageDesc(gif_, part.x0, part.y0, part.x1 - part.x0, part.y1 - part.y0, false,
                           nullptr));
    std::vector<GifPixelType> line;
    for (int y = part.y0; y < part.y1; ++y) {
      line.clear();
      for (int x = part.x0; x < part.x1; ++x) {
        const size_t k =
            static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
        const bool same = !before_.empty() && before_[k] == shown[k];
        line.push_back(same ? kSeen : shown[k]);
      }
      check(EGifPutLine(gif_, line.data(), static_cast<int>(line.size())));
    }
    before_ = shown;
    ++frames_;
  }

  std::string finish() override {
    int error = 0;
    const int done = EGifCloseFile(gif_, &error);
    gif_ = nullptr;
    if (done != GIF_OK) fail(error);
    return std::move(bytes_);
  }

 private:
  static int append_bytes(GifFileType* file, const GifByteType* bytes, int size) {
    static_cast<std::string*>(file->UserData)
        ->append(reinterpret_cast<const char*>(bytes), static_cast<size_t>(size));
    return size;
  }
  [[noreturn]] static void fail(int error) {
    const char* words = GifErrorString(error);
    throw WorkError(std::string("gif: the pictures could not be encoded (") +
                    (words == nullptr ? "no reason is given" : words) + "); make them smaller");
  }
  void check(int done) {
    if (done != GIF_OK) fail(gif_->Error);
  }
  /// Hundredths of a second at which picture `k` is shown.
  int time(int64_t k) const {
    return static_cast<int>(std::lround(100 * static_cast<double>(k) / fps_));
  }

  double fps_;
  int width_, height_;
  Palette palette_;
  std::string bytes_;
  GifFileType* gif_ = nullptr;
  std::vector<uint8_t> before_;
  int64_t frames_ = 0;
};

}  // namespace

std::unique_ptr<AnimationWriter> gif_writer(double fps, const std::vector<Image>& samples) {
  return std::make_unique<GifWriter>(fps, samples);
}

}  // namespace restage
