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

/// A still WebP file.
std::string webp_bytes(const Image& image) {
  WebPPicture picture;
  WebPConfig config;
  if (WebPPictureInit(&picture) == 0 || WebPConfigInit(&config) == 0)
    webp_fails("another version of the library");
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.width = image.width;
  picture.height = image.height;
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  config.quality = kWebpQuality;
  const bool good = WebPPictureImportRGB(&picture, image.rgb.data(), 3 * image.width) != 0 &&
                    WebPEncode(&config, &picture) != 0;
  const int code = picture.error_code;
  std::string out(reinterpret_cast<const char*>(writer.mem), writer.size);
  WebPPictureFree(&picture);
  WebPMemoryWriterClear(&writer);
  if (!good) webp_fails("a picture could not be encoded (" + std::to_string(code) + ")");
  return out;
}

/// Stores every picture whole. The library's own encoder of animations stores what has changed,
/// and leaves out what has changed by less than four levels, in blocks: soft shadows that move
/// become chequered.
class WebpWriter final : public AnimationWriter {
 public:
  explicit WebpWriter(double fps) : fps_(fps) {}

  void push(const Image& image) override {
    if (!pictures_.empty() && (image.width != last_.width || image.height != last_.height))
      webp_fails("pictures of two sizes");
    if (pictures_.empty() || image.rgb != last_.rgb) {  // else the last one is shown for longer
      pictures_.push_back({webp_bytes(image), time()});
      last_ = image;
    }
    ++frames_;
  }

  std::string finish() override {
    const std::unique_ptr<WebPMux, void (*)(WebPMux*)> mux(WebPMuxNew(), WebPMuxDelete);
    const WebPMuxAnimParams for_ever = {0xffffffff, 0};
    bool good =
        mux && !pictures_.empty() && WebPMuxSetAnimationParams(mux.get(), &for_ever) == WEBP_MUX_OK;
    for (size_t k = 0; good && k < pictures_.size(); ++k) {
      WebPMuxFrameInfo info{};
      info.bitstream = {reinterpret_cast<const uint8_t*>(pictures_[k].bytes.data()),
                        pictures_[k].bytes.size()};
      info.duration =
          (k + 1 < pictures_.size() ? pictures_[k + 1].begins : time()) - pictures_[k].begins;
      info.id = WEBP_CHUNK_ANMF;
      info.dispose_method = WEBP_MUX_DISPOSE_NONE;
      info.blend_method = WEBP_MUX_NO_BLEND;
      good = WebPMuxPushFrame(mux.get(), &info, 0) == WEBP_MUX_OK;
    }
    WebPData data;
    WebPDataInit(&data);
    good = good && WebPMuxAssemble(mux.get(), &data) == WEBP_MUX_OK;
    std::string out;
    if (good) out.assign(reinterpret_cast<const char*>(data.bytes), data.size);
    WebPDataClear(&data);
    if (!good) webp_fails("the pictures could not be put together");
    return out;
  }

 private:
  struct Picture {
    std::string bytes;
    int begins;  ///< milliseconds
  };

  /// Milliseconds at which the next picture is shown.
  int time() const {
    return static_cast<int>(std::lround(1000 * static_cast<double>(frames_) / fps_));
  }

  double fps_;
  int64_t frames_ = 0;
  Image last_{0, 0, {0, 0, 0}};
  std::vector<Picture> pictures_;
};

}  // namespace

std::unique_ptr<AnimationWriter> webp_writer(double fps) {
  return std::make_unique<WebpWriter>(fps);
}

}  // namespace restage
