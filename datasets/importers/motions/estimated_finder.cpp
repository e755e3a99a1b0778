#include "datasets/importers/motions/estimated_finder.h"

#include <algorithm>
#include <cctype>
#include <set>

#include "datasets/importers/motions/body_rotations.h"
#include "datasets/readers/arrays/body_parameters.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage::estimated_detail {
namespace {

constexpr int kDeepestValue = 16;
constexpr size_t kMostLooks = 4'000'000;

std::vector<std::string> names_of(const Arrays& arrays) {
  std::vector<std::string> out;
  for (const auto& [name, array] : arrays) out.push_back(name);
  return out;
}

BodyParameters parameters_of(const Arrays& arrays) { return body_parameters(names_of(arrays)); }

/// What is said once for all that lies below: the rate, whose body it is, where it goes, when.
bool is_said_for_all(const std::string& name) {
  for (const char* rate : {"mocap_framerate", "mocap_frame_rate", "mocap_fps", "fps", "frame_rate",
                           "framerate", "gender", "surface_model_type"})
    if (name == rate) return true;
  if (numbers_frames(name)) return true;
  const BodyParameters of = body_parameters(std::vector<std::string>{name});
  return !of.trans.empty() || !of.betas.empty();
}

/// Of the joints, which alone say where a motion is.
bool is_rotations(const std::string& name) {
  const BodyParameters of = body_parameters(std::vector<std::string>{name});
  return !of.poses.empty() || !of.body.empty();
}

/// A key that may be a name; empty for others, among them texts of a megabyte that would be copied
/// at each of many looks.
std::string short_key(const ValueTree& tree, ValueTree::Id id) {
  constexpr size_t kLongest = 1000;
  if (tree.is(id, ValueTree::Kind::text) && tree.text(id).size() > kLongest) return "";
  return tree.key(id);
}

/// A key that stands for somebody: "3", "person_1", "track0".
bool is_person_key(const std::string& key) {
  std::string rest = lower_case(key);
  for (const char* word : {"person", "track", "subject", "human", "people", "tid", "id"})
    if (rest.starts_with(word)) {
      rest.erase(0, std::string(word).size());
      break;
    }
  while (!rest.empty() && (rest[0] == '_' || rest[0] == '-' || rest[0] == ' ')) rest.erase(0, 1);
  return !rest.empty() && std::all_of(rest.begin(), rest.end(),
                                      [](unsigned char c) { return std::isdigit(c) != 0; });
}

/// Whether the words of a place speak of the world (0) or of a camera (2); 1: neither.
int rank_of(const std::string& place, const BodyParameters& names) {
  const auto says = [](const std::string& text, std::initializer_list<const char*> words) {
    const std::string low = lower_case(text);
    return std::any_of(words.begin(), words.end(),
                       [&](const char* word) { return low.find(word) != std::string::npos; });
  };
  if (says(place, {"world", "global"})) return 0;
  if (says(place, {"cam"})) return 2;
  const std::string used = cat(names.poses, " ", names.body, " ", names.trans);
  if (says(used, {"world"})) return 0;
  if (says(used, {"cam"})) return 2;
  return 1;
}

/// Whether numbers of the camera that saw it stand beside a motion (TRAM, VIBE, ROMP).
bool tells_of_camera(const Arrays& arrays) {
  return std::any_of(std::begin(kCameraNames), std::end(kCameraNames),
                     [&](const char* name) { return arrays.count(name) > 0; });
}

/// The arrays that a motion is made of, with what says more of it.
Arrays used_of(const Arrays& arrays, const BodyParameters& names) {
  Arrays out;
  for (const auto& [name, array] : arrays) {
    const bool one = name == names.poses || name == names.orient || name == names.body ||
                     name == names.trans || name == names.betas || name == names.scaling ||
                     name == names.scale;
    if (one || is_said_for_all(name)) out[name] = array;
  }
  return out;
}

/// Whether both the number of joints and the parts are a body's.
bool is_plausible(const Arrays& arrays, const BodyParameters& names) {
  const auto joints = [&](const std::string& name) {
    const NpyHeader header = arrays.at(name)->header();
    return header.is_text() ? 0 : rotated_joints(header.shape);
  };
  if (!names.poses.empty() && (names.orient.empty() || names.body.empty()))
    return joints(names.poses) > 20;
  return joints(names.body) > 20 && joints(names.orient) == 1;
}

}  // namespace

