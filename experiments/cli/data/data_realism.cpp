// restage data realism: how believable the bodies and motions of a data file are when posed.

#include <span>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/benchmark/realism.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"

namespace restage::cli {
namespace {

std::string percent(double share) { return format("%.1f %%", 100 * share); }
std::string centimetres(double metres) { return format("%.1f cm", 100 * metres); }

std::string first_few(const std::vector<std::string>& names) {
  return names.empty() ? "none" : joined(std::span(names).first(std::min<size_t>(names.size(), 6)));
}

Json realism_json(const BentVolume& v) { return {{"surface", v.ours}, {"linear_blend", v.linear}}; }

Json realism_json(const RealismReport& r) {
  return {
      {"bodies", r.bodies},
      {"motions", r.motions},
      {"frames", r.frames},
      {"knee_volume", {{"mean", realism_json(r.knee_mean)}, {"least", realism_json(r.knee_least)}}},
      {"elbow_volume",
       {{"mean", realism_json(r.elbow_mean)}, {"least", realism_json(r.elbow_least)}}},
      {"joints_inside", {{"rest", r.joints_inside_rest}, {"posed", r.joints_inside_posed}}},
      {"joints_outside", r.outside},
      {"buried_at_rest", r.buried},
      {"buried_at", r.buried_at},
      {"lowest_point", r.lowest},
      {"on_floor", r.on_floor},
      {"slipping", r.slipping}};
}

std::string realism_text(const RealismReport& r) {
  const auto volume = [](const BentVolume& mean, const BentVolume& least) {
    return percent(mean.ours) + ", least " + percent(least.ours) +
           " (linear blending: " + percent(mean.linear) + ", least " + percent(least.linear) + ")";
  };
  std::string out =
      std::to_string(r.bodies) + " bodies, " + std::to_string(r.motions) + " motions\n" +
      "knee bent by 90 degrees keeps    " + volume(r.knee_mean, r.knee_least) + " of its volume\n" +
      "elbow bent by 90 degrees keeps   " + volume(r.elbow_mean, r.elbow_least) + "\n" +
      "joints inside the body, at rest  " + percent(r.joints_inside_rest) + "\n";
  if (r.frames > 0)
    out += "joints inside the body, posed    " + percent(r.joints_inside_posed) + "\n";
  out += "joints found outside             " + first_few(r.outside) + "\n" +
         "skin inside other parts at rest  " + percent(r.buried) +
         ", at: " + first_few(r.buried_at) + "\n";
  if (r.frames > 0)
    out += "lowest point, of " + std::to_string(r.frames) + " frames: least " +
           centimetres(r.lowest[0]) + ", 1 % below " + centimetres(r.lowest[1]) + ", median " +
           centimetres(r.lowest[2]) + ", 99 % below " + centimetres(r.lowest[3]) + ", most " +
           centimetres(r.lowest[4]) + "\nframes that touch the floor      " + percent(r.on_floor) +
           " (within 2 cm)\nskin on the floor slips at       " + centimetres(r.slipping) +
           "/s (median)\n";
  return out;
}

int run_realism(const std::string& file, const Common& common) {
  const std::string kind = inspect(file).kind;
  if (kind != "bodies" && kind != "dataset")
    throw InputError(file, "holds no bodies",
                     "give a data file with bodies, and best with motions");
  const RealismReport report = measure_realism(
      read_bodies(file), kind == "dataset" ? read_motions(file) : std::vector<Motion>{});
  print(common.json, realism_json(report), realism_text(report));
  return 0;
}

}  // namespace

void add_data_realism(Program& program, CommandOptions group) {
  auto [app, file] = program.add(group, "realism",
                                 "volume at bent joints, joints inside the body, feet on the floor",
                                 "restage data realism benchmark/test.h5", run_realism);
  app.add_option("FILE", file, "data file with bodies and motions (HDF5)").required();
}

}  // namespace restage::cli
