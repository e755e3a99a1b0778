// restage stream: clouds as they are captured in, the poses of a character out, while it happens.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "autograd/base/format.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "datasets/doctor/examine.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/text/text.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/retarget.h"
#include "experiments/cli/perform/retarget_words.h"
#include "experiments/cli/perform/source_options.h"
#include "experiments/source.h"
#include "infer/live/folder_input.h"
#include "infer/live/latency.h"
#include "infer/live/sender_clock.h"
#include "infer/live/server.h"
#include "infer/live/timeline.h"
#include "infer/live/vmc.h"
#include "infer/render/page.h"

namespace restage::cli {
namespace {

struct StreamCommand {
  RetargetCommand how;
  std::string in, vmc, ws;
  std::optional<double> seconds;
};

/// Where clouds come from, before anything is opened.
struct StreamPlaces {
  std::optional<live::Place> socket;  ///< else a folder, or standard input
  live::Place vmc;
  std::optional<live::Place> page;
};

constexpr const char* kTcp = "tcp://";

StreamPlaces check_stream(const StreamCommand& c) {
  check_options(c.how.options, system_type(c.how.system));
  if (c.seconds && !(*c.seconds > 0 && *c.seconds < 1e9))
    throw InputError("", "--seconds is out of range", "give more than 0 seconds");
  StreamPlaces out;
  const auto place = [](const std::string& text, const std::string& option) {
    return live::resolved(live::parse_place(text, option), option);
  };
  if (c.in.starts_with(kTcp))
    out.socket = place(c.in.substr(std::string(kTcp).size()), "--source");
  else if (c.in.find("://") != std::string::npos)
    throw InputError("", "--source '" + c.in.substr(0, 80) + "' is no kind of input",
                     "give a folder, - or tcp://127.0.0.1:PORT");
  else if (c.in != "-" && !std::filesystem::is_directory(c.in))
    throw InputError(c.in,
                     std::filesystem::exists(c.in) ? "is no folder" : "there is no such folder",
                     "give a folder into which clouds are written, - or tcp://127.0.0.1:PORT");
  out.vmc = place(c.vmc, "--vmc");
  if (!c.ws.empty()) out.page = place(c.ws, "--ws");
  if (out.socket && out.page && out.socket->port == out.page->port &&
      out.socket->host == out.page->host)
    throw InputError("", "--source and --ws name the same port", "give two");
  return out;
}

live::FolderFiles folder_files(uint64_t max_memory) {
  return {[](const std::string& name) {
            return !name.starts_with(".") &&
                   (is_mesh_name(name) || is_cloud_name(name) || is_text_name(name) ||
                    text::ends_in(name, {".npy", ".npz"}));
          },
          natural_less,
          [max_memory](const std::string& path, live::LiveCloud& into) {
            const auto file = open_frames(path, {.clip = "", .max_memory = max_memory});
            const int64_t before = file->frames() - 1;
            for (int64_t k = 0; k < before; ++k) file->skip();
            std::optional<Frame> frame = file->next();
            if (!frame) throw InputError(path, "holds no cloud", "write one into it");
            if (frame->fault) throw *frame->fault;
            into.left_out = frame->left_out;
            into.points = std::move(frame->points);
            return before;
          }};
}

std::unique_ptr<live::CloudInput> open_input(const StreamCommand& c, const StreamPlaces& places,
                                             uint64_t max_memory) {
  if (places.socket)
    return std::make_unique<live::SocketInput>(
        std::make_unique<live::Listener>(*places.socket, "--source"));
  if (c.in == "-") return std::make_unique<live::PipeInput>(STDIN_FILENO, "standard input");
  return std::make_unique<live::FolderInput>(c.in, folder_files(max_memory));
}

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

std::string live_page(const System& system, const std::string& name) {
  const Mesh& rest = system.target();
  Clip clip{name, {}, rest.faces};
  clip.frames.push_back(rest.vertices);
  const size_t all = std::numeric_limits<size_t>::max();
  return page_html({clip},
                   {.title = "restage stream", .max_bytes = all, .max_points = all, .live = true});
}

/// The clouds of a mailbox through the system and out, until there are no more.
class Stream {
 public:
  Stream(const StreamCommand& c, System& system, live::VmcSender& vmc, live::PageServer* page,
         live::Mailbox& box, live::Words& words)
      : c_(c),
        to_ours_(c.how.source.scale, c.how.source.up),
        door_(frame_of(c.how.source), c.how.options.force),
        system_(system),
        vmc_(vmc),
        page_(page),
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
        return;
      } else {
        go_on();
      }
    }
    late_ += waits_.has_value();
  }

  double lasted() const { return since(begun_); }
  Json json() const;
  std::string text() const;

 private:
  static double since(live::Clock::time_point start) {
    return std::chrono::duration<double>(live::Clock::now() - start).count();
  }

  /// The cloud that has come, in time. One that comes too late leaves the one that waits alone.
  void place() {
    left_out_ += come_.left_out;
    come_.seconds = clock_.seconds(come_, words_);
    const live::Step step = timeline_.place(come_.seconds, come_.sender);
    if (step.kind == live::Step::Kind::late) {
      ++late_;
      if (++late_in_a_row_ == live::kMostMissed)
        words_.warn("late", "the times of the clouds do not go on; check the sender's clock");
      return;
    }
    late_in_a_row_ = 0;
    late_ += waits_.has_value();
    waits_.reset();
    std::swap(cloud_, come_);
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

  void answer() {
    if (missed_ > live::kMostMissed) begin_anew();
    for (; told_ < missed_ && going_; ++told_) system_.miss();
    thin();
    left_out_ += to_ours_.clean(cloud_.points);
    bool made = false;
    const auto keep = [&](const RetargetedFrame& frame) {
      newest_ = frame;
      made = true;
    };
    try {
      door_.pass(cloud_.points, cloud_.name,
                 [&] { system_.push(cloud_.points, cloud_.name, keep); });
    } catch (const InputError& fault) {
      if (door_.hopeless()) throw;  // so the program ends
      ++unusable_;
      ++missed_;
      words_.warn("unusable", std::string("a cloud was left out: ") + fault.what());
      return;
    }
    missed_ = told_ = 0;
    going_ = true;
    if (made) send(newest_);
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
    going_ = false;
    missed_ = told_ = 0;
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
    if (out_ == 0 || since(answered_) < kSilent || since(sent_) < 1 / kFps) return;
    sent_ = live::Clock::now();
    if (vmc_.send(newest_.pose, lasted(), false).empty()) ++repeated_;
  }

  const StreamCommand& c_;
  const ToOurs to_ours_;
  CloudDoor door_;
  System& system_;
  live::VmcSender& vmc_;
  live::PageServer* page_;
  live::Mailbox& box_;
  live::Words& words_;
  const live::Clock::time_point begun_ = live::Clock::now();
  live::Clock::time_point sent_ = begun_, answered_ = begun_;  ///< the last pose; the last new one
  live::SenderClock clock_;
  live::Timeline timeline_;
  live::LatencyMeter latency_;
  RetargetedFrame newest_;        ///< of the result
  live::LiveCloud come_, cloud_;  ///< what has just come; what is answered, or waits
  std::optional<live::Clock::time_point> waits_;  ///< the cloud is early: how long it waits
  bool going_ = false;             ///< the system has answered a cloud of this sequence
  int64_t missed_ = 0, told_ = 0;  ///< moments since the last answer; those the system knows of
  int64_t out_ = 0, late_ = 0, late_in_a_row_ = 0, unusable_ = 0, unsent_ = 0, restarts_ = 0,
          repeated_ = 0;
  size_t left_out_ = 0;
};

