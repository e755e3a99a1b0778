// Pictures with materials, and animated pictures, which the libraries' own readers decode again.
#include <gif_lib.h>
#include <gtest/gtest.h>
#include <webp/demux.h>

#include <cmath>

#include "infer/render/animation.h"
#include "infer/render/film.h"
#include "infer/render/palette.h"
#include "infer/render/srgb.h"
#include "infer/render/texture.h"
#include "tests/infer/toy_clips.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

using Alpha = Material::Alpha;
using Wrap = Texture::Wrap;

constexpr Rgb kRed = {255, 0, 0}, kGreen = {0, 255, 0}, kBlue = {0, 0, 255};

/// A picture of 2 x 2 squares: red, green, blue, white.
std::string squares(int side) {
  Image image(2 * side, 2 * side, {255, 255, 255});
  fill_rectangle(image, 0, 0, side, side, kRed);
  fill_rectangle(image, side, 0, side, side, kGreen);
  fill_rectangle(image, 0, side, side, side, kBlue);
  return png_bytes(image);
}

TexturePicture decoded(const std::string& bytes) {
  std::string why;
  std::optional<TexturePicture> out = TexturePicture::decode(bytes, &why);
  EXPECT_TRUE(out) << why;
  return std::move(*out);
}

/// The square that is seen at texture coordinates (u, v).
char square_at(const TexturePicture& picture, const Texture& how, float u, float v) {
  const Rgba c = picture.at(how, Uv(u, v), 1);
  const bool r = c[0] > 0.5f, g = c[1] > 0.5f, b = c[2] > 0.5f;
  return r && g && b ? 'w' : r ? 'r' : g ? 'g' : b ? 'b' : '?';
}

TEST(TexturePicture, IsSeenWhereItsCoordinatesSay) {
  const TexturePicture picture = decoded(squares(16));
  Texture how;
  EXPECT_EQ(square_at(picture, how, 0.25f, 0.25f), 'r');
  EXPECT_EQ(square_at(picture, how, 0.75f, 0.25f), 'g');
  EXPECT_EQ(square_at(picture, how, 0.25f, 0.75f), 'b');
  EXPECT_EQ(square_at(picture, how, 0.75f, 0.75f), 'w');
  EXPECT_EQ(square_at(picture, how, 1.25f, -0.75f), 'r') << "repeats";
  how.across = Wrap::mirror;
  EXPECT_EQ(square_at(picture, how, 1.25f, 0.25f), 'g') << "mirrors";
  how.across = Wrap::clamp;
  EXPECT_EQ(square_at(picture, how, -3, 0.25f), 'r') << "holds its edge";
  EXPECT_EQ(square_at(picture, how, 7, 0.25f), 'g');
  how.transform << 1, 0, 0.5f, 0, 1, 0.5f;
  EXPECT_EQ(square_at(picture, how, 0.25f, 0.25f), 'w') << "moved by half";
  for (const float wild : {1e30f, -1e30f, std::nanf(""), INFINITY})
    EXPECT_TRUE(picture.at(how, Uv(wild, wild), wild).allFinite());
}

TEST(TexturePicture, FromAfarIsTheMeanOfItsLight) {
  const TexturePicture picture = decoded(squares(64));
  const Rgba far = picture.at({}, Uv(0.5f, 0.5f), 1e4f);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(far[k], 0.5f, 0.01f);
  const Rgba near = picture.at({}, Uv(0.5f, 0.25f), 1);
  EXPECT_NEAR(near[0], 0.5f, 0.01f) << "between red and green";
}

TEST(TexturePicture, WhatCannotBeDecodedSaysWhy) {
  const auto why = [](const std::string& bytes) {
    std::string out;
    EXPECT_FALSE(TexturePicture::decode(bytes, &out));
    return out;
  };
  EXPECT_EQ(why(""), "it has no bytes");
  EXPECT_EQ(why("nonsense"), "it is no PNG, JPEG or WebP picture");
  EXPECT_EQ(why("RIFF1234WEBPnonsense"), "it is no PNG, JPEG or WebP picture");
  const std::string good = squares(16);
  EXPECT_EQ(why(good.substr(0, good.size() / 2)), "its bytes are damaged");
  std::string huge = good;
  huge[16] = 0, huge[17] = 0, huge[18] = 0x3f, huge[20] = 0, huge[21] = 0, huge[22] = 0x3f;
  EXPECT_HAS(why(huge), "pixels") << "nothing is taken for a picture that cannot be";
}

