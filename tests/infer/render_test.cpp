#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "infer/render/figures.h"
#include "infer/render/page.h"
#include "infer/render/rasteriser.h"
#include "infer/render/sheet.h"
#include "tests/infer/toy_clips.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using testing::keep;
using testing::toy_clips;

// Pixels of a column-row cell that are clearly coloured as the clip is (its hue, not grey).
int coloured(const Image& image, int x0, int x1, int y0, int y1, uint32_t colour) {
  const int want[3] = {static_cast<int>(colour >> 16), static_cast<int>(colour >> 8 & 255),
                       static_cast<int>(colour & 255)};
  int count = 0;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const Rgb p = image.at(x, y);
      const int spread =
          *std::max_element(p.begin(), p.end()) - *std::min_element(p.begin(), p.end());
      const auto most = std::max_element(p.begin(), p.end()) - p.begin();
      count += spread > 30 && most == std::max_element(want, want + 3) - want;
    }
  return count;
}

TEST(Sheet, EveryCellShowsItsClip) {
  SheetOptions options;
  options.columns = 4;
  options.cell_height = 160;
  const Image sheet = contact_sheet(toy_clips(), options);
  keep("sheet.png", png_bytes(sheet));
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) {
      const int w = sheet.width / 4, h = sheet.height / 3;
      const int x = column * w, y = row * h;
      EXPECT_GT(coloured(sheet, x, x + w, y + h / 5, y + h, kClipColours[row]), 400)
          << row << ' ' << column;
    }
  EXPECT_EQ(sheet.at(1, 1), (Rgb{0xf7, 0xf8, 0xfa}));
  EXPECT_EQ(contact_sheet(toy_clips(), options).rgb, sheet.rgb);
}

TEST(Figures, TheViewContainsWhatItIsToldTo) {
  constexpr uint32_t kBlue = 0x4a8bc9, kOrange = 0xe8892a;
  const Points person = toy_clips(1)[0].frames[0];
  Points aside = person, far = {person[0] + Point(40, 3, 40)};
  for (Point& p : aside) p.x() += 3;
  const auto drawn = [](const Figure& figure, uint32_t colour) {
    const Image sheet = figure_sheet({figure});
    return coloured(sheet, 0, sheet.width, 0, sheet.height, colour);
  };
  Figure two{{{person, {}, kBlue}, {aside, {}, kOrange}}, "", 0, 4, 0, 2};
  EXPECT_GT(drawn(two, kBlue), 100);
  EXPECT_GT(drawn(two, kOrange), 100);
  Figure stray{{{person, {}, kBlue}, {far, {}, kOrange}}, "", 0, 4, 0, 2};
  EXPECT_GT(drawn(stray, kBlue), 100);
  EXPECT_EQ(drawn(stray, kOrange), 0) << "a point far away does not make the person tiny";
  stray.whole = true;
  EXPECT_GT(drawn(stray, kOrange), 0);
}

