// Sequences: what one frame alone does not show. Frames are read once; of each only a few numbers
// are kept, and some thirty, spread over the sequence, are examined like single scans.
#include <algorithm>
#include <cmath>
#include <span>

#include "autograd/base/interrupt.h"
#include "datasets/doctor/examine_detail.h"
#include "datasets/doctor/summary.h"
#include "datasets/doctor/words.h"

namespace restage {

using namespace doctor_detail;

namespace {

constexpr int64_t kExamined = 32;     // frames that are looked at closely
constexpr int64_t kFacingFrames = 4;  // of the first: where the person faces when it starts
constexpr int64_t kAround = 7;        // frames to each side that say how fast is usual
constexpr double kJump = 3.5;         // times the usual step, and
constexpr double kJumpMetres = 0.1;   // at least this far: frames are missing
constexpr double kSizeJump = 2;       // times another size than the frame before: another unit
constexpr double kFastest = 8;        // metres per second of a person's middle
constexpr double kWalked = 0.7;       // metres: long enough to say where somebody walks

std::string frame_list(const std::vector<int64_t>& frames) {
  const std::span<const int64_t> first(frames.data(), std::min<size_t>(frames.size(), 5));
  return joined(first) + (frames.size() > 5 ? ", ..." : "");
}

/// One of the two sizes is that of somebody else, or in another unit.
bool jumps(double a, double b) {
  return a > 0 && b > 0 && (a > kSizeJump * b || b > kSizeJump * a);
}

class Sequence {
 public:
  Sequence(FrameSource& source, const ExamineOptions& options)
      : source_(source), options_(options) {}

  Diagnosis examine() {
    d_.kind = "frames";
    d_.fps = options_.fps.value_or(source_.fps());
    read();
    d_.frames = frames_.size();
    d_.sequences = frames_.back().sequence + 1;
    d_.shown = worst_ ? worst_frame_ : stray_frame_;
    seen_.size = median(sizes_);
    seen_.stray_share =
        static_cast<double>(strays_) / static_cast<double>(std::max<size_t>(points_, 1));
    recognise(d_, seen_, options_);
    judge_points(d_, fewest_distinct_);
    if (d_.faces == 0 && !options_.target)
      judge_sparse(d_, static_cast<size_t>(median(person_points_)), true);
    if (!judge_sizes()) d_.unit.sure = 0;
    judge_units(d_, false);
    judge_up(d_, seen_, options_, looked_);
    judge_walk();
    judge_facing(d_, options_);
    const int up = d_.orientation.up;
    std::vector<double> low;
    double high = -1e300;
    for (const auto& ends : ends_) {
      low.push_back(ends[2 * up]);
      high = std::max(high, ends[2 * up + 1]);
    }
    // Most of the time somebody stands; a few frames under the floor are noise.
    std::sort(low.begin(), low.end());
    judge_frame(d_, low[low.size() / 4], high, flattest_.planes);
    judge_speed();
    judge_repeats();
    judge_numbers();
    judge_jumps();
    if (non_finite_ > 0)
      d_.say(non_finite(non_finite_,
                        cat(" in ", non_finite_frames_, " of ", counted(frames_.size(), "frame"))));
    judge_duplicates(d_, repeats_, d_.faces == 0,
                     cat(" in ", repeat_frames_, " of ", counted(frames_.size(), "frame")));
    if (stray_frames_ > 0)
      d_.say({"outliers", Weight::note,
              cat(counted(strays_, "stray point"), " in ", stray_frames_, " of ",
                  counted(looked_, "frame"), " looked at"),
              1, "far from all others", "{fix} removes them"});
    if (flat_frames_ > 0) {
      judge_plane(d_, flattest_,
                  cat("; seen in ", flat_frames_, " of ", counted(looked_, "frame"), " looked at"));
      if (4 * flat_frames_ < looked_) d_.findings.back().weight = Weight::note;
    }
    if (worst_) {
      PersonShape only_others = *worst_;
      only_others.parts.stray = 0;
      only_others.parts.pieces = 1;
      only_others.parts.flat = 0;
      judge_parts(d_, only_others,
                  cat(", most in frame ", worst_frame_, "; seen in ", other_frames_, " of ",
                      counted(looked_, "frame"), " looked at"));
      // One frame with a passer-by spoils that frame only.
      if (4 * other_frames_ < looked_) d_.findings.back().weight = Weight::note;
    }
    if (2 * broken_frames_ > looked_)
      d_.say({"holes", Weight::note,
              cat("the person is in several pieces in ", broken_frames_, " of ",
                  counted(looked_, "frame"), " looked at"),
              1, "gaps between groups of points", "scan from more sides if you can"});
    return std::move(d_);
  }

