// Sequences: what one frame alone does not show. Frames are read once; of each only a few numbers
// are kept, and some thirty, spread over the sequence, are examined like single scans.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "autograd/base/error.h"
#include "datasets/doctor/examine_detail.h"
#include "datasets/doctor/words.h"

namespace restage {

using namespace doctor_detail;

namespace {

constexpr int64_t kExamined = 32;     // frames that are looked at closely
constexpr int64_t kFacingFrames = 4;  // of the first: where the person faces when it starts
constexpr int kExtents = 13;          // directions in which a frame's extent is kept
constexpr int64_t kAround = 7;        // frames to each side that say how fast is usual
constexpr double kJump = 3.5;         // times the usual step, and
constexpr double kJumpMetres = 0.1;   // at least this far: frames are missing
constexpr double kFastest = 8;        // metres per second of a person's middle
constexpr double kWalked = 0.7;       // metres: long enough to say where somebody walks

/// What is kept of a frame: where it ends in 26 directions, and its middle.
struct Summary {
  uint64_t content = 0;  ///< the same for the same points in any order
  std::array<float, 2 * kExtents> extent{};
  Point middle = Point::Zero();
  int64_t sequence = 0, number = -1;  ///< number in the file's name
};

uint64_t mixed(uint64_t x) {
  x ^= x >> 33;
  x *= 0xff51afd7ed558ccdULL;
  x ^= x >> 33;
  x *= 0xc4ceb9fe1a85ec53ULL;
  return x ^ (x >> 33);
}

uint64_t content_of(const Points& points) {
  uint64_t sum = points.size();
  for (const Point& p : points) {
    std::array<uint32_t, 3> bits;
    std::memcpy(bits.data(), p.data(), sizeof bits);
    sum += mixed(mixed(mixed(bits[0]) ^ bits[1]) ^ bits[2]);
  }
  return sum;
}

Vec3 extent_direction(int i) {
  const int code = 14 + i;
  return Vec3(code / 9 - 1, code / 3 % 3 - 1, code % 3 - 1).normalized();
}

/// The last run of digits of a file's name; -1: none, or no file of its own.
int64_t number_in(const std::string& source) {
  const std::string name = std::filesystem::path(source).filename().string();
  const size_t end = name.find_last_of("0123456789", name.rfind('.'));
  if (end == std::string::npos) return -1;
  size_t begin = end;
  while (begin > 0 && std::isdigit(static_cast<unsigned char>(name[begin - 1]))) --begin;
  const std::string digits = name.substr(begin, end - begin + 1);
  return digits.size() > 15 ? -1 : std::stoll(digits);
}

Summary summary_of(const Frame& frame, bool numbered) {
  Summary out;
  out.content = content_of(frame.points);
  out.sequence = frame.sequence;
  if (numbered) out.number = number_in(frame.source);
  const Points points = without_repeats(frame.points);
  Points some;
  const size_t n = std::min<size_t>(points.size(), 2000);
  for (size_t i = 0; i < n; ++i) some.push_back(points[i * points.size() / n]);
  for (int i = 0; i < kExtents; ++i) {
    out.extent[static_cast<size_t>(2 * i)] =
        static_cast<float>(quantile(some, extent_direction(i), 0.02));
    out.extent[static_cast<size_t>(2 * i + 1)] =
        static_cast<float>(quantile(some, extent_direction(i), 0.98));
  }
  for (int axis = 0; axis < 3; ++axis)
    out.middle[axis] = static_cast<float>(quantile(some, direction(2 * axis), 0.5));
  return out;
}

/// How far the outline moved, in the data's units.
double step(const Summary& a, const Summary& b) {
  double sum = 0;
  for (size_t i = 0; i < a.extent.size(); ++i)
    sum += std::pow(static_cast<double>(a.extent[i]) - b.extent[i], 2);
  return std::sqrt(sum / static_cast<double>(a.extent.size()));
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string frame_list(const std::vector<int64_t>& frames) {
  std::string out;
  for (size_t i = 0; i < frames.size() && i < 5; ++i)
    out += (i > 0 ? ", " : "") + std::to_string(frames[i]);
  return out + (frames.size() > 5 ? ", ..." : "");
}

class Sequence {
 public:
  Sequence(FrameSource& source, const ExamineOptions& options)
      : source_(source), options_(options) {}
  Diagnosis examine();

 private:
  void read();
  void look_closely(const Frame& frame, int64_t index);
  void judge_walk();
  void judge_repeats();
  void judge_numbers();
  void judge_jumps();
  void judge_speed();
  double metres() const { return d_.unit.sure >= kUnsure ? d_.unit.unit.metres : 1; }

  FrameSource& source_;
  ExamineOptions options_;
  Diagnosis d_;
  std::vector<Summary> frames_;
  OrientationVote vote_;
  std::vector<double> sizes_;
  std::vector<std::array<double, 12>> ends_;  // lowest and highest along each direction
  size_t looked_ = 0, fewest_distinct_ = SIZE_MAX, repeats_ = 0, repeat_frames_ = 0;
  size_t strays_ = 0, stray_frames_ = 0, other_frames_ = 0, broken_frames_ = 0;
  std::optional<PersonShape> worst_;  // the frame with most of somebody else
  int64_t worst_frame_ = 0, stray_frame_ = 0;
  size_t most_strays_ = 0;
};

void Sequence::look_closely(const Frame& frame, int64_t index) {
  const PersonShape shape = shape_of({frame.points, frame.faces});
  vote_.add(shape.points, index < kFacingFrames);
  sizes_.push_back(shape.size);
  std::array<double, 12> ends;
  for (int i = 0; i < 6; ++i) {
    ends[static_cast<size_t>(2 * i)] = quantile(shape.points, direction(i), kLevel);
    ends[static_cast<size_t>(2 * i + 1)] = quantile(shape.points, direction(i), 1 - kLevel);
  }
  ends_.push_back(ends);
  const size_t points = distinct(frame.points).size(), repeats = frame.points.size() - points;
  fewest_distinct_ = std::min(fewest_distinct_, points);
  repeats_ += repeats;
  repeat_frames_ += repeats > 0;
  strays_ += shape.parts.stray;
  if (shape.parts.stray > most_strays_) {
    most_strays_ = shape.parts.stray;
    stray_frame_ = index;
  }
  stray_frames_ += shape.parts.stray > 0;
  other_frames_ += shape.parts.other > 0;
  broken_frames_ += shape.parts.pieces > 1;
  if (shape.parts.other > 0 && (!worst_ || shape.parts.other > worst_->parts.other)) {
    worst_ = shape;
    worst_frame_ = index;
  }
  ++looked_;
}

void Sequence::read() {
  const int64_t all = source_.frames(),
                every = std::max<int64_t>(1, (all + kExamined - 1) / kExamined);
  d_.fewest_points = INT64_MAX;
  for (int64_t i = 0; const auto frame = source_.next(); ++i) {
    const auto n = static_cast<int64_t>(frame->points.size());
    d_.fewest_points = std::min(d_.fewest_points, n);
    d_.most_points = std::max(d_.most_points, n);
    d_.faces = static_cast<int64_t>(frame->faces.size());
    // A file of HDF5 numbers its frames itself, without gaps.
    frames_.push_back(summary_of(*frame, frame->source.find(".h5:") == std::string::npos &&
                                             frame->source.find(".hdf5:") == std::string::npos));
    if (i % every == 0 || i < kFacingFrames) look_closely(*frame, i);
  }
  if (frames_.empty()) throw InputError("", "the sequence holds no frames", "give at least one");
}

/// Where the person goes, as further evidence of where they face.
void Sequence::judge_walk() {
  const Vec3 up = direction(d_.orientation.up);
  size_t last = 0;
  double far = 0;
  for (size_t i = 0; i < frames_.size() && frames_[i].sequence == frames_[0].sequence && i < 45;
       ++i) {
    const Vec3 way = (frames_[i].middle - frames_[0].middle).cast<double>();
    const double level = (way - up.dot(way) * up).norm();
    if (level > far) far = level, last = i;
  }
  if (far * metres() < kWalked || d_.orientation.up_sure < kUnsure) return;
  const Vec3 way = (frames_[last].middle - frames_[0].middle).cast<double>();
  Orientation& o = d_.orientation;
  for (int i = 0; i < 6; ++i) {
    if (i / 2 == o.up / 2 || direction(i).dot(way) < 0.8 * far) continue;
    // People walk forwards nearly always: it decides where the shape does not.
    if (o.facing_sure < kUnsure && o.facing / 2 == i / 2) {
      o.facing = i;
      o.facing_sure = 0.8;
    }
    d_.findings.push_back({"walk", Weight::fact,
                           std::string("goes towards ") + kDirections[static_cast<size_t>(i)], 1,
                           number(far * metres()) + " m in " + counted(last, "frame"), ""});
  }
}

void Sequence::judge_repeats() {
  std::vector<int64_t> at;
  std::vector<int64_t> runs(1, 1);
  for (size_t i = 1; i < frames_.size(); ++i) {
    if (frames_[i].content == frames_[i - 1].content &&
        frames_[i].sequence == frames_[i - 1].sequence) {
      at.push_back(static_cast<int64_t>(i));
      d_.repeated.insert(static_cast<int64_t>(i));
      ++runs.back();
    } else {
      runs.push_back(1);
    }
  }
  if (at.empty()) return;
  const int64_t k = runs[0];
  const bool regular =
      runs.size() > 2 && k > 1 &&
      std::all_of(runs.begin(), runs.end() - 1, [&](int64_t r) { return r == k; }) &&
      runs.back() <= k;
  Finding f{"repeated frames", Weight::note, "", 1, "equal points", ""};
  if (regular) {
    d_.keep_every = static_cast<int>(k);
    f.what = "every frame is there " + std::to_string(k) + " times: the true rate is " +
             number(d_.fps / static_cast<double>(k)) + " frames a second";
    f.fix = "--fix OUT.h5 keeps one of each, at that rate";
  } else if (runs.size() == 1) {
    f.what = "all frames are the same";
    f.fix = "give a sequence that moves";
  } else {
    f.what = counted(at.size(), "frame") + " equal to the one before: " + frame_list(at);
    f.fix = "the timing is right if the recorder stood still there; leave them";
  }
  d_.findings.push_back(f);
}

void Sequence::judge_numbers() {
  int64_t usual = INT64_MAX;
  for (size_t i = 1; i < frames_.size(); ++i) {
    if (frames_[i].number < 0 || frames_[i - 1].number < 0) return;
    const int64_t ahead = frames_[i].number - frames_[i - 1].number;
    if (ahead < 1) return;  // not one numbering
    usual = std::min(usual, ahead);
  }
  std::vector<int64_t> at;
  int64_t missing = 0;
  bool filled = true;
  for (size_t i = 1; i < frames_.size(); ++i) {
    const int64_t ahead = (frames_[i].number - frames_[i - 1].number) / usual;
    if (ahead <= 1) continue;
    d_.gap[static_cast<int64_t>(i)] = ahead - 1;
    missing += ahead - 1;
    filled = filled && d_.is_filled(ahead - 1);
    at.push_back(frames_[i].number);
  }
  if (missing > 0)
    d_.findings.push_back(
        {"missing frames", Weight::note,
         counted(static_cast<size_t>(missing), "number") + " missing in the files' names, before " +
             frame_list(at),
         1, "the numbering has gaps",
         filled ? "--fix puts the nearest frame in their place, so that the timing is right"
                : "--fix fills gaps of up to a second with the nearest frame; cut the sequence at "
                  "longer ones"});
}

void Sequence::judge_jumps() {
  std::vector<double> steps(frames_.size(), -1);  // -1: the first of a sequence, or a repetition
  for (size_t i = 1; i < frames_.size(); ++i)
    if (frames_[i].sequence == frames_[i - 1].sequence &&
        !d_.repeated.contains(static_cast<int64_t>(i)))
      steps[i] = step(frames_[i], frames_[i - 1]) * metres();
  std::vector<int64_t> at;
  for (int64_t i = 1; i < std::ssize(steps); ++i) {
    std::vector<double> around;
    for (int64_t k = std::max<int64_t>(1, i - kAround);
         k <= std::min(std::ssize(steps) - 1, i + kAround); ++k)
      if (k != i && steps[static_cast<size_t>(k)] >= 0)
        around.push_back(steps[static_cast<size_t>(k)]);
    // Nine in ten of the neighbours are slower: a fast gesture is no jump.
    if (around.size() < 4) continue;
    std::sort(around.begin(), around.end());
    const double usual = around[around.size() / 2], fast = around[around.size() * 9 / 10];
    const double here = steps[static_cast<size_t>(i)];
    if (here > kJump * usual && here > 1.8 * fast && here > kJumpMetres &&
        !d_.repeated.contains(i - 1) && !d_.gap.contains(i))
      at.push_back(i);
  }
  if (!at.empty())
    d_.findings.push_back({"missing frames", Weight::note,
                           "the motion jumps before " +
                               std::string(at.size() == 1 ? "frame " : "frames ") + frame_list(at),
                           0.8, "a step several times as long as those around it",
                           "frames may be missing there; look at them"});
}

void Sequence::judge_speed() {
  std::vector<double> speeds;
  for (size_t i = 1; i < frames_.size(); ++i)
    if (frames_[i].sequence == frames_[i - 1].sequence &&
        !d_.repeated.contains(static_cast<int64_t>(i)))
      speeds.push_back((frames_[i].middle - frames_[i - 1].middle).norm() * metres() * d_.fps);
  Finding f{"frame rate", Weight::fact, number(d_.fps) + " frames a second", 1, "", ""};
  if (speeds.size() < 5 || d_.unit.sure < kUnsure) {
    f.evidence = "the file's, or 30 where it says none";
    d_.findings.push_back(f);
    return;
  }
  const double usual = median(speeds);
  f.evidence = "at that rate the person's middle moves at " + number(usual) + " m/s (median)";
  if (usual > kFastest) {
    f.weight = Weight::note;
    f.sure = 0.9;
    f.what += " cannot be: nobody runs that fast";
    f.fix = "give the true rate with --fps";
  }
  d_.findings.push_back(f);
}

Diagnosis Sequence::examine() {
  d_.kind = "frames";
  d_.fps = source_.fps();
  read();
  d_.frames = static_cast<int64_t>(frames_.size());
  d_.sequences = frames_.back().sequence + 1;
  d_.shown = worst_ ? worst_frame_ : stray_frame_;
  recognise(d_, median(sizes_), vote_, options_);
  judge_points(d_, fewest_distinct_);
  judge_units(d_);
  judge_up(d_, looked_);
  judge_walk();
  judge_facing(d_, false);
  const auto up = static_cast<size_t>(d_.orientation.up);
  std::vector<double> low;
  double high = -1e300;
  for (const auto& ends : ends_) {
    low.push_back(ends[2 * up]);
    high = std::max(high, ends[2 * up + 1]);
  }
  // Most of the time somebody stands; a few frames under the floor are noise.
  std::sort(low.begin(), low.end());
  judge_frame(d_, low[low.size() / 4], high);
  judge_speed();
  judge_repeats();
  judge_numbers();
  judge_jumps();
  judge_duplicates(
      d_, repeats_, d_.faces == 0,
      " in " + std::to_string(repeat_frames_) + " of " + counted(looked_, "frame") + " looked at");
  if (stray_frames_ > 0)
    d_.findings.push_back({"outliers", Weight::note,
                           counted(strays_, "stray point") + " in " +
                               std::to_string(stray_frames_) + " of " + counted(looked_, "frame") +
                               " looked at",
                           1, "far from all others", "--fix removes them"});
  if (worst_) {
    PersonShape only_others = *worst_;
    only_others.parts.stray = 0;
    only_others.parts.pieces = 1;
    judge_parts(d_, only_others,
                ", most in frame " + std::to_string(worst_frame_) + "; seen in " +
                    std::to_string(other_frames_) + " of " + counted(looked_, "frame") +
                    " looked at");
    // One frame with a passer-by spoils that frame only.
    if (4 * other_frames_ < looked_) d_.findings.back().weight = Weight::note;
  }
  if (2 * broken_frames_ > looked_)
    d_.findings.push_back({"holes", Weight::note,
                           "the person is in several pieces in " + std::to_string(broken_frames_) +
                               " of " + counted(looked_, "frame") + " looked at",
                           1, "gaps between groups of points", "scan from more sides if you can"});
  return std::move(d_);
}

}  // namespace

Diagnosis examine_frames(FrameSource& source, const ExamineOptions& options) {
  return Sequence(source, options).examine();
}

}  // namespace restage
