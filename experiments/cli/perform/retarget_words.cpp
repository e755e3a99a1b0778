#include "experiments/cli/perform/retarget_words.h"

#include <algorithm>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "datasets/doctor/shape.h"
#include "datasets/readers/errors.h"
#include "nn/models/extraction.h"

namespace restage::cli {
namespace {

std::string fact(const ImportReport& report, const std::string& wanted) {
  for (const auto& [name, value] : report.facts)
    if (name == wanted) return value;
  return "";
}

/// "Mixamo (profile mixamo); placed: neck" -> "Mixamo bones". VRM's list is named by the file's
/// kind.
std::string family(const ImportReport& report) {
  const std::string names = fact(report, "names");
  if (names.empty() || names.starts_with("VRM's list")) return names.empty() ? "" : "bones";
  if (names.starts_with("found by parts")) return "bones of no known family";
  return names.substr(0, std::min(names.find(" (profile"), names.find(';'))) + " bones";
}

std::string rest_pose(const ImportReport& report) {
  const std::string said = fact(report, "rest pose");
  return said.starts_with("turned onto") ? "A-pose turned into T-pose" : said;
}

void say(const std::string& line, const ImportReport& report) {
  log_info(report.file + ": " + line);
  for (const auto& [name, value] : report.facts)
    log_debug(report.file + ": " + name + ": " + value);
  for (const std::string& remark : report.remarks) log_info(report.file + ": " + remark);
}

}  // namespace

void say_target(const TargetMesh& target) {
  const ImportReport& report = target.report;
  if (!target.own) {
    for (const std::string& remark : report.remarks) log_warning(report.file + ": " + remark);
    return;
  }
  const Gltf& file = target.own->file();
  std::string line = file.standard.empty() ? "" : file.standard + ", ";
  line +=
      cat(family(report), " (", file.skin_nodes.empty() ? "rigid parts" : cat(skin_joints(file)),
          "), ", rest_pose(report), ", ", counted(file.meshes, "mesh", "meshes"));
  if (file.morph_targets > 0) line += ", " + counted(file.morph_targets, "morph target");
  say(line, report);
}

void say_take(const SkeletonTake& take) {
  std::string line = family(take.report);
  line += cat(line.empty() ? "" : ", ", take.name, ": ", take.frames.size(),
              " frames at 30 a second", take.fingers.empty() ? "" : ", with fingers");
  say(line, take.report);
  if (fact(take.report, "joints").empty()) return;  // of joints, what was found is in doubt
  for (const auto& [name, value] : take.report.facts)
    log_info(take.report.file + ": " + name + ": " + value);
}

std::string source_words(std::string text) {
  for (const std::string option : {"--bones", "--up"}) {
    const std::string other = "--source" + option.substr(1);
    for (size_t at = text.find(option); at != std::string::npos;
         at = text.find(option, at + other.size()))
      text.replace(at, option.size(), other);
  }
  return text;
}

void warn_if_unsure(const std::string& source, std::vector<double> confidence) {
  constexpr double kUnsure = 0.4, kLost = 0.25;
  constexpr int64_t kMany = 10;  // fewer are hard to see
  if (confidence.empty()) return;
  const int64_t lost =
      std::count_if(confidence.begin(), confidence.end(), [](double sure) { return sure < kLost; });
  const auto middle = confidence.begin() + std::ssize(confidence) / 2;
  std::nth_element(confidence.begin(), middle, confidence.end());
  if (*middle < kUnsure)
    log_warning(source + format(": the networks are unsure of most frames (median confidence "
                                "%.2f); do they show one whole person, y up, in metres?",
                                *middle));
  else if (lost > kMany)
    log_warning(source + format(": in %lld frames nobody can be made out (confidence below %.2f); "
                                "see what 'restage doctor' says of it",
                                static_cast<long long>(lost), kLost));
}

void SparseWatch::add(const Points& cloud) {
  constexpr size_t kSurelyEnough = 10 * kEnoughToTrust;  // no need to look for repeats
  counts_.push_back(cloud.size() > kSurelyEnough ? cloud.size() : distinct(cloud).size());
}

void SparseWatch::warn(const std::string& source) const {
  if (counts_.empty()) return;
  std::vector<size_t> counts = counts_;
  const auto middle = counts.begin() + std::ssize(counts) / 2;
  std::nth_element(counts.begin(), middle, counts.end());
  if (*middle < kEnoughToTrust)
    log_warning(cat(source, ": with ", *middle,
                    " points a frame (median) the confidence promises too much: of clouds "
                    "that show one side it can be trusted from ",
                    kEnoughToTrust, " points on (docs/real_scans.md, Sparse clouds)"));
}

}  // namespace restage::cli