 private:
  void look_closely(const Frame& frame, int64_t index) {
    const PersonShape shape = shape_of({frame.points, frame.faces});
    seen_.vote.add(shape.points, index < kFacingFrames);
    sizes_.push_back(shape.size);
    person_points_.push_back(static_cast<double>(
        std::count(shape.parts.part.begin(), shape.parts.part.end(), Part::person)));
    at_.push_back(index);
    std::array<double, 12> ends;
    for (int i = 0; i < 6; ++i) {
      ends[2 * i] = quantile(shape.points, direction(i), kLevel);
      ends[2 * i + 1] = quantile(shape.points, direction(i), 1 - kLevel);
    }
    ends_.push_back(ends);
    points_ += frame.points.size();
    strays_ += shape.parts.stray;
    if (shape.parts.stray > most_strays_) {
      most_strays_ = shape.parts.stray;
      stray_frame_ = index;
    }
    flat_frames_ += shape.parts.flat > 0;
    if (shape.parts.flat > flattest_.flat) flattest_ = shape.parts;
    stray_frames_ += shape.parts.stray > 0;
    other_frames_ += shape.parts.other > 0;
    broken_frames_ += shape.parts.pieces > 1;
    if (shape.parts.other > 0 && (!worst_ || shape.parts.other > worst_->parts.other)) {
      worst_ = shape;
      worst_frame_ = index;
    }
    ++looked_;
  }

  /// The person alone, where all points together change their size.
  void measure_jump(const Mesh& before, const Mesh& frame) {
    frames_[frames_.size() - 2].size = static_cast<float>(shape_of(before).size);
    frames_.back().size = static_cast<float>(shape_of(frame).size);
  }

  void read() {
    const int64_t all = source_.frames(),
                  every = std::max<int64_t>(1, (all + kExamined - 1) / kExamined);
    d_.fewest_points = INT64_MAX;
    Mesh before;
    for (int64_t i = 0; auto frame = source_.next(); ++i) {
      throw_if_stopped();
      if (frame->fault) throw *frame->fault;
      if (frame->points.empty())
        throw InputError(frame->source, "holds no points", "leave the frame out");
      const int64_t n = frame->points.size();
      d_.fewest_points = std::min(d_.fewest_points, n);
      d_.most_points = std::max(d_.most_points, n);
      d_.faces = frame->faces.size();
      if (i == 0 && frame->faces.empty()) judge_path(d_, frame->points);
      non_finite_ += frame->left_out;
      non_finite_frames_ += frame->left_out > 0;
      const Points once = without_repeats(frame->points);
      fewest_distinct_ = std::min(fewest_distinct_, once.size());
      repeats_ += frame->points.size() - once.size();
      repeat_frames_ += once.size() < frame->points.size();
      frames_.push_back(summary_of(*frame, once));
      if (i % every == 0 || i < kFacingFrames) look_closely(*frame, i);
      Mesh mesh{std::move(frame->points), std::move(frame->faces)};
      if (i > 0 && jumps(frames_[frames_.size() - 2].size, frames_.back().size))
        measure_jump(before, mesh);
      before = std::move(mesh);
    }
    if (frames_.empty()) throw InputError("", "the sequence holds no frames", "give at least one");
  }

  /// Whether all frames are in one unit: nobody becomes twice as large from one frame to the next.
  bool judge_sizes() {
    std::vector<int64_t> at;
    double factor = 1;
    for (size_t i = 1; i < frames_.size(); ++i) {
      const double ratio = double{frames_[i].size} / frames_[i - 1].size;
      if (!jumps(frames_[i - 1].size, frames_[i].size)) continue;
      at.push_back(i);
      if (std::abs(std::log(ratio)) > std::abs(std::log(factor))) factor = ratio;
    }
    if (at.empty()) return true;
    const int64_t all = std::ssize(frames_), turn = at[0];
    // A few frames with something else in view are no other unit.
    const bool few = std::min(turn, all - turn) < std::min<int64_t>(kSourceFrames, all / 3);
    const bool lasts = !few && jumps(person_size(0, turn), person_size(turn, all));
    if (!lasts) leave_out_front();
    d_.say({"sizes", lasts ? Weight::wrong : Weight::note,
            "the size changes by a factor of " + number(std::max(factor, 1 / factor)) + " before " +
                (at.size() == 1 ? "frame " : "frames ") + frame_list(at),
            1, "median distance of the points from their middle",
            lasts ? "bring all frames into one unit, or leave the odd ones out"
                  : "look at these frames"});
    return !lasts;
  }