std::vector<NameParts> name_parts(const std::string& name) {
  std::vector<NameParts> out;
  if (is_body_parameter(name)) out.push_back({"", name});
  for (size_t at = 0; at < name.size(); ++at) {
    const char c = name[at];
    if (c != '.' && c != '_' && c != '/' && c != ':') continue;
    const std::string rest = name.substr(at + 1);
    if (!rest.empty() && is_body_parameter(rest)) out.push_back({name.substr(0, at), rest});
  }
  return out;
}

int64_t frames_of(const Arrays& arrays) {
  const BodyParameters names = parameters_of(arrays);
  if (!names.moves()) return 0;
  const bool parts = !names.orient.empty() && !names.body.empty();
  const NpyHeader header = arrays.at(parts ? names.body : names.poses)->header();
  const std::vector<int64_t>& shape = header.shape;
  if (shape.size() < 2) return 1;
  const bool matrices = shape.size() == 3 && shape[1] == 3 && shape[2] == 3;
  return matrices ? 1 : shape[0];
}

void Finder::count_look() {
  if (++looks_ > kMostLooks)
    throw InputError(tree_.path(), "holds too many values to look through",
                     "save the arrays that matter alone with numpy.savez");
}

// ---- values as arrays --------------------------------------------------------------------------

SharedArray Finder::list_of_numbers(Id id) {
  std::vector<double> out;
  for (const Id item : tree_.items(id)) {
    count_look();
    if (!tree_.is(item, Kind::number) && !tree_.is(item, Kind::truth)) return nullptr;
    out.push_back(tree_.number(item));
  }
  if (out.empty()) return nullptr;
  return shared_numbers({std::ssize(out)}, out, tree_.path());
}

/// An array, a number, text, or a list of such of one shape; null for anything else.
SharedArray Finder::gathered(Id id, int depth) {
  count_look();
  switch (tree_.kind(id)) {
    case Kind::array:
      return tree_.array(id);
    case Kind::number:
    case Kind::truth:
      return shared_numbers({}, {tree_.number(id)}, tree_.path());
    case Kind::text: {
      const std::string& text = tree_.text(id);
      if (text.empty() || text.size() > 1000) return nullptr;
      return shared_array(NpyArray(npy_header_of(cat("|S", text.size()), {}, tree_.path()),
                                   {text.begin(), text.end()}, tree_.path()));
    }
    case Kind::list: {
      std::vector<SharedArray> parts;
      if (depth > 4) return nullptr;
      if (SharedArray numbers = list_of_numbers(id)) return numbers;
      for (const Id item : tree_.items(id)) {
        if (tree_.is(item, Kind::map)) return nullptr;
        parts.push_back(gathered(item, depth + 1));
        if (!parts.back()) return nullptr;
      }
      SharedArray out = stacked(parts);
      if (out && out->header().bytes() > max_memory_) return nullptr;
      return out;
    }
    default:
      return nullptr;
  }
}

