// What `restage retarget` asks before it starts.

#include <algorithm>

#include "autograd/base/log.h"
#include "datasets/doctor/examine_detail.h"
#include "datasets/doctor/orientation.h"
#include "datasets/doctor/orientation_model.h"
#include "datasets/doctor/words.h"
#include "datasets/importers/motions/axis.h"
#include "datasets/readers/frames/memory_frames.h"
#include "nn/models/views.h"

namespace restage {

using namespace doctor_detail;

namespace {

MemoryFrames frames_of(const std::vector<Mesh>& meshes) {
  return {meshes.size(), [&meshes](size_t i) {
            return Frame{"", meshes[i].vertices, meshes[i].faces, 0};
          }};
}

constexpr int kOurUp = 2;  // +y, of kDirections

[[noreturn]] void refuse(const std::string& where, const Finding& f, const std::string& fix) {
  std::string what = f.what;
  if (f.sure < 1 && f.sure >= kUnsure) what += " (sure " + per_cent(f.sure) + ")";
  throw InputError(where, what, fix + ", or {force} to take it as it is");
}

std::string scale_advice(double size, double given) {
  const UnitGuess raw = guess_unit(size / given);
  if (raw.sure < kUnsure) return "give metres per unit with {scale}";
  return raw.unit.metres == 1 && given != 1 ? "leave {scale} out"
                                            : "give {scale} " + number(raw.unit.metres);
}

/// A direction of the frame that the source was brought into, by its axis `given`, as the source's.
std::string own_axis(int up, const std::string& given) {
  const Mat3 back = upright(parse_axis(given, "{source-up}")).transpose();
  return to_string(axis_near(back * direction(up)));
}

std::string up_advice(int up, const std::string& given) {
  return "give {source-up} " + own_axis(up, given) + " ({source-up} " + given +
         " where people lie or hang)";
}

/// What the clouds look like, where somebody said otherwise.
void warn_of_up(const std::string& where, const Diagnosis& d, const Finding& f,
                const SourceFrame& given) {
  log_warning(where + "the first clouds look as if " + own_axis(d.orientation.up, given.up) +
              " were up (sure " + per_cent(f.sure) + "), but " + spelled("{source-up} ") +
              given.up + " was given, and is taken");
}

/// float32 holds coordinates to a centimetre up to here. A stray point may be anywhere, so all
/// points have to be far away.
void check_near(const Points& frame, const std::string& where, FrameMends options) {
  constexpr float kFar = 100'000;
  const auto is_far = [](const Point& p) { return p.cwiseAbs().maxCoeff() > kFar; };
  if (frame.empty() || !std::all_of(frame.begin(), frame.end(), is_far)) return;
  throw UnusableCloud(where,
                      "lies " + number(1e-3 * frame.front().cwiseAbs().maxCoeff()) +
                          " km from the origin, where single precision loses centimetres",
                      std::string("subtract the same origin from all frames") +
                          (options == FrameMends::scale_and_force
                               ? ", give the unit with {scale}, or {force} to take it as it is"
                               : ""));
}

/// The first clouds look as if `up` were up; whether all of the take does.
void check_take(const TakeClouds& take, const std::string& where, int up, const Finding& first,
                const SourceFrame& given) {
  const std::optional<int> all = take ? up_of_take(take(), kOurUp) : std::nullopt;
  if (all == kOurUp) {
    log_warning(where +
                ": nobody stands upright in the first clouds; by the others and the floor " +
                given.up + " is taken as up");
    return;
  }
  Finding said = first;
  if (all && *all != up)
    said.what = cat(kDirections[static_cast<size_t>(*all)], " is up over the whole take, not +y");
  refuse(where, said, up_advice(all.value_or(up), given.up));
}

}  // namespace

void check_source(const std::vector<Mesh>& first_frames, const std::string& where,
                  const SourceFrame& given, const TakeClouds& take) {
  for (const Mesh& frame : first_frames)
    if (frame.vertices.size() < kEnoughPoints) return;  // refused when its turn comes
  if (first_frames.empty()) return;
  check_near(first_frames.front().vertices, where, FrameMends::scale_and_force);
  MemoryFrames frames = frames_of(first_frames);
  const Diagnosis d = examine_frames(frames);
  const bool some_odd = !std::all_of(first_frames.begin(), first_frames.end(),
                                     [](const Mesh& m) { return may_be_a_person(m.vertices); });
  for (const Finding& f : d.findings) {
    // Frames of too few points or of no person's size are told apart one by one (check_frame()).
    if (f.weight != Weight::wrong || f.topic == "points" || (f.topic == "sizes" && some_odd))
      continue;
    if (f.topic == "path") refuse(where, f, f.fix);
    if (f.topic == "units") refuse(where, f, scale_advice(d.size, given.scale));
    if (f.topic == "up" && f.sure < kNobody) refuse(where, f, "give scans of one whole person");
    // A few frames, alike: less certain than the many that the doctor looks at.
    if (f.topic == "up" && f.sure < kVerySure) continue;
    if (f.topic == "up" && given.up_known) {
      warn_of_up(where + ": ", d, f, given);
      continue;
    }
    if (f.topic == "up") {
      check_take(take, where, d.orientation.up, f, given);
      continue;
    }
    refuse(where, f,
           f.topic == "others"
               ? "--person N of retarget and stream chooses one; restage doctor --fix OUT mends it"
               : "restage doctor --fix OUT mends it");
  }
}

void check_sides(const Joints& joints, const std::string& where) {
  if (is_mirrored(joints).value_or(false))
    throw InputError(where, "is a mirror image: the joints named left are on the right",
                     "mirror it (x to -x) where it was made, or exchange the names; or {force}");
}

void check_target(const Mesh& target, const std::string& where, ExamineOptions options) {
  if (options.joints) check_sides(*options.joints, where);
  options.target = true;
  const Diagnosis d = judge_surface(target, shape_of(target), repeats(target.vertices), options);
  const Finding* pose = d.find("pose");
  const bool posed = options.any_pose && pose != nullptr && pose->weight == Weight::wrong;
  for (const Finding& f : d.findings) {
    if (f.weight != Weight::wrong) continue;
    if (posed && (f.topic == "pose" || f.topic == "facing")) continue;
    const bool nobody = f.topic == "up" && f.sure < kNobody;
    if (f.topic == "points") throw InputError(where, f.what, f.fix);  // force makes no points
    Finding said = f;
    if (f.topic == "pose") said.what += ": " + f.evidence;
    refuse(where, said,
           nobody ? "give one whole person in T-pose"
           : f.topic == "pose" || f.topic == "path"
               ? f.fix
               : "restage doctor --as-target --fix OUT mends it");
  }
}

void SourceWatch::look(const Points& cloud, const std::string& where) {
  if (!settled_ && cloud.size() >= kEnoughPoints) clouds_.push_back({cloud, {}});
  if (clouds_.size() == kSourceFrames) judge();
  if (wrong_) refuse(where, *wrong_, fix_);
}

void SourceWatch::judge() {
  MemoryFrames frames = frames_of(clouds_);
  const Diagnosis d = examine_frames(frames);
  clouds_.clear();
  wrong_.reset();
  settled_ = true;
  for (const Finding& f : d.findings) {
    if (f.weight != Weight::wrong) continue;
    if (f.topic == "up" && f.sure >= kVerySure) {
      if (again_) continue;
      if (given_.up_known) {
        warn_of_up("", d, f, given_);
        continue;
      }
      wrong_ = f;
      fix_ = up_advice(d.orientation.up, given_.up);
      return;
    }
    const bool nobody = f.topic == "up" && f.sure < kNobody;
    if (nobody || f.topic == "others" || f.topic == "plane") {
      wrong_ = f;
      wrong_->what = std::string(nobody               ? "nobody can be made out"
                                 : f.topic == "plane" ? "a floor or a wall is"
                                                      : "a second person is") +
                     " in the clouds before";
      fix_ = cat("let one person alone be in the clouds (restage doctor --fix mends recorded ones",
                 f.topic == "others" ? "; --person N of retarget and stream chooses one)" : ")");
      settled_ = false;
    }
  }
}

bool may_be_a_person(const Points& frame) {
  const double size = normalised(frame).size;
  constexpr double kRoom = 2;  // stray points, or half of somebody
  return frame.size() < kEnoughPoints || is_person_sized(size * kRoom) ||
         is_person_sized(size / kRoom);
}

void check_frame(const Points& frame, const std::string& where, FrameMends options) {
  check_near(frame, where, options);
  if (may_be_a_person(frame)) return;
  throw UnusableCloud(
      where,
      "is of another size than people: half of its points lie within " +
          number(normalised(frame).size) + " m of the middle",
      options == FrameMends::scale_and_force
          ? "give all frames in metres ({scale}), leave this one out, or {force} to "
            "take it as it is"
          : "give metres (restage doctor --fix OUT makes metres of files)");
}

}  // namespace restage