// ---- surfaces
// --------------------------------------------------------------------------------------

/// A square of two metres that faces the camera, and what is drawn of it.
struct Board {
  Points vertices = {{-1, 0.1f, 0}, {1, 0.1f, 0}, {1, 2.1f, 0}, {-1, 2.1f, 0}};
  std::vector<Triangle> faces = {{0, 1, 2}, {0, 2, 3}};
  Appearance look;
  Board() {
    look.materials.resize(1);
    look.materials[0].unlit = true;
    look.material = {0, 0};
    look.uv = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    look.smooth = {0, 1, 2, 3};
  }
  Image draw(float behind = 0) const {
    std::vector<std::string> remarks;
    const auto pictures = decode_pictures(look, remarks);
    Canvas canvas(64, 64, 2);
    Camera camera;
    camera.target = {0, 1.1f, 0};
    canvas.begin(camera, 0, {}, {});
    if (behind != 0) {
      Points far = vertices;
      for (Point& p : far) p.z() -= behind;
      canvas.draw_mesh(far, faces, colour_of(0x0000ff));
    }
    canvas.draw_surface(vertices, faces, look, pictures);
    return canvas.image();
  }
};

TEST(Surface, ShowsItsPictureTheRightWayUp) {
  Board board;
  board.look.pictures = {{"squares", squares(16)}};
  board.look.materials[0].texture.picture = 0;
  const Image image = board.draw();
  testing::keep("board.png", png_bytes(image));
  EXPECT_EQ(image.at(22, 22), kRed);
  EXPECT_EQ(image.at(42, 22), kGreen);
  EXPECT_EQ(image.at(22, 42), kBlue);
  EXPECT_EQ(image.at(42, 42), (Rgb{255, 255, 255}));
  board.look.materials[0].colour = {0, 1, 1, 1};
  EXPECT_EQ(board.draw().at(22, 22), (Rgb{0, 0, 0})) << "times the material's colour";
  board.look.colours.assign(4, Rgba(0, 0, 1, 1));
  EXPECT_EQ(board.draw().at(42, 22), (Rgb{0, 0, 0})) << "times the vertices' colour";
  EXPECT_EQ(board.draw().at(22, 42), kBlue);
}

TEST(Surface, PicturesFollowPerspective) {
  Board board;  // lies on the ground and goes away from the camera
  board.vertices = {{-1, 1, 1}, {1, 1, 1}, {1, 1, -3}, {-1, 1, -3}};
  board.look.pictures = {{"squares", squares(16)}};
  board.look.materials[0].texture.picture = 0;
  const auto pictures = [&] {
    std::vector<std::string> remarks;
    return decode_pictures(board.look, remarks);
  }();
  Canvas canvas(64, 64, 1);
  Camera camera;
  camera.target = {0, 1, 0};
  camera.elevation = 0.5f;
  canvas.begin(camera, 0, {}, {});
  canvas.draw_surface(board.vertices, board.faces, board.look, pictures);
  const Image image = canvas.image();
  // The middle of the board, at z = -1, is where its two halves meet; in the picture it lies well
  // above the middle of what is seen of the board.
  const float ce = std::cos(0.5f), se = std::sin(0.5f), focus = 32 / std::tan(0.25f);
  const auto row = [&](float z) { return 32 - focus * (-z * se) / (4 - z * ce); };
  const int line = static_cast<int>(row(-1));
  EXPECT_GT(image.at(28, line + 3)[2], 200) << "blue below";
  EXPECT_LT(image.at(28, line + 3)[0], 60);
  EXPECT_GT(image.at(28, line - 3)[0], 200) << "red above";
  EXPECT_LT(image.at(28, line - 3)[2], 60);
}

TEST(Surface, MasksAndVeils) {
  Board board;
  Material& material = board.look.materials[0];
  material.colour = {1, 0, 0, 0.5f};
  EXPECT_EQ(board.draw(1).at(32, 32), kRed) << "opaque whatever its opacity";
  material.alpha = Alpha::mask;
  material.cutoff = 0.6f;
  const Rgb through = board.draw(1).at(32, 32);
  EXPECT_GT(through[2], through[0] + 100) << "what is behind a mask's hole";
  material.cutoff = 0.4f;
  EXPECT_EQ(board.draw(1).at(32, 32), kRed);
  material.alpha = Alpha::blend;
  const Rgb veiled = board.draw(1).at(32, 32);
  EXPECT_NEAR(veiled[0], 255 * linear_to_srgb(0.5f), 12);
  EXPECT_GT(veiled[2], 60);
}