  /// Median size of the person alone in frames begin to end - 1, or of all points where none of
  /// them was looked at closely.
  double person_size(int64_t begin, int64_t end) const {
    std::vector<double> sizes;
    for (size_t k = 0; k < at_.size(); ++k)
      if (at_[k] >= begin && at_[k] < end) sizes.push_back(sizes_[k]);
    const bool none = sizes.empty();
    for (int64_t i = begin; i < end && none; ++i)
      sizes.push_back(double{frames_[static_cast<size_t>(i)].size});
    return median(std::move(sizes));
  }

  /// First frames with something else in them, for which no frame before can stand in.
  void leave_out_front() {
    const int64_t all = std::ssize(frames_), most = std::min<int64_t>(kSourceFrames, all / 3);
    const double usual = person_size(0, all);
    while (d_.odd_front < most && jumps(person_size(d_.odd_front, d_.odd_front + 1), usual))
      ++d_.odd_front;
    if (d_.odd_front == most) d_.odd_front = 0;
  }

  /// Where the person goes, as further evidence of where they face.
  void judge_walk() {
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
        o.turned = o.turned_sure = 0;
      }
      d_.say({"walk", Weight::fact, cat("goes towards ", kDirections[i]), 1,
              number(far * metres()) + " m in " + counted(last, "frame"), ""});
    }
  }