/// The arrays of a map, by what stands before the names of parameters. Where a name could be parted
/// in several ways (global_transl of smpl_params, transl of smpl_params_global), the place that has
/// rotations counts.
std::map<std::string, Arrays> Finder::groups_of(Id map) {
  std::vector<std::pair<std::string, SharedArray>> all;
  std::set<std::string> places;
  const std::vector<Id>& items = tree_.items(map);
  for (size_t i = 0; i + 1 < items.size(); i += 2) {
    const std::string key = short_key(tree_, items[i]);
    if (key.empty()) continue;
    const SharedArray array = gathered(items[i + 1]);
    if (!array) continue;
    all.emplace_back(key, array);
    const std::vector<NameParts> parts = name_parts(key);
    if (!parts.empty() && is_rotations(parts[0].name)) places.insert(parts[0].place);
  }
  std::map<std::string, Arrays> out;
  for (const auto& [key, array] : all) {
    const std::vector<NameParts> parts = name_parts(key);
    NameParts chosen = parts.empty() ? NameParts{"", key} : parts[0];
    for (const NameParts& one : parts)
      if (places.count(chosen.place) == 0 && places.count(one.place) > 0) chosen = one;
    out[chosen.place][chosen.name] = array;
  }
  return out;
}

/// The maps in a map or a list.
std::vector<Finder::Child> Finder::children_of(Id id) {
  std::vector<Child> out;
  if (tree_.is(id, Kind::list)) {
    const std::vector<Id>& items = tree_.items(id);
    for (size_t i = 0; i < items.size(); ++i) {
      count_look();
      if (tree_.is(items[i], Kind::map)) out.push_back({std::to_string(i), items[i]});
    }
  } else if (tree_.is(id, Kind::map)) {
    const std::vector<Id>& items = tree_.items(id);
    for (size_t i = 0; i + 1 < items.size(); i += 2) {
      count_look();
      if (tree_.is(items[i + 1], Kind::map))
        out.push_back({short_key(tree_, items[i]), items[i + 1]});
    }
  }
  return out;
}

// ---- the search --------------------------------------------------------------------------------

std::vector<Found> Finder::find() {
  if (tree_.size() > 0) look(tree_.root, {});
  return std::move(found_);
}

void Finder::look(Id id, const Where& where) {
  count_look();
  if (where.depth > kDeepestValue) return;
  if (tree_.is(id, Kind::list)) return look_at_children(children_of(id), where, {});
  if (!tree_.is(id, Kind::map)) return;
  std::map<std::string, Arrays> groups = groups_of(id);
  for (const auto& [prefix, arrays] : groups) {
    Where here = where;
    if (!prefix.empty())
      for (const auto& [name, array] : groups[""])
        if (is_said_for_all(name)) here.above[name] = array;
    add_group(prefix, arrays, here);
  }
  const Arrays own = groups.count("") > 0 ? groups[""] : Arrays();
  look_at_children(children_of(id), where, own);
  const std::vector<Id>& items = tree_.items(id);
  for (size_t i = 0; i + 1 < items.size(); i += 2) {
    if (!tree_.is(items[i + 1], Kind::list) || children_of(items[i + 1]).empty()) continue;
    Where below = where;
    below.place += (below.place.empty() ? "" : ".") + short_key(tree_, items[i]);
    ++below.depth;
    look(items[i + 1], below);
  }
}

void Finder::look_at_children(const std::vector<Child>& children, const Where& where,
                              const Arrays& here) {
  if (children.empty()) return;
  if (are_frames(children)) return add_frames(children, where);
  const bool people = std::all_of(children.begin(), children.end(),
                                  [](const Child& child) { return is_person_key(child.name); });
  for (const Child& child : children) {
    Where below = where;
    ++below.depth;
    for (const auto& [name, array] : here)
      if (is_said_for_all(name)) below.above[name] = array;
    if (people)
      below.person = child.name;
    else
      below.place += (below.place.empty() ? "" : ".") + child.name;
    look(child.map, below);
  }
}

void Finder::add_group(const std::string& prefix, const Arrays& own, const Where& where) {
  BodyParameters names = parameters_of(own);
  if (!names.moves()) return;
  Arrays arrays = own;
  for (const auto& [name, array] : where.above) {
    const BodyParameters of = body_parameters(std::vector<std::string>{name});
    const bool known =
        (!of.trans.empty() && !names.trans.empty()) || (!of.betas.empty() && !names.betas.empty());
    if (!known) arrays.emplace(name, array);
  }
  const std::string place =
      where.place + (where.place.empty() || prefix.empty() ? "" : ".") + prefix;
  if (split_people(place, arrays)) return;
  if (!is_plausible(own, names)) return;
  add(where.person, place, std::move(arrays), false);
}