TEST(Surface, VeilsAreDrawnFromFarToNear) {
  Board board;
  board.look.materials.assign(2, board.look.materials[0]);
  for (Material& material : board.look.materials) material.alpha = Alpha::blend;
  board.look.materials[0].colour = {1, 0, 0, 0.5f};
  board.look.materials[1].colour = {0, 1, 0, 0.5f};
  for (const Triangle& face : {Triangle{4, 5, 6}, Triangle{4, 6, 7}}) {
    board.faces.push_back(face);
    board.look.material.push_back(1);
  }
  for (int k = 0; k < 4; ++k) {
    board.vertices.push_back(board.vertices[static_cast<size_t>(k)] - Point(0, 0, 0.5f));
    board.look.uv.emplace_back(0, 0);
    board.look.smooth.push_back(4 + k);
  }
  const Rgb seen = board.draw().at(32, 32);
  EXPECT_GT(seen[0], seen[1] + 20) << "the near one, red, lies over the green one";
  std::swap(board.faces[0], board.faces[2]), std::swap(board.faces[1], board.faces[3]);
  board.look.material = {1, 1, 0, 0};
  EXPECT_EQ(board.draw().at(32, 32), seen) << "in whatever order the file has them";
}

TEST(Surface, OneSidedOnesAreNotSeenFromBehind) {
  Board board;
  board.look.materials[0].colour = {1, 0, 0, 1};
  for (Triangle& face : board.faces) std::swap(face[1], face[2]);
  EXPECT_NE(board.draw().at(32, 32), kRed);
  board.look.materials[0].two_sided = true;
  EXPECT_EQ(board.draw().at(32, 32), kRed);
}

TEST(Surface, CutsForPicturesAreNotSeenInTheLight) {
  // A roof whose ridge is cut in two: joined, it is lit as one rounded surface.
  Board board;
  board.vertices = {{-1, 0.1f, -1}, {0, 0.1f, 0},  {0, 2.1f, 0},  {-1, 2.1f, -1},
                    {0, 0.1f, 0},   {1, 0.1f, -1}, {1, 2.1f, -1}, {0, 2.1f, 0}};
  board.faces = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  board.look.material.assign(4, 0);
  board.look.uv.clear();
  board.look.materials[0].unlit = false;
  board.look.materials[0].colour = {0.5f, 0.5f, 0.5f, 1};
  board.look.smooth = {0, 1, 2, 3, 4, 5, 6, 7};
  const auto step = [&] {
    const Image image = board.draw();
    return std::abs(image.at(30, 32)[1] - image.at(33, 32)[1]);
  };
  const int cut = step();
  board.look.smooth = {0, 1, 2, 3, 1, 5, 6, 2};
  EXPECT_GT(cut, 25);
  EXPECT_LT(step(), cut / 3);
}

TEST(Film, RefusesTheLooksOfAnotherSurface) {
  std::vector<std::string> remarks;
  Clip clip = testing::toy_clips(2)[1];
  auto look = std::make_shared<Appearance>();
  look->materials.resize(1);
  look->material.assign(clip.faces.size(), 0);
  clip.look = look;
  EXPECT_GT(Film(clip, {}, remarks).width(), 0);
  look->material[0] = 1;
  EXPECT_HAS(test::refusal_of([&] { Film(clip, {}, remarks); }), "looks of another surface");
  look->material[0] = 0;
  look->uv.resize(3);
  EXPECT_HAS(test::refusal_of([&] { Film(clip, {}, remarks); }), "looks of another surface");
  look->uv.clear();
  look->materials[0].texture.picture = 0;
  EXPECT_HAS(test::refusal_of([&] { Film(clip, {}, remarks); }), "looks of another surface");
}

