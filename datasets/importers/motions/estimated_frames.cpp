// Values that a file has frame by frame, with somebody's number beside each: PHALP, 4DHumans, ROMP.
#include <algorithm>

#include "datasets/importers/motions/estimated_finder.h"
#include "datasets/readers/arrays/body_parameters.h"
#include "datasets/readers/text/text.h"

namespace restage::estimated_detail {
namespace {

/// The numbers of the people of a frame.
constexpr const char* kIds[] = {"tid", "track_ids", "track_id", "tracked_ids", "ids"};

/// A key that names a picture: "img/000104.jpg", "frame_12".
bool is_frame_key(const std::string& key) {
  return text::ends_in(key, {".jpg", ".jpeg", ".png", ".bmp"}) || text::ends_in(key, {".npz"}) ||
         key.starts_with("frame");
}

std::vector<std::string> ids_of(const SharedArray& array) {
  std::vector<std::string> out;
  if (!array || array->header().is_text() || array->header().shape.size() > 1) return out;
  const NpyArray numbers = array->read();
  for (int64_t i = 0; i < numbers.size(); ++i)
    out.push_back(std::to_string(static_cast<int64_t>(std::clamp(numbers[i], -1e15, 1e15))));
  return out;
}

/// A path of somebody: the moments in which there was something, by frame.
struct Track {
  std::vector<size_t> frames;
  std::vector<Arrays> arrays;
};

/// The array of this name in each frame from the first to the last; where there is none, the one
/// before stands.
SharedArray over_time(const Track& track, const std::string& name) {
  std::vector<SharedArray> rows;
  for (size_t k = 0; k < track.frames.size(); ++k) {
    const auto at = track.arrays[k].find(name);
    if (at == track.arrays[k].end()) return nullptr;
    while (k > 0 && rows.size() < track.frames[k] - track.frames[0]) rows.push_back(rows.back());
    rows.push_back(at->second);
  }
  return stacked(rows);
}

/// Frames between the first and the last, counted from the first, in which there was nothing.
std::vector<size_t> missing_of(const std::vector<size_t>& frames) {
  std::vector<size_t> out;
  for (size_t k = 1; k < frames.size(); ++k)
    for (size_t f = frames[k - 1] + 1; f < frames[k]; ++f) out.push_back(f - frames[0]);
  return out;
}

}  // namespace

/// Whether the maps are what a file has of its frames, one each.
bool Finder::are_frames(const std::vector<Child>& children) {
  if (std::all_of(children.begin(), children.end(),
                  [](const Child& child) { return is_frame_key(child.name); }))
    return true;
  size_t moving = 0;
  for (const Child& child : children) {
    const std::map<std::string, Arrays> groups = groups_of(child.map);
    const auto own = groups.find("");
    if (own == groups.end()) continue;
    const int64_t frames = frames_of(own->second);
    if (frames > 1) return false;
    moving += static_cast<size_t>(frames);
  }
  return moving > 1;
}

/// Who is in a frame.
std::vector<Moment> Finder::moments_of(Id frame) {
  std::map<std::string, Arrays> groups = groups_of(frame);
  Arrays own = groups.count("") > 0 ? groups[""] : Arrays();
  std::vector<std::string> ids;
  for (const char* name : kIds)
    if (ids.empty() && own.count(name) > 0) ids = ids_of(own[name]);
  std::vector<Moment> out;
  const std::vector<Id>& items = tree_.items(frame);
  for (size_t i = 0; i + 1 < items.size() && out.empty(); i += 2) {
    if (!tree_.is(items[i + 1], Kind::list)) continue;
    const std::vector<Child> people = children_of(items[i + 1]);
    for (size_t p = 0; p < people.size(); ++p) {
      Arrays arrays = groups_of(people[p].map)[""];
      if (frames_of(arrays) == 0) continue;
      const auto camera = own.find("camera");  // of PHALP: where each of them is
      if (camera != own.end() && camera->second->header().shape.size() == 2 &&
          camera->second->header().shape[0] == static_cast<int64_t>(people.size()) &&
          camera->second->header().shape[1] == 3)
        arrays["cam_trans"] = part_of(camera->second, static_cast<int64_t>(p));
      const bool named = ids.size() == people.size();
      out.push_back({named ? ids[p] : people.size() > 1 ? "?" : "", std::move(arrays)});
    }
  }
  if (!out.empty() || frames_of(own) == 0) return out;
  const int64_t people = frames_of(own);
  for (int64_t p = 0; p < people; ++p) {
    Moment one;
    one.person = ids.size() == static_cast<size_t>(people) ? ids[static_cast<size_t>(p)]
                 : people > 1                              ? "?"
                                                           : "";
    for (const auto& [name, array] : own) {
      const std::vector<int64_t> shape = array->header().shape;
      const bool of_each = shape.size() > 1 && shape[0] == people;
      one.arrays[name] = of_each && is_body_parameter(name) ? part_of(array, p) : array;
    }
    out.push_back(std::move(one));
  }
  return out;
}

void Finder::add_frames(const std::vector<Child>& frames, const Where& where) {
  std::map<std::string, Track> tracks;
  for (size_t f = 0; f < frames.size(); ++f)
    for (Moment& moment : moments_of(frames[f].map)) {
      Track& track = tracks[moment.person];
      if (!track.frames.empty() && track.frames.back() == f && moment.person != "?") continue;
      track.frames.push_back(f);
      track.arrays.push_back(std::move(moment.arrays));
    }
  if (tracks.count("?") > 0) {
    fault_ = InputError(tree_.path(),
                        "shows several people in a frame and does not say who is who from frame to "
                        "frame",
                        "let the estimator track them, or save one person's arrays alone");
    return;
  }
  for (const auto& [person, track] : tracks) {
    Arrays arrays;
    for (const auto& [name, first] : track.arrays[0])
      if (SharedArray whole = over_time(track, name)) arrays[name] = whole;
    if (frames_of(arrays) == 0) continue;
    add(tracks.size() > 1 ? person : "", where.place, std::move(arrays), true,
        missing_of(track.frames));
  }
}

}  // namespace restage::estimated_detail