/// Arrays whose first axis counts people: a motion of each.
bool Finder::split_people(const std::string& place, const Arrays& arrays) {
  const BodyParameters names = parameters_of(arrays);
  const bool parts = !names.orient.empty() && !names.body.empty();
  const std::vector<int64_t> shape = arrays.at(parts ? names.body : names.poses)->header().shape;
  if (shape.size() < 3 || shape[0] < 1) return false;
  const int64_t last = shape.back(), people = shape[0], frames = shape[1];
  const bool squares = last == 3 && shape[shape.size() - 2] == 3;
  const bool flat = shape.size() == 3 && last >= 63 && frames > 1;
  const bool joints = shape.size() == 4 && !squares && frames > 1;
  if (!flat && !joints && shape.size() != 5) return false;
  std::vector<std::string> ids;
  for (const char* name : {"track_id", "track_ids", "person_ids", "ids"})
    if (arrays.count(name) > 0 && arrays.at(name)->header().shape == std::vector<int64_t>{people}) {
      const NpyArray numbers = arrays.at(name)->read();
      for (int64_t i = 0; i < people && !numbers.is_text(); ++i)
        ids.push_back(std::to_string(static_cast<int64_t>(std::clamp(numbers[i], -1e15, 1e15))));
    }
  for (int64_t person = 0; person < people; ++person) {
    Arrays own;
    for (const auto& [name, array] : arrays) {
      const std::vector<int64_t> size = array->header().shape;
      const bool of_people = !size.empty() && size[0] == people &&
                             (size.size() == 1 || size[1] == frames || name == names.betas);
      own[name] = of_people && (size.size() > 1 || people > 1) ? part_of(array, person) : array;
    }
    if (!is_plausible(own, parameters_of(own))) return false;
    std::string id = people == 1 ? "" : std::to_string(person);
    if (ids.size() == static_cast<size_t>(people) && people > 1)
      id = ids[static_cast<size_t>(person)];
    add(id, place, std::move(own), false);
  }
  return true;
}

void Finder::add(const std::string& person, const std::string& place, Arrays arrays, bool by_frames,
                 std::vector<size_t> missing) {
  BodyParameters names = parameters_of(arrays);
  Found out;
  out.rank = rank_of(place, names);
  if (out.rank == 1 && tells_of_camera(arrays)) out.rank = 2;
  out.by_frames = by_frames;
  out.motion.person = person;
  out.motion.place = place;
  out.motion.hints = {
      .world = out.rank == 0, .camera = out.rank == 2, .missing = std::move(missing)};
  if (const size_t n = out.motion.hints.missing.size(); n > 0)
    out.motion.hints.remarks.push_back(
        cat(counted(n, "frame"), " without this person: interpolated"));
  arrays = used_of(arrays, names);
  if (names.trans.empty()) {
    const int64_t frames = frames_of(arrays);
    if (frames < 1 || frames > (int64_t{1} << 22)) return;
    arrays["transl"] = shared_numbers(
        {frames, 3}, std::vector<double>(3 * static_cast<size_t>(frames), 0.0), tree_.path());
    out.motion.hints.remarks.emplace_back(
        "the file does not say where the body goes (trans): it stays in its place");
  }
  if (!by_frames) fill_left_out(arrays, out.motion.hints, tree_.path());
  const auto gathered = std::make_shared<GatheredArrays>(tree_.path());
  // Under AMASS's own two names, a rate and z up would be taken for granted.
  for (const auto& [name, array] : arrays) gathered->put(name == "trans" ? "transl" : name, array);
  out.motion.arrays = gathered;
  found_.push_back(std::move(out));
}

}  // namespace restage::estimated_detail
