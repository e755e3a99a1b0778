// Joints in JSON: Azure Kinect, OpenPose, EasyMocap, MMPose, bare lists, and lines of them.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "autograd/base/atomic_file.h"
#include "datasets/importers/joints/joint_lines.h"
#include "datasets/importers/joints/times.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/frame_names.h"
#include "datasets/readers/text/text.h"

namespace restage::joints_detail {
namespace {

using Json = nlohmann::json;

double number_in(const Json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

/// [[x, y, z], ...] or [[x, y, z, confidence], ...]; {x, y, z} objects count too.
FileFrame frame_of_rows(const Json& rows) {
  FileFrame out;
  for (const Json& row : rows) {
    if (row.is_object() && row.contains("x") && row.contains("y") && row.contains("z")) {
      const double sure = row.contains("visibility") ? number_in(row["visibility"]) : 1;
      out.push_back(joint_at(number_in(row["x"]), number_in(row["y"]), number_in(row["z"]), sure,
                             out.empty()));
    } else if (row.is_array() && row.size() >= 3) {
      const double sure = row.size() > 3 ? number_in(row[3]) : 1;
      out.push_back(
          joint_at(number_in(row[0]), number_in(row[1]), number_in(row[2]), sure, out.empty()));
    } else {
      out.emplace_back();
    }
  }
  return out;
}

/// [x, y, z, confidence, x, ...]
FileFrame frame_of_fours(const Json& flat) {
  FileFrame out;
  for (size_t i = 0; i + 3 < flat.size(); i += 4)
    out.push_back(joint_at(number_in(flat[i]), number_in(flat[i + 1]), number_in(flat[i + 2]),
                           number_in(flat[i + 3]), out.empty()));
  return out;
}

bool is_row(const Json& value) {
  return (value.is_array() && value.size() >= 3 && (value[0].is_number() || value[0].is_null())) ||
         (value.is_object() && value.contains("x"));
}

/// Of joints that are not known a row may be null.
bool is_rows(const Json& value) {
  return value.is_array() &&
         std::all_of(
             value.begin(), value.end(),
             [](const Json& row) { return row.is_object() || row.is_array() || row.is_null(); }) &&
         std::any_of(value.begin(), value.end(), is_row);
}

/// Names of joints, in the order in which they first came.
struct Names {
  std::vector<std::string> all;
  bool used = false;    ///< frames call their joints so
  bool listed = false;  ///< frames have joints without names
};

/// {"left_hip": [x, y, z], ...}
bool is_named_rows(const Json& value) {
  return value.is_object() && std::any_of(value.begin(), value.end(), is_row);
}

/// Each joint at the place of its name; names that are new are put behind the others.
FileFrame frame_of_names(const Json& rows, Names& names) {
  names.used = true;
  FileFrame out(names.all.size());
  for (const auto& [name, row] : rows.items()) {
    const auto at = static_cast<size_t>(std::find(names.all.begin(), names.all.end(), name) -
                                        names.all.begin());
    if (at == names.all.size()) names.all.push_back(name), out.emplace_back();
    out[at] = frame_of_rows(Json::array({row}))[0];  // 0 0 0 is a place: others are left out
  }
  return out;
}

/// One moment of a file: the people in it, and when it was.
struct Moment {
  std::map<int64_t, FileFrame> people;  ///< by their ids, else by their places in the list
  double seconds = std::numeric_limits<double>::quiet_NaN();
};

struct Parsed {
  std::vector<Moment> moments;
  Names names;         ///< of joints, where the file calls them
  bool flat = false;   ///< joints are pixels, without depth
  bool frame = false;  ///< it is a frame, even if it shows nobody
  uint64_t bytes = 0;
  std::vector<std::string> remarks;
};

const Json* first_of(const Json& object, std::initializer_list<const char*> keys) {
  if (!object.is_object()) return nullptr;
  for (const char* key : keys)
    if (const auto at = object.find(key); at != object.end() && !at->is_null()) return &*at;
  return nullptr;
}

constexpr auto kJointKeys = {"joint_positions", "keypoints3d",     "keypoints_3d",
                             "joints3d",        "joints",          "keypoints",
                             "landmarks",       "world_landmarks", "positions"};

constexpr auto kTimeKeys = {"time", "seconds", "timestamp"};

/// The joints of one person's object.
std::optional<FileFrame> joints_of_person(const Json& one, bool& flat, Names& names) {
  if (const Json* fours = first_of(one, {"pose_keypoints_3d"});
      fours != nullptr && fours->is_array() && fours->size() >= 4)
    return frame_of_fours(*fours);
  if (first_of(one, {"pose_keypoints_2d"}) != nullptr) flat = true;
  const Json* rows = first_of(one, kJointKeys);
  if (rows != nullptr && is_named_rows(*rows)) return frame_of_names(*rows, names);
  if (rows == nullptr || !rows->is_array() || rows->empty()) return {};
  if (is_rows(*rows)) {
    names.listed = true;
    return frame_of_rows(*rows);
  }
  if ((*rows)[0].is_array() && (*rows)[0].size() == 2) flat = true;
  return {};
}

/// Who somebody is: by an id, else by the place in the list.
int64_t id_of(const Json& one, size_t place) {
  for (const char* key : {"body_id", "person_id", "track_id", "id"}) {
    const Json* id = first_of(one, {key});
    if (id != nullptr && id->is_array() && id->size() == 1) id = &(*id)[0];
    if (id != nullptr && id->is_number_integer() && id->get<int64_t>() >= 0)
      return id->get<int64_t>();
  }
  return static_cast<int64_t>(place);
}

constexpr auto kPeopleKeys = {"bodies", "people", "instances", "persons", "annots"};

/// Whether a document has what a frame has: people, perhaps none, or joints, perhaps unknown ones.
bool is_frame(const Json& value) {
  if (value.is_array()) return value.empty() || is_rows(value) || value[0].is_object();
  if (!value.is_object()) return false;
  const auto has = [&](const char* key) { return value.contains(key); };
  return std::any_of(kPeopleKeys.begin(), kPeopleKeys.end(), has) ||
         std::any_of(kJointKeys.begin(), kJointKeys.end(), has) || has("pose_keypoints_3d") ||
         has("pose_keypoints_2d");
}

/// The people of one moment: a list of their objects, or one alone.
Moment moment_of(const Json& value, bool& flat, Names& names) {
  Moment out;
  const Json* people = first_of(value, kPeopleKeys);
  if (people == nullptr && value.is_array() && !value.empty() && value[0].is_object() &&
      !value[0].contains("x"))
    people = &value;
  if (people != nullptr && people->is_array()) {
    for (size_t i = 0; i < people->size(); ++i)
      if (auto joints = joints_of_person((*people)[i], flat, names))
        out.people.emplace(id_of((*people)[i], i), std::move(*joints));
  } else if (is_rows(value)) {
    names.listed = true;
    out.people.emplace(0, frame_of_rows(value));
  } else if (auto joints = joints_of_person(value, flat, names)) {
    out.people.emplace(0, std::move(*joints));
  }
  if (const Json* at = first_of(value, {"timestamp_usec"}))
    out.seconds = 1e-6 * number_in(*at);
  else if (const Json* time = first_of(value, kTimeKeys))
    out.seconds = number_in(*time);
  return out;
}

/// Lists of rows, or of objects that have joints and do not say whose.
bool is_list_of_frames(const Json& document) {
  if (!document.is_array() || document.empty()) return false;
  if (document[0].is_object() && !document[0].contains("x"))
    return document.size() > 1 &&
           first_of(document[0], {"body_id", "person_id", "track_id", "id"}) == nullptr;
  return is_rows(document[0]) && !is_rows(document);
}

Parsed parse(const Json& document, Names names) {
  Parsed out;
  out.names = std::move(names);
  const Json* frames = first_of(document, {"frames", "instance_info", "sequence", "data"});
  if (frames != nullptr && frames->is_array()) {
    for (const Json& frame : *frames) out.moments.push_back(moment_of(frame, out.flat, out.names));
  } else if (is_list_of_frames(document)) {
    for (const Json& frame : document) out.moments.push_back(moment_of(frame, out.flat, out.names));
  } else if (const Json* rows = first_of(document, kJointKeys);
             rows != nullptr && rows->is_array() && !rows->empty() && is_rows((*rows)[0])) {
    for (const Json& frame : *rows) out.moments.push_back(moment_of(frame, out.flat, out.names));
  } else {
    out.moments.push_back(moment_of(document, out.flat, out.names));
  }
  if (const Json* said = first_of(document, {"joint_names", "keypoint_names", "names"});
      said != nullptr && said->is_array())
    for (const Json& name : *said)
      if (name.is_string()) out.names.all.push_back(name.get<std::string>());
  return out;
}

/// InputError for a body model's parameters, as EasyMocap writes them.
void refuse_parameters(const Json& document, const std::string& file) {
  const Json& one = document.is_array() && !document.empty() ? document[0] : document;
  if (one.is_object() && one.contains("poses") && one.contains("shapes"))
    throw InputError(
        file, "holds a body model's parameters (poses, Rh, Th, shapes), as EasyMocap does",
        "put them into one NPZ: poses, global_orient (Rh), trans (Th), betas (shapes), a "
        "row for each frame, or give its keypoints3d folder");
}

/// NaN, as Python writes it, is null.
Json parse_text(std::string text, const std::string& where, const std::string& mend) {
  Json document = Json::parse(text, nullptr, false, true);
  if (document.is_discarded() && text.find_first_of("NI") != text.npos) {
    for (const std::string_view word : {"NaN", "-Infinity", "Infinity"})
      for (size_t at = text.find(word); at != text.npos; at = text.find(word, at))
        text.replace(at, word.size(), "null");
    document = Json::parse(text, nullptr, false, true);
  }
  if (document.is_discarded()) throw InputError(where, "is no valid JSON", mend);
  return document;
}

constexpr const char* kWholeLines = "write a whole moment in each line (docs/stream.md)";

/// As parse_text(), of a line: says how it begins.
Json parse_line(const std::string& line, const std::string& where) {
  try {
    return parse_text(line, where, kWholeLines);
  } catch (const InputError& fault) {
    constexpr size_t kSome = 40;  // bytes
    throw InputError(where, cat(fault.cause(), ": ", text::quote(line.substr(0, kSome))),
                     fault.mend());
  }
}

/// Says which lines are left out. InputError: all are.
void say_broken(Parsed& lines, size_t broken, const std::optional<InputError>& first, bool cut) {
  if (broken > 0 && lines.moments.empty()) throw *first;
  if (cut)
    lines.remarks.emplace_back(
        "the last line is cut, as of a recording that was broken off, and is left out");
  if (broken > (cut ? 1 : 0))
    lines.remarks.push_back(cat(counted(broken - (cut ? 1 : 0), "line"),
                                " cannot be read and left out: ", first->complaint()));
}

/// A moment a line; empty lines count for nothing, and broken ones are left out.
Parsed parse_lines(std::string_view text, const std::string& file, Names names) {
  Parsed out;
  out.names = std::move(names);
  size_t broken = 0;
  bool cut = false;
  std::optional<InputError> first;
  for (size_t number = 1; !text.empty(); ++number) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string line(text.substr(0, end));
    const bool ended = end < text.size();
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.find_first_not_of(" \t\r") == line.npos) continue;
    try {
      out.moments.push_back(
          moment_of(parse_line(line, cat(file, ":", number)), out.flat, out.names));
    } catch (const InputError& fault) {
      ++broken;
      cut = !ended;
      if (!first) first = fault;
    }
  }
  say_broken(out, broken, first, cut);
  return out;
}

Parsed parse_file(const std::string& file, Names names) {
  constexpr uint64_t kMost = uint64_t{1} << 28;  // bytes
  FileStream in(file);
  if (in.size() > kMost)
    throw InputError(file, "is JSON of more than 256 MB", "save the joints as NPY, [F, J, 3]");
  const std::string text = read_file(file);
  if (text::ends_in(file, {".jsonl"})) {
    Parsed lines = parse_lines(text, file, std::move(names));
    lines.bytes = in.size();
    return lines;
  }
  const Json document = parse_text(text, file, "write the file again with its own program");
  refuse_parameters(document, file);
  Parsed out = parse(document, std::move(names));
  out.frame = is_frame(document);
  out.bytes = in.size();
  return out;
}

std::vector<double> times_of(const std::vector<Moment>& moments) {
  std::vector<double> out;
  for (const Moment& moment : moments) out.push_back(moment.seconds);
  return out;
}

std::string text_of(const std::set<int64_t>& ids) {
  constexpr size_t kSome = 8;
  std::string out;
  size_t said = 0;
  for (const int64_t id : ids)
    if (said++ < kSome) out += cat(out.empty() ? "" : ", ", id);
  return ids.size() > kSome ? out + " ..." : out;
}

/// The one who is asked for, counted by their ids.
int64_t id_asked_for(const std::string& asked, const std::set<int64_t>& ids,
                     const std::string& where) {
  return *std::next(ids.begin(),
                    static_cast<std::ptrdiff_t>(person_of(asked, ids.size(), where, text_of(ids))));
}

}  // namespace

