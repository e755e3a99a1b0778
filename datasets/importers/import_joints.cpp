// import_data() of joints without rotations.
#include <filesystem>

#include "autograd/base/output_check.h"
#include "datasets/importers/import_detail.h"
#include "datasets/importers/joints/solve.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/folders.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

JointFileOptions how(const ImportOptions& options) {
  JointFileOptions out;
  out.layout = options.motion.layout;
  out.person = options.person;
  out.max_memory = options.max_memory;
  return out;
}

/// A folder of files that are one recording together has one; others are recordings each.
std::vector<std::string> recordings_in(const std::string& source, const ImportOptions& options) {
  std::error_code error;
  if (!fs::is_directory(source, error) || find_joint_recording(source, how(options)))
    return {source};
  return files_below(source, may_hold_joints);
}

}  // namespace

bool holds_joints(const std::string& source, const ImportOptions& options) {
  JointFileOptions any = how(options);
  any.person = "0";  // whoever it is
  if (find_joint_recording(source, any)) return true;
  std::error_code error;
  if (!fs::is_directory(source, error)) return false;
  const std::vector<std::string> files = files_below(source, may_hold_joints);
  try {
    return !files.empty() && find_joint_recording(files[0], any).has_value();
  } catch (const InputError&) {
    return false;  // what reads the folder names it when its turn comes
  }
}

ImportSummary import_joints(const std::string& source, const std::string& out,
                            const ImportOptions& options) {
  check_options({InputKind::joints}, source, options);
  const std::vector<std::string> files = recordings_in(source, options);
  check_output(out, files);
  ImportSummary summary;
  ImportWriter writer(out, file_info(source, options), summary);
  const std::map<std::string, std::string> people = subjects_of(files, source, options.subjects);
  add_each(files, summary, [&](const std::string& file) {
    const auto joints = find_joint_recording(file, how(options));
    if (!joints) throw InputError(file, "holds no joints", "move it to a folder of its own");
    ImportReport report;
    report.file = file;
    MotionOptions named = options.motion;
    if (named.id.empty()) named.id = fs::path(file).stem().string();
    if (const auto who = people.find(file); who != people.end()) named.subject = who->second;
    if (named.subject.empty()) named.subject = named.id;
    SolvedJoints solved = solve_joints(*joints, named, report);
    writer.add(file, {}, {std::move(solved.motion)});
    summary.reports.push_back(std::move(report));
  });
  check_any(summary, source);
  writer.commit();
  return summary;
}

}  // namespace restage
