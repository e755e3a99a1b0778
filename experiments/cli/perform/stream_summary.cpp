#include "experiments/cli/perform/stream_summary.h"

#include <algorithm>

#include "autograd/base/format.h"
#include "autograd/base/words.h"

namespace restage::cli {
namespace {

/// "other_sender" as words.
std::string spaced(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

}  // namespace

Json StreamSummary::json(const live::LatencyMeter& latency_meter) const {
  // What waited in the end, and what a network that looks ahead had not answered yet.
  const int64_t unanswered = counts.arrived - out - counts.overtaken - counts.other_sender - late -
                             unusable - counts.refused - unsent;
  Json latency = {{"p50", nullptr}, {"p99", nullptr}, {"max", nullptr}};
  if (latency_meter.count() > 0)
    latency = {{"p50", latency_meter.quantile(0.5)},
               {"p99", latency_meter.quantile(0.99)},
               {"max", latency_meter.longest()}};
  return {{"frames_in", counts.arrived},
          {"frames_out", out},
          {"dropped", counts.arrived - out},
          {"dropped_because",
           {{"overtaken", counts.overtaken},
            {"other_sender", counts.other_sender},
            {"late", late},
            {"unusable", unusable + counts.refused},
            {"unsent", unsent},
            {"unanswered", unanswered}}},
          {"points_left_out", points_left_out},
          {"restarts", restarts},
          {"repeated", repeated},
          {"seconds", seconds},
          {"latency_ms", latency}};
}

std::string StreamSummary::text(const live::LatencyMeter& latency_meter) const {
  const Json all = json(latency_meter);
  std::string text =
      format("%lld frames in, %lld out, %lld dropped", static_cast<long long>(all["frames_in"]),
             static_cast<long long>(all["frames_out"]), static_cast<long long>(all["dropped"]));
  std::string reasons;
  for (const auto& [reason, count] : all["dropped_because"].items())
    if (count != 0)
      reasons += (reasons.empty() ? " (" : ", ") + count.dump() + " " + spaced(reason);
  if (!reasons.empty()) text += reasons + ")";
  if (latency_meter.count() > 0)
    text += format(
        "; from a %s's last byte to its packet %.1f ms (p50), %.1f ms (p99), %.1f ms at most",
        what.c_str(), latency_meter.quantile(0.5), latency_meter.quantile(0.99),
        latency_meter.longest());
  return text + "\n";
}

std::optional<InputError> StreamSummary::nothing_shown(const std::string& name) const {
  if (out + unsent > 0) return {};
  if (counts.arrived == 0)
    return InputError(name, "no frame came", "docs/stream.md says what a frame is");
  if (2 * counts.overtaken > counts.arrived)
    return InputError(
        name,
        format("%lld of %lld %ss came faster than they can be taken, and no pose was shown",
               static_cast<long long>(counts.overtaken), static_cast<long long>(counts.arrived),
               what.c_str()),
        "send them as they are captured; a file is for restage retarget --source take.jsonl");
  if (2 * late > counts.arrived - counts.overtaken)
    return InputError(name, format("the times of its %ss do not go on", what.c_str()),
                      "check the sender's clock, or send no times");
  if (learning > 0)
    return InputError(name,
                      cat("joints of ", counted(learning, "moment"),
                          " came, and a second of them has to be learnt from before anybody moves"),
                      "send more of them");
  if (why) return why;
  return InputError(name, "no pose was shown", "send a second or more of somebody");
}

}  // namespace restage::cli
