#include "experiments/cli/doctor/doctor_people.h"

#include <algorithm>
#include <vector>

#include "autograd/base/format.h"
#include "autograd/base/output_check.h"
#include "autograd/base/words.h"
#include "datasets/doctor/people.h"
#include "datasets/readers/text/text.h"
#include "experiments/source.h"

namespace restage::cli {
namespace {

struct Seen {
  size_t number = 0;  ///< as the tracker counts
  int64_t frames = 0, first = -1, last = -1;
  Point middle = Point::Zero();  ///< where it is seen first
};

/// Calls `f` with the people of each frame.
template <class F>
void follow(Source& source, F&& f) {
  source.rewind();
  PeopleTracker tracker;
  for (int64_t frame = 0; auto cloud = source.next(); ++frame)
    f(frame,
      cloud->fault ? std::vector<Points>(tracker.people()) : tracker.follow(cloud->frame.points));
}

std::vector<Seen> everybody(Source& source) {
  std::vector<Seen> out;
  follow(source, [&](int64_t frame, const std::vector<Points>& people) {
    for (size_t p = 0; p < people.size(); ++p) {
      if (out.size() <= p) out.push_back({.number = p});
      if (people[p].empty()) continue;
      if (out[p].frames++ == 0) {
        out[p].first = frame;
        for (const Point& x : people[p]) out[p].middle += x;
        out[p].middle /= static_cast<float>(people[p].size());
      }
      out[p].last = frame;
    }
  });
  return out;
}

void write(Source& source, const std::vector<Seen>& people, const std::string& out) {
  FileInfo info;
  info.provenance = "people of " + source.record().path + " told apart";
  ScanWriter writer(out, info, source.fps());
  for (const Seen& one : people) {
    follow(source, [&](int64_t frame, const std::vector<Points>& all) {
      if (frame < one.first || frame > one.last) return;
      writer.append(one.number < all.size() ? all[one.number] : Points());
    });
    writer.end_sequence();
  }
  writer.commit();
}

}  // namespace

int run_doctor_people(const SourceRecord& record, const std::optional<std::string>& out,
                      const Common& common) {
  if (out && !text::ends_in(*out, {".h5", ".hdf5"}))
    throw InputError(*out, "cannot hold a sequence for each person", "give OUT.h5");
  check_output(out.value_or(""), {record.path});
  Source source(record, common.max_memory);
  const std::vector<Seen> people = everybody(source);
  if (people.empty())
    throw InputError(
        record.path, "shows nobody: no piece of its clouds is half a metre large",
        "give the unit with --scale; if a floor or a wall is in the clouds, take it out first "
        "with restage doctor --fix");
  if (out) write(source, people, *out);
  Json list = Json::array();
  std::string words = cat(record.path, ": ", counted(people.size(), "person", "people"), " in ",
                          counted(static_cast<size_t>(source.frames()), "frame"), "\n");
  for (const Seen& one : people) {
    list.push_back({{"person", one.number},
                    {"frames", one.frames},
                    {"first", one.first},
                    {"last", one.last},
                    {"middle", {one.middle.x(), one.middle.y(), one.middle.z()}}});
    words += cat("  person ", one.number, ": in ", one.frames, " frames, ", one.first, " to ",
                 one.last, "; first at ",
                 format("%.2f, %.2f, %.2f m", double{one.middle.x()}, double{one.middle.y()},
                        double{one.middle.z()}),
                 "\n");
  }
  words += out ? cat("wrote ", *out,
                     ": sequence N is person N, from the first to the last frame that shows the "
                     "person\n")
               : cat("restage retarget --person N follows one of them\n");
  Json document = {{"file", record.path}, {"frames", source.frames()}, {"people", list}};
  if (out) document["out"] = *out;
  print(common.json, document, words);
  return 0;
}

}  // namespace restage::cli