  void judge_repeats() {
    std::vector<int64_t> at;
    std::vector<int64_t> runs(1, 1);
    for (size_t i = 1; i < frames_.size(); ++i) {
      if (frames_[i].content == frames_[i - 1].content &&
          frames_[i].sequence == frames_[i - 1].sequence) {
        at.push_back(i);
        d_.repeated.insert(i);
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
      f.what = cat("every frame is there ", k, " times: the true rate is ",
                   number(d_.fps / static_cast<double>(k)), " frames a second");
      f.fix = "{fix} OUT.h5 keeps one of each, at that rate";
    } else if (runs.size() == 1) {
      f.what = "all frames are the same";
      f.fix = "give a sequence that moves";
    } else {
      f.what = counted(at.size(), "frame") + " equal to the one before: " + frame_list(at);
      f.fix = "the timing is right if the recorder stood still there; leave them";
    }
    d_.say(f);
  }

  /// Gaps in the numbers of the frames' names; a frame that shows nothing is a gap, too, be it
  /// numbered or not.
  void judge_numbers() {
    int64_t usual = INT64_MAX;
    for (size_t i = 1; i < frames_.size(); ++i) {
      const int64_t ahead = frames_[i].number - frames_[i - 1].number;
      // Not all have a number, or it is not one numbering.
      if (frames_[i].number < 0 || frames_[i - 1].number < 0 || ahead < 1) usual = 0;
      usual = std::min(usual, ahead / (1 + std::max<int64_t>(frames_[i].missing, 0)));
    }
    std::vector<int64_t> empty, absent;
    for (size_t i = 0; i < frames_.size(); ++i) {
      const bool numbered = i > 0 && usual > 0;
      const int64_t missing =
          numbered ? (frames_[i].number - frames_[i - 1].number) / usual - 1 : frames_[i].missing;
      if (missing < 1) continue;
      d_.gap[static_cast<int64_t>(i)] = missing;
      if (frames_[i].missing > 0) empty.push_back(i);
      if (missing > frames_[i].missing) absent.push_back(numbered ? frames_[i].number : i);
    }
    const auto count = [&](bool shown_nothing) {
      int64_t out = 0;
      for (const auto& [before, missing] : d_.gap) {
        const int64_t none = frames_[static_cast<size_t>(before)].missing;
        out += shown_nothing ? none : missing - none;
      }
      return out;
    };
    const bool kept = std::all_of(d_.gap.begin(), d_.gap.end(),
                                  [&](const auto& gap) { return d_.is_kept(gap.second); });
    const std::string fix =
        kept ? "{fix} puts frames without points in their place, so that the timing is right; "
               "retarget fills up to a third of a second of them"
             : "a gap of over a minute is closed by {fix}; cut the sequence there";
    if (!empty.empty())
      d_.say({"missing frames", Weight::note,
              counted(count(true), "frame") + " without any point, before " + frame_list(empty), 1,
              "they show nothing", fix});
    if (!absent.empty())
      d_.say({"missing frames", Weight::note,
              counted(count(false), "number") + " missing in the files' names, before " +
                  frame_list(absent),
              1, "the numbering has gaps", fix});
  }

  void judge_jumps() {
    std::vector<double> steps(frames_.size(), -1);  // -1: the first of a sequence, or a repetition
    for (size_t i = 1; i < frames_.size(); ++i)
      if (frames_[i].sequence == frames_[i - 1].sequence && !d_.repeated.contains(i))
        steps[i] = step(frames_[i], frames_[i - 1]) * metres();
    std::vector<int64_t> at;
    for (int64_t i = 1; i < std::ssize(steps); ++i) {
      std::vector<double> around;
      for (int64_t k = std::max<int64_t>(1, i - kAround);
           k <= std::min(std::ssize(steps) - 1, i + kAround); ++k)
        if (k != i && steps[k] >= 0) around.push_back(steps[k]);
      // Nine in ten of the neighbours are slower: a fast gesture is no jump.
      if (around.size() < 4) continue;
      std::sort(around.begin(), around.end());
      const double usual = around[around.size() / 2], fast = around[around.size() * 9 / 10];
      const double here = steps[i];
      if (here > kJump * usual && here > 1.8 * fast && here > kJumpMetres &&
          !d_.repeated.contains(i - 1) && !d_.gap.contains(i))
        at.push_back(i);
    }
    if (!at.empty())
      d_.say(
          {"missing frames", Weight::note,
           cat("the motion jumps before ", at.size() == 1 ? "frame " : "frames ", frame_list(at)),
           0.8, "a step several times as long as those around it",
           "frames may be missing there; look at them"});
  }

  void judge_speed() {
    std::vector<double> speeds;
    for (size_t i = 1; i < frames_.size(); ++i)
      if (frames_[i].sequence == frames_[i - 1].sequence && !d_.repeated.contains(i))
        speeds.push_back((frames_[i].middle - frames_[i - 1].middle).norm() * metres() * d_.fps);
    Finding f{"frame rate", Weight::fact, number(d_.fps) + " frames a second", 1, "", ""};
    const bool alone = 4 * other_frames_ < looked_;  // else it is now one person, now another
    if (speeds.size() < 5 || d_.unit.sure < kUnsure || !alone) {
      f.evidence = options_.fps ? "as given" : "the file's, or 30 where it says none";
      d_.say(f);
      return;
    }
    const double usual = median(speeds);
    f.evidence = "at that rate the person's middle moves at " + number(usual) + " m/s (median)";
    if (usual > kFastest) {
      f.weight = Weight::note;
      f.sure = 0.9;
      f.what += " cannot be: nobody runs that fast";
      f.fix = "give the true rate with {fps}, here or to retarget";
    }
    d_.say(f);
  }

  double metres() const { return d_.unit.sure >= kUnsure ? d_.unit.unit.metres : 1; }

  FrameSource& source_;
  ExamineOptions options_;
  Diagnosis d_;
  std::vector<Summary> frames_;
  Seen seen_;
  std::vector<double> sizes_;  // of the person alone, of frames at_
  std::vector<double> person_points_;
  std::vector<int64_t> at_;
  std::vector<std::array<double, 12>> ends_;  // lowest and highest along each direction
  size_t looked_ = 0, fewest_distinct_ = SIZE_MAX, points_ = 0, repeats_ = 0, repeat_frames_ = 0;
  size_t non_finite_ = 0, non_finite_frames_ = 0;
  size_t strays_ = 0, stray_frames_ = 0, other_frames_ = 0, broken_frames_ = 0, flat_frames_ = 0;
  Parts flattest_;                    // of the frame with most of a floor
  std::optional<PersonShape> worst_;  // the frame with most of somebody else
  int64_t worst_frame_ = 0, stray_frame_ = 0;
  size_t most_strays_ = 0;
};

}  // namespace

Diagnosis examine_frames(FrameSource& source, const ExamineOptions& options) {
  return Sequence(source, options).examine();
}

}  // namespace restage
