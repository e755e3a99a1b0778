// restage stream: clouds or joints as they are captured in, the poses of a character out, while it
// happens.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "autograd/base/format.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/words.h"
#include "datasets/doctor/examine.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/retarget.h"
#include "experiments/cli/perform/retarget_words.h"
#include "experiments/cli/perform/source_options.h"
#include "experiments/cli/perform/stream_input.h"
#include "experiments/cli/perform/stream_joints.h"
#include "experiments/cli/perform/stream_person.h"
#include "experiments/cli/perform/stream_summary.h"
#include "experiments/cli/perform/stream_take.h"
#include "experiments/pictures/live_page.h"
#include "experiments/source.h"
#include "infer/live/sender_clock.h"
#include "infer/live/server.h"
#include "infer/live/timeline.h"
#include "infer/live/vmc.h"

namespace restage::cli {
namespace {

/// The joints that the character has bones for.
live::BoneSet bones_of(const TargetMesh& target) {
  live::BoneSet out;
  out.fill(true);
  if (target.own)
    for (size_t j = 1; j < out.size(); ++j) out[j] = target.own->rig().offset[j].isZero();
  return out;
}

/// Answers one cloud before any has come, so that the first is not slow, and weights that cannot
/// answer are known before anything is opened.
void warm_up(System& system) {
  for (int k = 0; k < 2; ++k) try {
      system.push(system.target().vertices, "the target", [](const RetargetedFrame&) {});
    } catch (const UnusableCloud&) {  // a target of few vertices, which says nothing of clouds
    }
  system.restart();
}

/// The clouds of a mailbox through the system and out, until there are no more.
class Stream {
 public:
  Stream(const StreamCommand& c, System& system, StreamJoints& joints, live::VmcSender& vmc,
         live::PageServer* page, StreamTake* take, live::Mailbox& box, live::Words& words)
      : c_(c),
        to_ours_(c.how.source.scale, c.how.source.up),
        door_(frame_of(c.how.source), c.how.options.force),
        person_(c.how.person),
        system_(system),
        joints_(joints),
        vmc_(vmc),
        page_(page),
        take_(take),
        box_(box),
        words_(words) {}

  /// Until the input ends, the time is over or a signal comes.
  void run() {
    constexpr std::chrono::milliseconds kLook{10}, kClose{2};
    while (!stop_requested() && !(c_.seconds && lasted() >= *c_.seconds)) {
      if (box_.take(come_, waits_ ? kClose : kLook)) {
        place();
      } else if (waits_ && (live::Clock::now() >= *waits_ || box_.ended())) {
        waits_.reset();
        timeline_.take_early();
        answer();
      } else if (box_.ended()) {
        break;
      } else {
        go_on();
      }
    }
    late_ += waits_.has_value();
    look_for_few(true);
  }

  double lasted() const { return since(begun_); }
  StreamSummary summary() const;
  const live::LatencyMeter& latency() const { return latency_; }

 private:
  static double since(live::Clock::time_point start) {
    return std::chrono::duration<double>(live::Clock::now() - start).count();
  }
  static int64_t moments_since(live::Clock::time_point start) {
    return std::max<int64_t>(1, std::llround(kFps * since(start)));
  }

  /// The cloud that has come, in time. One that comes too late leaves the one that waits alone.
  void place() {
    if (!come_.line.empty() && !read_line()) return;
    left_out_ += come_.left_out;
    come_.seconds = clock_.seconds(come_, words_);
    const live::Step step = timeline_.place(come_.seconds, come_.sender);
    if (step.kind == live::Step::Kind::late) {
      ++late_;
      if (++late_in_a_row_ == live::kMostMissed)
        words_.warn("late", format("the times of the %ss do not go on; check the sender's clock",
                                   live::what_of(come_)));
      return;
    }
    late_in_a_row_ = 0;
    late_ += waits_.has_value();
    waits_.reset();
    std::swap(cloud_, come_);
    std::swap(line_, joints_come_);
    switch (step.kind) {
      case live::Step::Kind::late:
        return;
      case live::Step::Kind::early:
        waits_ = cloud_.arrived + std::chrono::duration_cast<live::Clock::duration>(
                                      std::chrono::duration<double>(step.wait));
        return;
      case live::Step::Kind::anew:
        begin_anew();
        break;
      case live::Step::Kind::next:
        missed_ += step.missed;
    }
    answer();
  }