std::optional<JointRecording> joints_of_json(const std::vector<std::string>& files,
                                             const std::string& path,
                                             const JointFileOptions& options) {
  Parsed all;
  std::string other;  // holds no frame
  const FrameList frames = order_frames(files, path);
  for (const std::string& file : frames.files) {
    Parsed one = parse_file(file, all.names.used ? all.names : Names{});
    if (files.size() > 1 && one.moments.size() > 1) return {};
    if (one.moments.size() == 1 && one.moments[0].people.empty() && !one.frame && other.empty())
      other = file;
    all.flat = all.flat || one.flat;
    all.bytes += one.bytes;
    if (one.names.used || all.names.all.empty()) all.names = std::move(one.names);
    for (Moment& moment : one.moments) all.moments.push_back(std::move(moment));
    for (std::string& remark : one.remarks) all.remarks.push_back(std::move(remark));
  }
  size_t joints = 0;
  std::set<int64_t> ids;
  for (const Moment& moment : all.moments)
    for (const auto& [id, one] : moment.people) {
      joints = std::max(joints, one.size());
      ids.insert(id);
    }
  const size_t people = ids.size();
  if (people == 0 && all.flat)
    throw InputError(path, "holds places in pictures, two numbers a joint",
                     "lift them to three dimensions first, and give that program's joints");
  if (people == 0)
    throw InputError(path, "holds no joints that are known of JSON",
                     "save them as NPY, [F, J, 3] (docs/formats.md)");
  if (!other.empty())
    throw InputError(other, "is no frame of joints, as the other files of the folder are",
                     "move it to another folder");
  const int64_t who = id_asked_for(options.person, ids, path);
  check_dense(all.moments.size(), joints, all.bytes, path);
  JointRecording out;
  for (const Moment& moment : all.moments) {
    const auto one = moment.people.find(who);
    out.frames.push_back(one != moment.people.end() ? one->second : FileFrame());
    out.frames.back().resize(joints);
  }
  out.remarks = frames.remarks;
  for (std::string& remark : all.remarks) out.remarks.push_back(std::move(remark));
  place_by_times(out, times_of(all.moments), text::ends_in(path, {".jsonl"}) ? "line" : "frame",
                 path);
  out.layout = options.layout.empty() && all.names.all.size() == joints
                   ? named_layout(all.names.all)
                   : *choose_layout(out.frames, options.layout, path, true);
  out.form = cat("JSON, ", joints, " joints a frame", files.size() > 1 ? ", a file each" : "");
  return out;
}

}  // namespace restage::joints_detail

