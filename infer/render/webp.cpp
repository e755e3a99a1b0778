#include <webp/encode.h>
#include <webp/mux.h>

#include <cmath>

#include "autograd/base/error.h"
#include "infer/render/animation.h"

namespace restage {
namespace {

constexpr float kWebpQuality = 82;  // of 100

[[noreturn]] void webp_fails(const std::string& what) {
  throw WorkError("webp: " + what + "; make the picture smaller");
}

class WebpWriter final : public AnimationWriter {
 public:
  explicit WebpWriter(double fps) : fps_(fps) {}

  void push(const Image& image) override {
    if (!encoder_) begin(image);
    if (image.width != width_ || image.height != height_) webp_fails("pictures of two sizes");
    WebPPicture picture;
    if (WebPPictureInit(&picture) == 0) webp_fails("another version of the library");
    picture.width = image.width;
    picture.height = image.height;
    picture.use_argb = 1;
    WebPConfig config;
    const bool good = WebPConfigInit(&config) != 0 &&
                      WebPPictureImportRGB(&picture, image.rgb.data(), 3 * image.width) != 0 &&
                      [&] {
                        config.quality = kWebpQuality;
                        return WebPAnimEncoderAdd(encoder_.get(), &picture, time(), &config) != 0;
                      }();
    WebPPictureFree(&picture);
    if (!good)
      webp_fails(std::string("a picture could not be encoded (") +
                 WebPAnimEncoderGetError(encoder_.get()) + ")");
    ++frames_;
  }

  std::string finish() override {
    WebPData data;
    WebPDataInit(&data);
    const bool good = encoder_ &&
                      WebPAnimEncoderAdd(encoder_.get(), nullptr, time(), nullptr) != 0 &&
                      WebPAnimEncoderAssemble(encoder_.get(), &data) != 0;
    std::string out;
    if (good) out.assign(reinterpret_cast<const char*>(data.bytes), data.size);
    WebPDataClear(&data);
    if (!good) webp_fails("the pictures could not be put together");
    return out;
  }

 private:
  void begin(const Image& image) {
    WebPAnimEncoderOptions options;
    if (WebPAnimEncoderOptionsInit(&options) == 0) webp_fails("another version of the library");
    width_ = image.width;
    height_ = image.height;
    encoder_.reset(WebPAnimEncoderNew(width_, height_, &options));
    if (!encoder_) webp_fails("no encoder for pictures of this size");
  }
  /// Milliseconds at which the next picture is shown.
  int time() const {
    return static_cast<int>(std::lround(1000 * static_cast<double>(frames_) / fps_));
  }

  double fps_;
  int width_ = 0, height_ = 0;
  int64_t frames_ = 0;
  std::unique_ptr<WebPAnimEncoder, void (*)(WebPAnimEncoder*)> encoder_{nullptr,
                                                                        WebPAnimEncoderDelete};
};

}  // namespace

std::unique_ptr<AnimationWriter> webp_writer(double fps) {
  return std::make_unique<WebpWriter>(fps);
}

}  // namespace restage