  /// False: the line that has come is none of joints.
  bool read_line() {
    try {
      joints_come_ = joints_.read(come_);
    } catch (const UnusableCloud& fault) {
      leave_out("a line", fault, joints_.holds_fault());
      return false;
    }
    come_.seconds = joints_come_.seconds.value_or(
        std::chrono::duration<double>(come_.arrived.time_since_epoch()).count());
    return true;
  }

  /// `held`: it is told later.
  void leave_out(const std::string& what, const InputError& fault, bool held = false) {
    ++unusable_;
    why_ = fault;
    if (!held) words_.warn("unusable", what + " was left out: " + fault.what());
  }

  void answer() {
    if (missed_ > live::kMostMissed) begin_anew();
    if (!cloud_.line.empty()) return answer_joints();
    if (!c_.how.layout.empty())
      throw InputError(cloud_.name, "sends clouds, and --layout is for joints", "leave it out");
    for (; told_ < missed_ && going_; ++told_) system_.miss();
    thin();
    left_out_ += to_ours_.clean(cloud_.points);
    bool made = false;
    const auto keep = [&](const RetargetedFrame& frame) {
      newest_ = frame;
      made = true;
    };
    try {
      person_.choose(cloud_.points, cloud_.name, cloud_.sender);
      door_.pass(cloud_.points, cloud_.name,
                 [&] { system_.push(cloud_.points, cloud_.name, keep); });
    } catch (const InputError& fault) {
      if (door_.hopeless()) throw;  // so the program ends
      leave_out("a cloud", fault);
      ++missed_;
      return;
    }
    unshown_ += missed_ + 1;
    missed_ = told_ = 0;
    look_for_few();
    if (made) show();
    going_ = true;
  }

  /// The same of a line of joints. Those that are learnt from are answered by nothing.
  void answer_joints() {
    std::optional<RetargetedFrame> made;
    try {
      made = joints_.answer(line_, cloud_, missed_ - told_);
    } catch (const UnusableCloud& fault) {
      leave_out("a line", fault, joints_.holds_fault());
      told_ = ++missed_;
      return;
    }
    unshown_ += missed_ + 1;
    missed_ = told_ = 0;
    if (made) {
      newest_ = std::move(*made);
      show();
    }
    going_ = true;
  }

  /// Says once, when some clouds have come (or `all`), that they are too sparse.
  void look_for_few(bool all = false) {
    constexpr size_t kSome = 30;
    if (sparse_.clouds() == kSome) return;
    if (!all) sparse_.add(cloud_.points);
    if ((all || sparse_.clouds() == kSome) && newest_.confidence) sparse_.warn("the clouds");
  }

  /// In the take the moments of a sequence's clouds count, and between sequences the time that has
  /// passed.
  void show() {
    const int64_t after = going_ ? unshown_ : moments_since(answered_);
    unshown_ = 0;
    send(newest_);
    if (take_ != nullptr) take_->show(newest_, after);
  }

  /// More points than a network looks at cost time and say nothing new.
  void thin() {
    constexpr size_t kEnough = 100'000;
    Points& points = cloud_.points;
    const size_t step = (points.size() + kEnough - 1) / kEnough;
    if (step < 2) return;
    words_.warn("many", format("a cloud has %zu points; one in %zu is used", points.size(), step));
    for (size_t k = 0; k * step < points.size(); ++k) points[k] = points[k * step];
    points.resize((points.size() + step - 1) / step);
  }

  void begin_anew() {
    if (going_) {
      system_.restart();
      ++restarts_;
    }
    joints_.restart();
    going_ = false;
    missed_ = told_ = unshown_ = 0;
  }

  void send(const RetargetedFrame& frame) {
    const double seconds = lasted();
    sent_ = answered_ = live::Clock::now();
    const std::string trouble = vmc_.send(frame.pose, seconds);
    if (!trouble.empty()) {
      ++unsent_;
      words_.warn("sending", "a frame could not be sent to --vmc: " + trouble);
    } else {
      ++out_;
      latency_.add(1e3 * since(cloud_.arrived));
    }
    if (page_ != nullptr)
      page_->send(live::frame_message(seconds, frame.confidence.value_or(NAN), frame.vertices));
  }

  /// While the source is silent, the last pose goes on, so that a receiver can tell a pause from a
  /// program that is gone; the page needs no more pictures of it.
  void go_on() {
    constexpr double kSilent = 0.25;  // seconds
    if (out_ + unsent_ == 0 || since(answered_) < kSilent) return;
    if (take_ != nullptr) take_->hold(moments_since(answered_) - 1);
    if (since(sent_) < 1 / kFps) return;
    sent_ = live::Clock::now();
    if (vmc_.send(newest_.pose, lasted(), false).empty()) ++repeated_;
  }

