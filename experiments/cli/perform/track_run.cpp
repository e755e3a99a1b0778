// restage track: frames of the source through the networks and the tracker.
#include <algorithm>
#include <chrono>
#include <deque>

#include "autograd/base/format.h"
#include "experiments/cli/perform/track.h"
#include "experiments/slow_work.h"

namespace restage::cli {
namespace {

constexpr int64_t kKeptEvery = 8;   // frames
constexpr double kPoorFit = 0.025;  // metres: 95 % of the points are nearer in a frame that fits
constexpr double kPoorRatio = 2;    // to the middle of all frames'

/// The networks answer some frames late.
class TrackRun {
 public:
  TrackRun(const TrackCommand& c, Source& source, System& system, Tracker& tracker,
           TrackJournal& journal, Gaps& gaps)
      : source_(source),
        system_(system),
        tracker_(tracker),
        journal_(journal),
        gaps_(gaps),
        offsets_(writes_glb(c)),
        done_(journal.frames()),
        door_(frame_of(source.record()), c.how.options.force, true) {
    if (done_ > 0) tracker_.load(journal.state(), c.how.to.out);
  }

  TrackTake operator()() {
    for (auto cloud = source_.next(); cloud; cloud = source_.next()) {
      slow_.on("frame " + std::to_string(in_ + 1) + " of " + std::to_string(source_.frames()) +
               time_left());
      take_.points_left_out += cloud->frame.left_out;
      push(*cloud);
      answer();
      ++in_;
    }
    gaps_.check_any();
    system_.finish([this](const RetargetedFrame& f) { shown_.push_back(f); });
    answer();
    journal_.keep(tracker_.save());
    slow_.on("");
    return std::move(take_);
  }

 private:
  /// A cloud that the networks have not answered yet; without points: it could not be used.
  struct Unanswered {
    Points points;
    Joints seen{};
    std::string source;
  };

  /// As the frames that were tracked in this run took.
  std::string time_left() {
    const int64_t tracked = take_.frames() - done_;
    if (tracked <= 0) start_ = std::chrono::steady_clock::now();
    if (tracked <= 0) return "";
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
    const auto done = static_cast<double>(tracked),
               all = static_cast<double>(source_.frames() - done_);
    return format(", about %.0f s left", spent.count() * (all - done) / done);
  }

  void push(SourceCloud& cloud) {
    const Points& points = cloud.frame.points;
    const std::string name = cloud.frame.source;
    std::optional<InputError> fault = cloud.fault;
    if (!fault) try {
        door_.pass(points, name, [&] {
          system_.push(points, name, [this](const RetargetedFrame& f) { shown_.push_back(f); });
        });
      } catch (const UnusableCloud& unusable) {
        fault = unusable;
      }
    if (fault) {
      gaps_.add(in_, *fault);
      system_.miss();
      waiting_.emplace_back();
      return;
    }
    gaps_.end();
    waiting_.push_back({std::move(cloud.frame.points), *system_.source_joints(), name});
  }

  void answer() {
    for (const RetargetedFrame& f : shown_) {
      if (waiting_.empty()) throw WorkError("the system showed more frames than it was given");
      const JournalFrame found =
          take_.frames() < done_ ? journal_.read(take_.frames()) : track(f, waiting_.front());
      if (found.filled) take_.filled.push_back(take_.frames());
      take_.confidence.push_back(found.confidence);
      take_.distance.push_back(found.distance);
      waiting_.pop_front();
      if (take_.frames() > done_ && take_.frames() % kKeptEvery == 0)
        journal_.keep(tracker_.save());
    }
    shown_.clear();
  }

  JournalFrame track(const RetargetedFrame& f, const Unanswered& in) {
    const bool seen = !in.points.empty();
    TrackedFrame found =
        tracker_(f.pose, seen ? &in.seen : nullptr, seen ? &in.points : nullptr, in.source);
    const JournalFrame out{found.pose, f.confidence, f.filled, found.distance,
                           std::move(offsets_ ? found.offsets : found.vertices)};
    journal_.append(out);
    return out;
  }

  Source& source_;
  System& system_;
  Tracker& tracker_;
  TrackJournal& journal_;
  Gaps& gaps_;
  const bool offsets_;
  const int64_t done_;
  CloudDoor door_;
  SlowWork slow_;
  std::deque<Unanswered> waiting_;
  std::vector<RetargetedFrame> shown_;
  TrackTake take_;
  int64_t in_ = 0;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace

MiddleAndMost TrackTake::middle() const {
  std::vector<double> medians, p95s;
  for (const auto& d : distance)
    if (d) medians.push_back(d->median), p95s.push_back(d->p95);
  return {middle_and_most(medians).median, middle_and_most(p95s).median};
}

std::vector<int64_t> TrackTake::poor() const {
  const double limit = std::max(kPoorFit, kPoorRatio * middle().p95);
  std::vector<int64_t> out;
  for (size_t f = 0; f < distance.size(); ++f)
    if (distance[f] && distance[f]->p95 > limit) out.push_back(static_cast<int64_t>(f));
  return out;
}

TrackTake run_frames(const TrackCommand& c, Source& source, System& system, Tracker& tracker,
                     TrackJournal& journal, Gaps& gaps) {
  return TrackRun(c, source, system, tracker, journal, gaps)();
}

}  // namespace restage::cli
