// restage track --texture: colours of the scans on the template that was made from them.
#include <algorithm>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "datasets/characters/coloured_points.h"
#include "datasets/doctor/cloud_door.h"
#include "experiments/cli/perform/track.h"
#include "experiments/slow_work.h"
#include "infer/track/texture_fit.h"

namespace restage::cli {
namespace {

constexpr int64_t kColourViews = 24;  // as many equal pieces of the take give their best frame
constexpr int kCoarse = 512, kFine = 1024;  // texels
constexpr size_t kManyPoints = 60000;       // from which on there is something for finer texels

/// Of each piece of the take the frame whose points lie nearest to the surface.
std::vector<int64_t> best_frames(const TrackTake& take) {
  std::vector<int64_t> out;
  const int64_t frames = take.frames();
  for (int64_t piece = 0; piece < kColourViews; ++piece) {
    std::optional<int64_t> best;
    const auto distance = [&](int64_t f) { return take.distance[static_cast<size_t>(f)]; };
    for (int64_t f = piece * frames / kColourViews; f < (piece + 1) * frames / kColourViews; ++f)
      if (distance(f) && (!best || distance(f)->p95 < distance(*best)->p95)) best = f;
    if (best) out.push_back(*best);
  }
  return out;
}

[[noreturn]] void refuse(const std::string& source) {
  throw InputError(source, "has no colours of points that could be collected",
                   "give a folder of PLY or OBJ files with colours, or leave --texture out");
}

ColouredPoints coloured(const std::string& file, const SourceRecord& how) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) refuse(how.path);
  auto out = read_coloured_points(file);
  if (!out) refuse(file);
  ToOurs(how.scale, how.up)(out->points);
  return std::move(*out);
}

}  // namespace

void check_colours(Source& source) {
  for (auto cloud = source.next(); cloud; cloud = source.next())
    if (!cloud->fault) {
      coloured(cloud->frame.source, source.record());
      break;
    }
  source.rewind();
}

Json make_texture(Source& source, const TrackWork& work, const Tracker& tracker,
                  const TrackJournal& journal, const TrackTake& take) {
  SlowWork slow;
  const Body& body = tracker.body();
  const Atlas atlas = template_atlas(body);
  std::optional<TextureFit> fit;
  int size = kCoarse;
  source.rewind();
  int64_t at = 0;
  const std::vector<int64_t> frames = best_frames(take);
  for (const int64_t frame : frames) {
    slow.on(format("colours, frame %lld", static_cast<long long>(frame + 1)));
    source.skip(frame - at);
    at = frame + 1;
    const auto cloud = source.next();
    if (!cloud || cloud->fault) continue;
    const ColouredPoints some = coloured(cloud->frame.source, source.record());
    if (!fit) {
      size = some.points.size() > kManyPoints ? kFine : kCoarse;
      fit.emplace(body.rest, atlas, size);
    }
    std::vector<Vec3> points;
    for (const Point& p : some.points) points.push_back(p.cast<double>());
    const JournalFrame known = journal.read(frame);
    fit->add(tracker.surface(known.pose, known.points), points, some.colours);
  }
  if (!fit) refuse(source.record().path);
  slow.on("colours, the picture");
  write_jpeg(work.file("template.jpg"), fit->picture());
  write_file_atomically(work.file("template.mtl"),
                        "newmtl template\nKd 1 1 1\nmap_Kd template.jpg\n");
  write_file_atomically(auto_template_mesh(work), template_obj(body, atlas, true));
  return {{"size", size}, {"frames", frames.size()}, {"seen", fit->seen()}};
}

}  // namespace restage::cli