  const StreamCommand& c_;
  const ToOurs to_ours_;
  CloudDoor door_;
  StreamPerson person_;
  System& system_;
  StreamJoints& joints_;
  live::VmcSender& vmc_;
  live::PageServer* page_;
  StreamTake* take_;
  live::Mailbox& box_;
  live::Words& words_;
  const live::Clock::time_point begun_ = live::Clock::now();
  live::Clock::time_point sent_ = begun_, answered_ = begun_;  ///< the last pose; the last new one
  live::SenderClock clock_;
  live::Timeline timeline_;
  live::LatencyMeter latency_;
  RetargetedFrame newest_;  ///< of the result
  SparseWatch sparse_;
  live::LiveCloud come_, cloud_;  ///< what has just come; what is answered, or waits
  JointLine joints_come_, line_;  ///< the same of lines of joints
  std::optional<live::Clock::time_point> waits_;  ///< the cloud is early: how long it waits
  bool going_ = false;             ///< the system has answered a cloud of this sequence
  int64_t missed_ = 0, told_ = 0;  ///< moments since the last answer; those the system knows of
  int64_t unshown_ = 0;            ///< moments since a pose was shown, within a sequence
  int64_t out_ = 0, late_ = 0, late_in_a_row_ = 0, unusable_ = 0, unsent_ = 0, restarts_ = 0,
          repeated_ = 0;
  size_t left_out_ = 0;
  std::optional<InputError> why_;  ///< the last one that was left out
};

StreamSummary Stream::summary() const {
  return {.counts = box_.counts(),
          .out = out_,
          .late = late_,
          .unusable = unusable_,
          .unsent = unsent_,
          .restarts = restarts_,
          .repeated = repeated_,
          .points_left_out = left_out_,
          .seconds = lasted(),
          .what = live::what_of(cloud_.line.empty() ? come_ : cloud_),
          .learning = joints_.learning(),
          .why = why_};
}

/// Null: none is asked for.
std::unique_ptr<StreamTake> take_of(const StreamCommand& c, const SinkOptions& options,
                                    const System& system, const TargetMesh& target) {
  if (options.out.empty()) return nullptr;
  return std::make_unique<StreamTake>(
      options, Shown{system.target(), system.rig(), target.unposed ? &*target.unposed : nullptr},
      c.folder() ? clip_name({.path = c.in}) : "stream", c.how.target, target.own);
}

void say_done(bool json, const Stream& stream, const StreamTake* take) {
  const StreamSummary summary = stream.summary();
  Json document = summary.json(stream.latency());
  std::string text = summary.text(stream.latency());
  if (take != nullptr) {
    const bool wrote = take->frames() > 0;
    document["out"] = wrote ? Json(take->out()) : Json();
    document["take_frames"] = take->frames();
    if (wrote) text += "wrote " + take->out() + ": " + counted(take->frames(), "frame") + "\n";
  }
  print(json, document, text);
}

/// InputError: a file is asked for, and no pose was shown to be kept.
void say_if_nothing(const std::string& in, const Stream& stream, const StreamTake* take) {
  const auto why = stream.summary().nothing_shown(in == "-" ? "standard input" : in);
  if (!why) return;
  if (take == nullptr || stop_requested()) {
    if (!stream.summary().why || stream.summary().why->cause() != why->cause())  // else told
      log_warning(why->what());
    if (take != nullptr) log_warning(take->out() + " is not written: no pose was shown");
    return;
  }
  throw InputError(why->where(), why->cause() + ": " + take->out() + " is not written",
                   why->mend());
}

int run_stream(const StreamCommand& c, const Common& common) {
  const StreamPlaces places = check_stream(c);
  const ToOurs in_range(c.how.source.scale, c.how.source.up);
  const StreamPerson known(c.how.person);
  TargetMesh target = read_target(c.how.target, c.how.bones);
  check_mesh(c.how, target);
  SystemInput made_from = load_input(c.how, common);
  RetargetCommand how = c.how;
  for (std::string* asked : {&how.floor, &how.contacts})
    if (asked->empty()) *asked = "on";  // nobody measures what is shown
  check_kept(how, target);
  const SinkOptions to = sink_options(how, made_from, target);
  const auto system = system_for(how, std::move(made_from), target);
  if (system->rig() == nullptr)
    throw InputError(c.how.target, "is moved without bones by --system " + c.how.system,
                     "use --system chain");
  const std::unique_ptr<StreamTake> take = take_of(c, to, *system, target);
  warm_up(*system);
  live::Mailbox box;
  live::Words words;
  live::VmcSender vmc(places.vmc, *system->target_joints(), bones_of(target));
  std::unique_ptr<live::PageServer> page;
  if (places.page)
    page = std::make_unique<live::PageServer>(*places.page, "--ws",
                                              live_page(c.how.target, system->target()));
  auto input = open_input(c, places, common.max_memory);
  say_target(target);
  const StopScope stop;
  say_places(c, places);
  StreamJoints joints(how, target, *system, page != nullptr);
  Stream stream(c, *system, joints, vmc, page.get(), take.get(), box, words);
  {
    live::Reading reading(std::move(input), box, words);
    stream.run();
    reading.end();
  }
  joints.finish();
  say_if_nothing(c.in, stream, take.get());
  if (take) take->finish();
  say_done(common.json, stream, take.get());
  try {
    throw_if_stopped();
  } catch (const Interrupted& signal) {  // what was asked for is done
    return signal.exit_code;
  }
  return 0;
}

}  // namespace

void add_stream(Program& program) {
  auto [app, c] = program.add(
      "stream",
      "a character performs clouds or joints while they are captured: VMC protocol, live page",
      "restage stream --target hero.vrm --source tcp://127.0.0.1:9000 --vmc 127.0.0.1:39539\n"
      "restage stream --target hero.vrm --source captured/ --vmc 127.0.0.1:39539 --ws 8080\n"
      "camera | restage stream --target hero.glb --source - --vmc 127.0.0.1:39539 --seconds 60 "
      "--json\n"
      "tracker | restage stream --target hero.vrm --source - --layout mediapipe33 --vmc 39539\n"
      "restage stream --target hero.vrm --source captured/ --person nearest --vmc 39539\n"
      "restage stream --target hero.vrm --source captured/ --vmc 39539 --out take.vrm --clip-name "
      "Take\n"
      "restage stream --target hero.glb --source captured/ --vmc 39539 --out take.glb "
      "--animation-only\n"
      "restage stream --target hero.ply --source captured/ --vmc 39539 --out take.glb --skeleton "
      "mixamo\n"
      "restage stream --target odd.glb --bones names.yaml --weights runs/demo-1 --source captured/ "
      "--source-up z --scale mm --vmc 39539\n"
      "restage stream --target hero.ply --source tcp://0.0.0.0:9000 --vmc 192.168.0.7:39539 --ws "
      "0.0.0.0:8080 --samples 1 --min-confidence 0.5\n"
      "restage stream --target hero.glb --source captured/ --vmc 39539 --anchor 0 --floor off "
      "--contacts off "
      "--no-foot-lock "
      "--no-steady-bones --no-keep-limbs --force --device cuda\n"
      "restage stream --target hero.ply --system register --rest rest.h5 --source captured/ --vmc "
      "39539",
      run_stream);
  app.add_option("--source,SOURCE", c.in,
                 "a folder that is being written, - (frames or JSON lines of joints on standard "
                 "input), or tcp://ADDRESS:PORT to listen on")
      .required()
      .formerly("--in");
  add_target_options(app, c.how);
  app.add_option("--vmc", c.vmc, "HOST:PORT to send the bones to (VMC protocol, OSC over UDP)")
      .required();
  app.add_option(
      "--ws", c.ws,
      "PORT or ADDRESS:PORT, where ADDRESS is 127.0.0.1 if left out, of a page that shows the "
      "character, and of its WebSocket (default: no page)");
  app.add_option("--out", c.how.to.out,
                 "X.glb, X.gltf, X.vrm, X.vrma or X.bvh: keeps what is shown, as 'retarget' would "
                 "write it, and writes it when the stream ends; 30 frames a second, and where no "
                 "new pose came in time the last one again (default: nothing is kept)");
  add_animation_options(app, c.how.to);
  app.add_option("--seconds", c.seconds, "ends after so many seconds (default: with the input)");
  app.add_option("--layout", c.how.layout,
                 "of joints without rotations, in which order they are, as in 'retarget' (default: "
                 "the one that fits)");
  app.add_option("--person", c.how.person,
                 "of several people this one: a number from 0, as in 'retarget' (in clouds from -x "
                 "to +x in the first one, in joints by their ids: 0 is the lowest), or nearest: "
                 "who is nearest to the origin when the "
                 "stream begins (default: there is one person)");
  add_weights_options(app, c.how);
  add_source_up(app, c.how.source);
  add_scale(app, c.how.source.scale, "the source's units in metres", "1; of joints: found");
  add_system_options(app, c.how);
  add_force(app, c.how.options.force,
            "a target that is no T-pose, clouds in which nobody is found");
}

}  // namespace restage::cli