TEST(Film, AFrameIsTheSameAloneAndAmongOthers) {
  const Clip clip = testing::toy_clips(11)[1];
  std::vector<std::string> remarks;
  FilmOptions options;
  options.height = 80;
  const Film film(clip, options, remarks);
  std::vector<Image> all, one;
  film.draw({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, [&](const Image& image) { all.push_back(image); });
  film.draw({9}, [&](const Image& image) { one.push_back(image); });
  ASSERT_EQ(all.size(), 11u);
  EXPECT_EQ(all[9].rgb, one.at(0).rgb);
  EXPECT_NE(all[9].rgb, all[0].rgb);
}

// ---- animated pictures
// -----------------------------------------------------------------------------

/// A red square that walks over a wide ramp of greys.
std::vector<Image> film_of_a_walk(int frames) {
  std::vector<Image> out;
  for (int f = 0; f < frames; ++f) {
    Image image(96, 48, {0, 0, 0});
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 96; ++x) {
        const auto grey = static_cast<uint8_t>(40 + 2 * x);
        fill_rectangle(image, x, y, 1, 1, {grey, grey, static_cast<uint8_t>(grey - y / 2)});
      }
    fill_rectangle(image, 8 * f, 16, 12, 12, {220, 30, 40});
    out.push_back(image);
  }
  return out;
}

double difference(const Image& a, const uint8_t* pixels, size_t width) {
  double sum = 0;
  for (size_t k = 0; k < a.rgb.size() / 3; ++k)
    for (size_t c = 0; c < 3; ++c) sum += std::abs(a.rgb[3 * k + c] - pixels[width * k + c]);
  return sum / static_cast<double>(a.rgb.size());
}

TEST(Webp, DecodesToWhatWentIn) {
  const std::vector<Image> frames = film_of_a_walk(8);
  const auto writer = webp_writer(25);
  for (const Image& image : frames) writer->push(image);
  const std::string bytes = writer->finish();
  testing::keep("walk.webp", bytes);
  const WebPData data{reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()};
  WebPAnimDecoderOptions options;
  ASSERT_TRUE(WebPAnimDecoderOptionsInit(&options));
  options.color_mode = MODE_RGBA;
  WebPAnimDecoder* decoder = WebPAnimDecoderNew(&data, &options);
  ASSERT_NE(decoder, nullptr);
  WebPAnimInfo info;
  ASSERT_TRUE(WebPAnimDecoderGetInfo(decoder, &info));
  EXPECT_EQ(info.loop_count, 0u);
  EXPECT_EQ(info.frame_count, 8u);
  for (size_t f = 0; WebPAnimDecoderHasMoreFrames(decoder); ++f) {
    uint8_t* pixels = nullptr;
    int end = 0;
    ASSERT_TRUE(WebPAnimDecoderGetNext(decoder, &pixels, &end));
    EXPECT_EQ(end, static_cast<int>(40 * (f + 1)));
    EXPECT_LT(difference(frames.at(f), pixels, 4), 6);
  }
  WebPAnimDecoderDelete(decoder);
}

/// A soft shadow that moves by less than a pixel a picture.
Image soft_shadow(int frame) {
  Image image(160, 96, {0, 0, 0});
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double u = (x - 60 - 0.7 * frame) / 40, v = (y - 48) / 22.0;
      const auto grey = static_cast<uint8_t>(std::lround(235 - 60 * std::exp(-u * u - v * v)));
      fill_rectangle(image, x, y, 1, 1, {grey, grey, grey});
    }
  return image;
}

/// The largest error of the mean grey of a block of 8 x 8 pixels.
double worst_block(const Image& a, const uint8_t* rgba) {
  double worst = 0;
  for (int top = 0; top < a.height; top += 8)
    for (int left = 0; left < a.width; left += 8) {
      double sum = 0;
      for (int y = top; y < top + 8; ++y)
        for (int x = left; x < left + 8; ++x) {
          const auto k = static_cast<size_t>(y * a.width + x);
          sum += a.rgb[3 * k + 1] - rgba[4 * k + 1];
        }
      worst = std::max(worst, std::abs(sum / 64));
    }
  return worst;
}