TEST(Clips, AreShownAtOneRate) {
  Clip clip = toy_clips(12)[0];
  clip.fps = 60;
  for (size_t f = 0; f < 12; ++f) {
    clip.confidence.push_back(0.01 * static_cast<double>(f));
    clip.focus.push_back(Point(static_cast<float>(f), 0, 0));
  }
  const auto numbers = [](const Clip& c) {
    std::vector<int> out;
    for (const Point& p : c.focus) out.push_back(static_cast<int>(p.x()));
    return out;
  };
  const Clip slow = at_rate(clip, 30, 100);
  EXPECT_EQ(numbers(slow), (std::vector<int>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(slow.fps, 30);
  ASSERT_EQ(slow.frames.size(), 6u);
  EXPECT_EQ(slow.frames[3], clip.frames[6]);
  EXPECT_EQ(slow.confidence[3], 0.06);
  EXPECT_TRUE(slow.errors.empty());
  EXPECT_EQ(numbers(at_rate(clip, 30, 4)), (std::vector<int>{0, 2, 4, 6}));
  EXPECT_EQ(numbers(at_rate(clip, 25, 100)), (std::vector<int>{0, 2, 5, 7, 10}));
  EXPECT_EQ(numbers(at_rate(clip, 120, 6)), (std::vector<int>{0, 1, 1, 2, 2, 3}));
  EXPECT_EQ(numbers(at_rate(clip, 60, 100)), numbers(clip));
}

TEST(Sheet, GiantsAreShownWholeAndStraysAreNot) {
  Points person;
  for (int i = 0; i < 1000; ++i)
    person.emplace_back(0.2f * std::sin(static_cast<float>(i)), 0.0018f * static_cast<float>(i), 0);
  Points stray = person, giant = person;
  stray.emplace_back(20, 30, 0);
  for (Point& p : giant) p *= 4;
  for (const Points* usual : {&person, &stray}) {
    EXPECT_EQ(clip_reach(*usual, 0).aside, 1.6f);
    EXPECT_EQ(clip_reach(*usual, 0).high, 3.2f);
  }
  EXPECT_GT(clip_reach(giant, 0).high, 7.2f);
  EXPECT_GT(clip_reach({}, 0).high, 0);
}

TEST(Sheet, MeshInFrontHidesWhatIsBehind) {
  const Points square = {{-1, 0.1f, 0}, {1, 0.1f, 0}, {1, 2, 0}, {-1, 2, 0}};
  const std::vector<Triangle> faces = {{0, 1, 2}, {0, 2, 3}};
  Points behind = square;
  for (Point& p : behind) p.z() -= 0.5f;
  Camera camera;
  camera.target = {0, 1, 0};
  const auto middle = [&](bool back_first) {
    Canvas canvas(32, 32, 2);
    canvas.begin(camera, 0, {}, {});
    if (back_first) canvas.draw_mesh(behind, faces, colour_of(0x0000ff));
    canvas.draw_mesh(square, faces, colour_of(0xff0000));
    if (!back_first) canvas.draw_mesh(behind, faces, colour_of(0x0000ff));
    return canvas.image().at(16, 14);
  };
  EXPECT_EQ(middle(true), middle(false));
  EXPECT_GT(middle(true)[0], middle(true)[2] + 50);
}

TEST(Sheet, AnyNumbersAreDrawnWithoutHarm) {
  const float huge = 3e38f, nan = std::nanf("");
  Clip cloud{
      "stray", {{{0, 1, 0}, {nan, 0, 0}, {huge, huge, -huge}, {0, 0, 4.0f}, {0, 0.5f, 9}}}, {}};
  Clip mesh{"spike",
            {{{0, 0, 0}, {huge, 1, 0}, {0, 1, -huge}, {1e6f, 1e6f, 1e6f}}},
            {{0, 1, 2}, {0, 0, 0}, {0, 2, 3}}};
  SheetOptions options;
  options.cell_height = 60;
  EXPECT_GT(contact_sheet({cloud, mesh}, options).width, 0);
  EXPECT_HAS(page_html({cloud, mesh}), "</html>");
  const Clip nothing{"all stray", {{{nan, nan, nan}}}, {}};
  EXPECT_GT(contact_sheet({nothing}, options).width, 0);
  EXPECT_HAS(page_html({nothing}), "</html>");
}

TEST(Sheet, BadClipsAreRefused) {
  for (const std::vector<Clip>& bad :
       {std::vector<Clip>{}, {{"empty", {}, {}}}, {{"no points", {{}}, {}}}})
    EXPECT_THROW(contact_sheet(bad), InputError);
  for (const Clip& bad : {Clip{"face", {{{0, 0, 0}}}, {{0, 1, 0}}},
                          {"count", {{{0, 0, 0}}, {{0, 0, 0}, {1, 1, 1}}}, {{0, 0, 0}}},
                          {"nan", {{{std::nanf(""), 0, 0}}}, {{0, 0, 0}}}})
    EXPECT_THROW(page_html({bad}), InputError) << bad.label;
}

TEST(Picture, PngIsWellFormedAndTextLeavesInk) {
  Image image(120, 24, {255, 255, 255});
  draw_text(image, 4, 4, 12, {0, 0, 0}, "Frame 12\n\xff");
  std::set<uint8_t> greys(image.rgb.begin(), image.rgb.end());
  EXPECT_GT(greys.size(), 8u);  // antialiased
  EXPECT_LT(*greys.begin(), 60);
  EXPECT_GT(text_width(12, "mm"), text_width(12, "ii"));
  draw_text(image, -50, 20, 12, {0, 0, 0},
            "cut off at every edge, and far longer than the picture");
  const std::string png = png_bytes(image);
  ASSERT_GT(png.size(), 33u);
  EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(png.substr(12, 4), "IHDR");
  EXPECT_EQ(static_cast<unsigned char>(png[19]), 120);
  EXPECT_EQ(png.substr(png.size() - 8, 4), "IEND");
}

std::string base64_of(const std::string& page, const std::string& id) {
  const size_t open = page.find("<script id=\"" + id + "\"");
  const size_t start = page.find('>', open) + 1;
  return page.substr(start, page.find('<', start) - start);
}

TEST(Page, IsOneFileThatAsksForNothing) {
  const PageOptions options{.title = "walk <onto> \"another\" & body @DATA@"};
  auto clips = toy_clips();
  clips[1].label = "</script><b>result \xff";
  const std::string page = page_html(clips, options);
  for (const char* word : {"http:", "https:", "src=", "href=", "@import", "url(", "fetch(",
                           "import(", "XMLHttp", "WebSocket", "</script><b>"})
    EXPECT_EQ(page.find(word), std::string::npos) << word;
  EXPECT_HAS(page, "walk &lt;onto&gt; &quot;another&quot; &amp; body @DATA@");
  size_t frames = 0;
  for (const Points& points : clips[0].frames) frames += std::min<size_t>(points.size(), 2048);
  EXPECT_EQ(base64_of(page, "frames0").size(), (frames * 6 + 2) / 3 * 4);
  EXPECT_EQ(base64_of(page, "faces1").size(), (clips[1].faces.size() * 12 + 2) / 3 * 4);
  EXPECT_EQ(page, page_html(clips, options));
  const std::string plain = page_html(toy_clips(), {});
  keep("page.html", plain);
}

TEST(Page, ErrorsAreABytePerVertexAndFrame) {
  auto clips = toy_clips(3);
  EXPECT_EQ(page_html(clips, {}).find("id=\"errors"), std::string::npos);
  const size_t vertices = clips[1].frames[0].size();
  for (size_t f = 0; f < 3; ++f)
    clips[1].errors.emplace_back(vertices, 0.02f * static_cast<float>(f));
  const std::string page = page_html(clips, {});
  EXPECT_HAS(page, "5 cm</small>");
  const std::string errors = base64_of(page, "errors1");
  EXPECT_EQ(errors.size(), (3 * vertices + 2) / 3 * 4);
  EXPECT_TRUE(errors.starts_with("AAAA"));
  EXPECT_TRUE(errors.ends_with("zMzM") || errors.ends_with("zMw=") || errors.ends_with("zA=="))
      << errors.substr(errors.size() - 8) << ": 4 of 5 cm are 204";
  clips[1].errors[1].pop_back();
  EXPECT_THROW(page_html(clips, {}), InputError);
}

TEST(Page, LongSequencesStayBelowTheLimit) {
  auto clips = toy_clips(60);
  const size_t whole = page_html(clips, {}).size();
  for (const size_t limit : {whole / 3, whole / 10, size_t{150000}}) {
    const std::string page = page_html(clips, {.max_bytes = limit});
    EXPECT_LE(page.size(), limit * 11 / 10 + 30000);
    EXPECT_HAS(page, "Holds one frame in");
  }
  EXPECT_EQ(page_html(toy_clips(), {}).find("Holds one frame in"), std::string::npos);
}

}  // namespace
}  // namespace restage