namespace restage {

namespace {

/// Everybody who is in the lines.
std::set<int64_t> ids_of(const std::vector<JointLine>& lines) {
  std::set<int64_t> out;
  for (const JointLine& line : lines)
    for (const auto& [id, joints] : line.people) out.insert(id);
  return out;
}

/// Whose joints are nearest to the origin, on average.
int64_t nearest_of(const std::set<int64_t>& ids, const std::vector<JointLine>& lines) {
  std::map<double, int64_t> by_distance;
  for (const int64_t id : ids) {
    double sum = 0, count = 0;
    for (const JointLine& line : lines)
      if (const auto one = line.people.find(id); one != line.people.end())
        for (const std::optional<Vec3>& x : one->second)
          if (x) sum += x->norm(), count += 1;
    if (count > 0) by_distance.emplace(sum / count, id);
  }
  return by_distance.empty() ? *ids.begin() : by_distance.begin()->second;
}

}  // namespace

JointLine JointLines::read(const std::string& text, const std::string& where) {
  using namespace joints_detail;
  const Json document = parse_line(text, where);
  bool flat = false;
  Names names{names_};
  Moment moment = moment_of(document, flat, names);
  const Json* at = first_of(document, {"timestamp_usec", "time", "seconds", "timestamp"});
  if (at != nullptr && !std::isfinite(moment.seconds))
    throw InputError(where, "has a time that is no number", "give seconds, or no time");
  if (moment.people.empty() && flat)
    throw InputError(where, "holds places in pictures, two numbers a joint",
                     "lift them to three dimensions first");
  if (moment.people.empty())
    throw InputError(where, "shows nobody's joints", "see docs/stream.md for what a line holds");
  if (names.used && names.listed)
    throw InputError(where, "calls joints of some by names and others not",
                     "call them so in every line, or in none");
  if (any_ && names.used != named_)
    throw InputError(where,
                     names.used ? "calls joints by names, and the lines before do not"
                                : "calls no joint by a name, and the lines before do",
                     "call them so in every line, or in none");
  check_dense(1, names.all.size(), text.size(), where);
  any_ = true;
  named_ = names.used;
  names_ = std::move(names.all);
  JointLine out;
  out.people = std::move(moment.people);
  constexpr double kNowhere = 1e9;  // in any unit
  for (auto& [id, joints] : out.people)
    for (std::optional<Vec3>& x : joints)
      if (x && !(x->norm() < kNowhere)) x.reset();
  if (at != nullptr) out.seconds = moment.seconds;
  return out;
}

JointLayout JointLines::named() const { return joints_detail::named_layout(names_); }

JointRecording JointLines::learn(const std::vector<JointLine>& first, const std::string& where) {
  using namespace joints_detail;
  const std::set<int64_t> ids = ids_of(first);
  if (options_.person == kNearestPerson) {
    who_ = nearest_of(ids, first);
  } else {
    who_ = id_asked_for(options_.person, ids, where);
  }
  joints_ = names_.size();
  JointRecording out;
  for (const JointLine& line : first) {
    const auto one = line.people.find(who_);
    out.frames.push_back(one != line.people.end() ? one->second : FileFrame());
    joints_ = std::max(joints_, out.frames.back().size());
  }
  for (FileFrame& frame : out.frames) frame.resize(joints_);
  if (!names_.empty() && !options_.layout.empty())
    throw InputError(where, "calls joints by names", "leave {layout} out");
  out.layout = names_.empty() ? *choose_layout(out.frames, options_.layout, where, true) : named();
  out.fps = kFps;
  out.form = cat("JSON lines, ", joints_, " joints a frame");
  check_recording(out, options_, where);
  return out;
}

std::string JointLines::missing(const JointLine& line) const {
  if (line.people.contains(who_)) return "does not show the person's hips and shoulders";
  const std::set<int64_t> ids = ids_of({line});
  return cat("does not show the person, whose id is ", who_,
             ids.empty() ? "" : "; others are there: " + joints_detail::text_of(ids));
}

FileFrame JointLines::of_person(const JointLine& line, const std::string& where) const {
  const auto one = line.people.find(who_);
  if (one == line.people.end()) return {};
  if (names_.empty() && one->second.size() != joints_)
    throw InputError(where,
                     cat("has ", one->second.size(), " joints, and the first lines have ", joints_),
                     "give all joints in every line, null where one is not known");
  return one->second;
}

}  // namespace restage
