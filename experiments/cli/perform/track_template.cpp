// restage track --template auto: who is tracked, made from the clouds that show the person best.
#include <algorithm>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "datasets/builtin/shape_space.h"
#include "experiments/cli/perform/track.h"
#include "experiments/slow_work.h"
#include "infer/registration/registration.h"
#include "infer/track/atlas.h"
#include "infer/track/template_fit.h"
#include "nn/geometry/mesh_file.h"

namespace restage::cli {
namespace {

constexpr int64_t kTemplateViews = 16;  // as many equal pieces of the take give their best cloud
constexpr double kSeenCell = 0.04;      // metres: how much of somebody is seen counts in cubes

/// The clouds that show most, where the extractor is sure.
class BestViews {
 public:
  explicit BestViews(int64_t frames) : frames_(frames), best_(kTemplateViews) {}
  void add(int64_t frame, const Points& cloud, const std::string& source, const Joints& seen,
           const RetargetedFrame& answer) {
    const double sure = answer.confidence.value_or(1);
    const double score = sure * static_cast<double>(thinned(cloud, kSeenCell, source).size());
    Slot& slot = best_[static_cast<size_t>(frame * kTemplateViews / frames_)];
    if (!(score > slot.score)) return;
    slot = {score, {cloud, source, answer.pose, seen}};
  }
  std::vector<TemplateView> take() {
    std::vector<TemplateView> out;
    for (Slot& slot : best_)
      if (slot.score > 0) out.push_back(std::move(slot.view));
    return out;
  }

 private:
  struct Slot {
    double score = 0;
    TemplateView view;
  };
  int64_t frames_;
  std::vector<Slot> best_;
};

std::vector<TemplateView> best_views(const TrackCommand& c, Source& source, System& system,
                                     SlowWork& slow) {
  CloudDoor door(frame_of(source.record()), c.how.options.force, true);
  BestViews best(source.frames());
  std::optional<RetargetedFrame> answer;
  for (int64_t frame = 0; auto cloud = source.next(); ++frame) {
    slow.on(format("looking for the best frames, %lld of %lld", static_cast<long long>(frame + 1),
                   static_cast<long long>(source.frames())));
    answer.reset();
    const Points& points = cloud->frame.points;
    const std::string& name = cloud->frame.source;
    if (!cloud->fault) try {
        door.pass(points, name, [&] {
          system.push(points, name, [&](const RetargetedFrame& f) { answer = f; });
        });
      } catch (const UnusableCloud&) {
      }
    if (answer)
      best.add(frame, points, name, *system.source_joints(), *answer);
    else
      system.miss();
  }
  source.rewind();
  return best.take();
}

/// Parts of a body whose charts are kept apart: trunk, head, arms, legs.
std::vector<int> parts_of(const Body& body) {
  constexpr std::array<int, kJoints> kPart = {0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1,
                                              2, 3, 0, 0, 3, 4, 5, 4, 5, 4, 5};
  std::vector<int> out;
  for (Eigen::Index v = 0; v < body.weights.rows(); ++v) {
    Eigen::Index most = 0;
    body.weights.row(v).maxCoeff(&most);
    out.push_back(kPart[static_cast<size_t>(most)]);
  }
  return out;
}

}  // namespace

Atlas template_atlas(const Body& body) { return make_atlas(body.rest, parts_of(body)); }

std::string template_obj(const Body& body, const Atlas& atlas, bool texture) {
  std::string out = comment_of(MeshFormat::obj);
  if (texture) out += "mtllib template.mtl\nusemtl template\n";
  for (const Point& p : body.rest.vertices)
    out += format("v %.9g %.9g %.9g\n", double{p.x()}, double{p.y()}, double{p.z()});
  for (const Eigen::Vector2f& p : atlas.places)
    out += format("vt %.7g %.7g\n", double{p.x()}, double{p.y()});
  for (size_t f = 0; f < body.rest.faces.size(); ++f) {
    out += "f";
    for (size_t k = 0; k < 3; ++k)
      out += format(" %d/%d", body.rest.faces[f][k] + 1, atlas.corners[f][k] + 1);
    out += "\n";
  }
  return out;
}

std::string auto_template_mesh(const TrackWork& work) { return work.file("template.obj"); }

Body auto_template(const TrackCommand& c, const Common& common, Source& source,
                   const TrackWork& work) {
  const std::string file = work.file("template.h5");
  if (is_there(file)) return read_bodies(file).at(0);
  SlowWork slow;
  slow.on("making our own body");
  const ShapeSpace space = builtin_shape_space();
  RetargetCommand how = c.how;
  how.options.late = false;
  how.target = "--template auto";
  SystemInput input = load_input(how, common);
  input.target = space.average.rest;
  input.rest = space.average.joints;
  const auto system = make_system(system_type(how.system), std::move(input));
  const std::vector<TemplateView> views = best_views(c, source, *system, slow);
  Body body = fit_template(space, views, c.how.source.path,
                           [&](const std::string& what) { slow.on(what); });
  body.id = "template";
  body.split = "test";
  slow.on("texture coordinates");
  write_file_atomically(auto_template_mesh(work), template_obj(body, template_atlas(body), false));
  write_bodies(file, {body}, FileInfo{});
  slow.on("");
  log_info(format(
      "template from %zu frames: %.2f m high, %zu vertices", views.size(),
      [&] {
        float top = 0;
        for (const Point& p : body.rest.vertices) top = std::max(top, p.y());
        return double{top};
      }(),
      body.rest.vertices.size()));
  return read_bodies(file).at(0);  // the same numbers as a run that goes on
}

}  // namespace restage::cli