/// "other_sender" as words.
std::string spaced(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

Json Stream::json() const {
  const live::Mailbox::Counts counts = box_.counts();
  // What waited in the end, and what a network that looks ahead had not answered yet.
  const int64_t unanswered = counts.arrived - out_ - counts.overtaken - counts.other_sender -
                             late_ - unusable_ - counts.refused - unsent_;
  Json latency = {{"p50", nullptr}, {"p99", nullptr}, {"max", nullptr}};
  if (latency_.count() > 0)
    latency = {{"p50", latency_.quantile(0.5)},
               {"p99", latency_.quantile(0.99)},
               {"max", latency_.longest()}};
  return {{"frames_in", counts.arrived},
          {"frames_out", out_},
          {"dropped", counts.arrived - out_},
          {"dropped_because",
           {{"overtaken", counts.overtaken},
            {"other_sender", counts.other_sender},
            {"late", late_},
            {"unusable", unusable_ + counts.refused},
            {"unsent", unsent_},
            {"unanswered", unanswered}}},
          {"points_left_out", left_out_},
          {"restarts", restarts_},
          {"repeated", repeated_},
          {"seconds", lasted()},
          {"latency_ms", latency}};
}

std::string Stream::text() const {
  const Json all = json();
  std::string out =
      format("%lld frames in, %lld out, %lld dropped", static_cast<long long>(all["frames_in"]),
             static_cast<long long>(all["frames_out"]), static_cast<long long>(all["dropped"]));
  std::string why;
  for (const auto& [reason, count] : all["dropped_because"].items())
    if (count != 0) why += (why.empty() ? " (" : ", ") + count.dump() + " " + spaced(reason);
  if (!why.empty()) out += why + ")";
  if (latency_.count() > 0)
    out += format(
        "; from a cloud's last byte to its packet %.1f ms (p50), %.1f ms (p99), %.1f ms at most",
        latency_.quantile(0.5), latency_.quantile(0.99), latency_.longest());
  return out + "\n";
}

void say_places(const StreamCommand& c, const StreamPlaces& places) {
  log_info("clouds come from " +
           (places.socket ? kTcp + places.socket->text()
            : c.in == "-" ? std::string("standard input")
                          : c.in) +
           "; poses go to " + places.vmc.text() + " (VMC)");
  if (places.page) log_info("the page is http://" + places.page->text() + "/");
  for (const auto& [place, what] :
       {std::pair(places.socket, "send clouds"), {places.page, "see the page"}})
    if (place && !place->loopback())
      log_warning("whoever reaches " + place->text() + " from another machine can " + what);
}

int run_stream(const StreamCommand& c, const Common& common) {
  const StreamPlaces places = check_stream(c);
  const ToOurs in_range(c.how.source.scale, c.how.source.up);
  TargetMesh target = read_target(c.how.target, c.how.bones);
  check_mesh(c.how, target);
  SystemInput made_from = load_input(c.how, common);
  RetargetCommand how = c.how;
  for (std::string* asked : {&how.floor, &how.contacts})
    if (asked->empty()) *asked = "on";  // nobody measures what is shown
  const auto system = system_for(how, std::move(made_from), target);
  if (system->rig() == nullptr)
    throw InputError(c.how.target, "is moved without bones by --system " + c.how.system,
                     "use --system chain");
  warm_up(*system);
  live::Mailbox box;
  live::Words words;
  live::VmcSender vmc(places.vmc, *system->target_joints(), bones_of(target));
  std::unique_ptr<live::PageServer> page;
  if (places.page)
    page = std::make_unique<live::PageServer>(
        *places.page, "--ws",
        live_page(*system, std::filesystem::path(c.how.target).filename().string()));
  auto input = open_input(c, places, common.max_memory);
  say_target(target);
  say_places(c, places);
  const StopScope stop;
  Stream stream(c, *system, vmc, page.get(), box, words);
  {
    live::Reading reading(std::move(input), box, words);
    stream.run();
    reading.end();
  }
  if (box.counts().arrived == 0) log_warning("no frame came; docs/stream.md says what a frame is");
  print(common.json, stream.json(), stream.text());
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
      "stream", "a character performs clouds while they are captured: VMC protocol, live page",
      "restage stream --target hero.vrm --source tcp://127.0.0.1:9000 --vmc 127.0.0.1:39539\n"
      "restage stream --target hero.vrm --source captured/ --vmc 127.0.0.1:39539 --ws 8080\n"
      "camera | restage stream --target hero.glb --source - --vmc 127.0.0.1:39539 --seconds 60 "
      "--json\n"
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
                 "a folder that is being written, - (frames on standard input), or "
                 "tcp://ADDRESS:PORT to listen on")
      .required()
      .formerly("--in");
  add_target_options(app, c.how);
  app.add_option("--vmc", c.vmc, "HOST:PORT to send the bones to (VMC protocol, OSC over UDP)")
      .required();
  app.add_option(
      "--ws", c.ws,
      "PORT or ADDRESS:PORT, where ADDRESS is 127.0.0.1 if left out, of a page that shows the "
      "character, and of its WebSocket (default: no page)");
  app.add_option("--seconds", c.seconds, "ends after so many seconds (default: with the input)");
  add_weights_options(app, c.how);
  add_source_up(app, c.how.source);
  add_scale(app, c.how.source.scale, "the clouds' units in metres");
  add_system_options(app, c.how);
  add_force(app, c.how.options.force,
            "a target that is no T-pose, clouds in which nobody is found");
}

}  // namespace restage::cli