TEST(Webp, SoftShadowsThatMoveHaveNoBlocks) {
  const auto writer = webp_writer(25);
  for (int f = 0; f < 20; ++f) writer->push(soft_shadow(f));
  const std::string bytes = writer->finish();
  const WebPData data{reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()};
  WebPAnimDecoder* decoder = WebPAnimDecoderNew(&data, nullptr);
  ASSERT_NE(decoder, nullptr);
  for (int f = 0; WebPAnimDecoderHasMoreFrames(decoder); ++f) {
    uint8_t* pixels = nullptr;
    int end = 0;
    ASSERT_TRUE(WebPAnimDecoderGetNext(decoder, &pixels, &end));
    EXPECT_LT(worst_block(soft_shadow(f), pixels), 2) << f;
  }
  WebPAnimDecoderDelete(decoder);
}

TEST(Webp, APictureThatStaysIsStoredOnce) {
  const auto once = webp_writer(25), often = webp_writer(25);
  once->push(soft_shadow(0));
  for (int f = 0; f < 50; ++f) often->push(soft_shadow(0));
  EXPECT_LT(often->finish().size(), once->finish().size() + 20);
}

struct GifInput {
  std::string bytes;
  size_t at = 0;
  static int read(GifFileType* file, GifByteType* out, int size) {
    auto& in = *static_cast<GifInput*>(file->UserData);
    const size_t count = std::min(static_cast<size_t>(size), in.bytes.size() - in.at);
    std::copy_n(in.bytes.begin() + static_cast<std::ptrdiff_t>(in.at), count, out);
    in.at += count;
    return static_cast<int>(count);
  }
};

TEST(Gif, DecodesToWhatWentIn) {
  const std::vector<Image> frames = film_of_a_walk(8);
  const auto writer = gif_writer(15, {frames[0], frames[4]});
  for (const Image& image : frames) writer->push(image);
  GifInput input{writer->finish()};
  testing::keep("walk.gif", input.bytes);
  EXPECT_HAS(input.bytes, "NETSCAPE2.0");
  int error = 0;
  GifFileType* gif = DGifOpen(&input, GifInput::read, &error);
  ASSERT_NE(gif, nullptr);
  ASSERT_EQ(DGifSlurp(gif), GIF_OK);
  EXPECT_EQ(gif->SWidth, 96);
  ASSERT_EQ(gif->ImageCount, 8);
  std::vector<uint8_t> shown(3 * 96 * 48);
  int hundredths = 0;
  for (int f = 0; f < 8; ++f) {
    const SavedImage& part = gif->SavedImages[f];
    GraphicsControlBlock control;
    ASSERT_EQ(DGifSavedExtensionToGCB(gif, f, &control), GIF_OK);
    hundredths += control.DelayTime;
    const GifImageDesc& where = part.ImageDesc;
    EXPECT_LT(where.Width * where.Height, f > 0 ? 96 * 48 / 4 : 96 * 48 + 1) << "what changed";
    for (int k = 0; k < where.Width * where.Height; ++k) {
      if (part.RasterBits[k] == control.TransparentColor) continue;
      const GifColorType& c = gif->SColorMap->Colors[part.RasterBits[k]];
      uint8_t* to = &shown[static_cast<size_t>(
          3 * ((where.Top + k / where.Width) * 96 + where.Left + k % where.Width))];
      to[0] = c.Red, to[1] = c.Green, to[2] = c.Blue;
    }
    EXPECT_LT(difference(frames[static_cast<size_t>(f)], shown.data(), 3), 4);
  }
  EXPECT_EQ(hundredths, 53) << "8 / 15 s, whose hundredths do not drift";
  DGifCloseFile(gif, &error);
}

TEST(Palette, DithersWhatItHasNoColourFor) {
  Image ramp(64, 64, {255, 255, 255});
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const auto v = static_cast<uint8_t>(64 + 2 * x);
      fill_rectangle(ramp, x, y, 1, 1, {v, v, v});
    }
  Palette palette({ramp}, 9);
  EXPECT_LE(palette.colours().size(), 9u);
  const std::vector<uint8_t> indices = palette.indices(ramp);
  for (int x = 0; x < 64; x += 8) {  // the mean over a block is the ramp's
    double sum = 0;
    for (int y = 0; y < 64; ++y)
      for (int u = x; u < x + 8; ++u)
        sum += palette.colours()[indices[static_cast<size_t>(64 * y + u)]][0];
    EXPECT_NEAR(sum / 512, 64 + 2 * (x + 3.5), 7) << x;
  }
  EXPECT_EQ(palette.indices(ramp), indices);
}

}  // namespace
}  // namespace restage
