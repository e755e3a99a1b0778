// Close-ups of bodies of any proportions: the part is seen whole, from outside of the body.
#include "experiments/pictures/look.h"

#include <gtest/gtest.h>

#include <cmath>

#include "datasets/builtin/bodies.h"
#include "infer/render/film.h"
#include "infer/render/stand.h"
#include "infer/render/style.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

/// The built-in body, whose head, hands or arms are so many times as large.
struct Proportions {
  double all = 1, head = 1, hands = 1, arms = 1;
};

void grow(Body& body, int joint, double times) {
  const Vec3 at = body.joints[joint];
  for (size_t v = 0; v < body.rest.vertices.size(); ++v) {
    const double share = times - 1;
    const auto weight = double{body.weights(static_cast<Eigen::Index>(v), joint)};
    Point& p = body.rest.vertices[v];
    p += (share * weight * (p.cast<double>() - at)).cast<float>();
  }
}

Body body_of(const Proportions& how) {
  Body body = builtin_average_body();
  grow(body, kHead, how.head);
  for (const int hand : {kLeftWrist, kRightWrist}) grow(body, hand, how.hands);
  for (const int side : {0, 1}) {
    const int shoulder = side ? kRightShoulder : kLeftShoulder,
              elbow = side ? kRightElbow : kLeftElbow, wrist = side ? kRightWrist : kLeftWrist;
    const Vec3 from = body.joints[shoulder];
    for (size_t v = 0; v < body.rest.vertices.size(); ++v) {
      const auto row = body.weights.row(static_cast<Eigen::Index>(v));
      const auto arm = double{row[shoulder] + row[elbow] + row[wrist]};
      float& x = body.rest.vertices[v].x();
      x += static_cast<float>((how.arms - 1) * arm * (double{x} - from.x()));
    }
    for (const int j : {elbow, wrist}) body.joints[j].x() *= how.arms;
  }
  for (Point& p : body.rest.vertices) p *= static_cast<float>(how.all);
  for (Vec3& joint : body.joints) joint *= how.all;
  return body;
}

Clip clip_of(const Body& body) {
  Clip clip;
  clip.faces = body.rest.faces;
  clip.frames.push_back(body.rest.vertices);
  return clip;
}

const Proportions kBodies[] = {{}, {4}, {1, 4}, {1, 7, 3}, {1, 1, 1, 0.4}, {0.3, 3, 1, 0.3}};
const char* const kParts[] = {"head", "hands", "left-hand", "right-hand", "feet", "left_wrist"};

TEST(Look, TheCameraIsOutsideOfTheBody) {
  for (const Proportions& how : kBodies) {
    const Body body = body_of(how);
    const Clip clip = clip_of(body);
    for (const std::string part : kParts)
      for (int azimuth = -180; azimuth < 180; azimuth += 30) {
        const Aim aim = aim_at({body.joints}, {part, {}}, clip);
        Camera camera;
        camera.azimuth = radians(azimuth);
        camera.elevation = radians(9);
        camera.target = aim.focus.at(0);
        const auto tall = static_cast<float>(2 * aim.close_up);
        const float before = before_target(camera, body.rest.vertices, true);
        stand_outside(camera, tall, before);
        EXPECT_GT(camera.distance, before + 0.05f * tall) << part << " from " << azimuth;
        EXPECT_NEAR(2 * camera.distance * std::tan(0.5f * camera.view), tall, 1e-3f * tall);
      }
  }
}

/// How much of a picture is not the background.
double covered(const Image& image) {
  double out = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) out += image.at(x, y) != image.at(0, 0);
  return out / (image.width * image.height);
}

TEST(Look, LargeHeadsAreSeenWhole) {
  for (const double times : {1.0, 2.0, 4.0, 7.0}) {
    const Body body = body_of({.all = 1, .head = times});
    Clip clip = clip_of(body);
    Aim aim = aim_at({body.joints}, {"head", {}}, clip);
    Box head;
    for (size_t v = 0; v < clip.frames[0].size(); ++v)
      if (body.weights(static_cast<Eigen::Index>(v), kHead) > 0.9f) head.extend(clip.frames[0][v]);
    const Point off = (head.center() - aim.focus[0]).cwiseAbs() + 0.5f * head.sizes();
    EXPECT_LT(double{off.y()}, 1.2 * aim.close_up) << times;  // the chin may be the neck's
    EXPECT_LT(double{off.x()}, 1.05 * aim.close_up) << times;
    EXPECT_LT(aim.close_up, 2.2 * head.sizes().maxCoeff()) << times;
    clip.focus = aim.focus;
    std::vector<std::string> remarks;
    FilmOptions options;
    options.height = 90;
    options.close_up = aim.close_up;
    Film(clip, options, remarks).draw({0}, [&](const Image& image) {
      EXPECT_GT(covered(image), 0.1) << times;
      EXPECT_LT(covered(image), 0.9) << times;
    });
  }
}

TEST(Look, WhatPeopleSeeOfAPersonStays) {
  const Body body = body_of({});
  const Clip clip = clip_of(body);
  const double leg = leg_length(body.joints) / 0.85;
  for (const auto& [part, reach] : {std::pair("head", 0.2), {"left-hand", 0.18}}) {
    const double seen = aim_at({body.joints}, {part, {}}, clip).close_up;
    EXPECT_GE(seen, reach * leg - 1e-6) << part;
    EXPECT_LT(seen, 1.3 * reach * leg) << part;
  }
  EXPECT_EQ(aim_at({body.joints}, {"head", 0.05}, clip).close_up, 0.05);
}

TEST(Film, ACloseUpIsNotTakenFromWithin) {
  // A long beam from the focus to far behind the usual camera of a close-up, seen end on.
  Clip clip;
  Points beam;
  for (const float z : {0.0f, 3.0f})
    for (const float y : {0.95f, 1.05f})
      for (const float x : {-0.05f, 0.05f}) beam.push_back({x, y, z});
  clip.frames.push_back(beam);
  clip.faces = {{4, 5, 7}, {4, 7, 6}};  // its end
  clip.focus = {Point(0, 1, 0)};
  std::vector<std::string> remarks;
  FilmOptions options;
  options.height = options.width = 60;
  options.azimuth = options.elevation = 0;
  options.close_up = 0.2;
  Film(clip, options, remarks).draw({0}, [&](const Image& image) {
    EXPECT_NE(image.at(30, 30), image.at(0, 0)) << "the end is seen";
    EXPECT_EQ(image.at(2, 30), image.at(0, 0)) << "not as if it were before one's eyes";
  });
}

}  // namespace
}  // namespace restage
