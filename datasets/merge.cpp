#include "datasets/merge.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "autograd/base/error.h"
#include "autograd/base/output_check.h"
#include "datasets/schema.h"
#include "datasets/schema_detail.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// What a file holds, without its values.
struct Content {
  std::vector<std::string> bodies, motions;
};

std::vector<std::string> members(const h5::File& file, const std::string& group) {
  return file.has(group) ? file.children(group) : std::vector<std::string>();
}

/// Looks at all files before anything is written.
class Plan {
 public:
  Plan(const std::vector<std::string>& files, const std::string& out, bool prefix)
      : prefix_(prefix) {
    if (files.size() < 2) throw InputError("", "one file is nothing to merge", "give two or more");
    check_output(out, files);
    std::vector<std::string> licenses, provenances;
    for (const std::string& file : files) look_at(file, licenses, provenances);
    refuse(body_clashes_, "bodies");
    refuse(motion_clashes_, "motions");
    info.license = joined_texts(licenses);
    info.provenance = joined_texts(provenances);
  }

  std::string id(const std::string& file, const std::string& name) const {
    return prefix_ ? fs::path(file).stem().string() + "_" + name : name;
  }

  std::vector<Content> content;
  FileInfo info;

 private:
  void look_at(const std::string& path, std::vector<std::string>& licenses,
               std::vector<std::string>& provenances) {
    const h5::File file = open_schema_file(path);
    Content& has = content.emplace_back();
    has.bodies = members(file, "/bodies");
    has.motions = members(file, "/motions");
    if (has.bodies.empty() && has.motions.empty())
      throw InputError(path, "holds neither bodies nor motions",
                       "give files that 'restage data build' or 'import' wrote");
    if (!has.motions.empty() && read_fps(file) != kFps)
      throw InputError(path, "has motions that are not at 30 fps", "import them again");
    for (const std::string& name : has.bodies) {
      note(path, name, bodies_, body_clashes_);
      checked_split(file, "/bodies/" + name);
    }
    for (const std::string& name : has.motions) {
      note(path, name, motions_, motion_clashes_);
      check_subject(path, file, "/motions/" + name);
    }
    licenses.push_back(file.text("/", "license").value_or("unknown"));
    provenances.push_back(file.text("/", "provenance").value_or("unknown"));
  }

  void note(const std::string& path, const std::string& name,
            std::map<std::string, std::string>& ids, std::vector<std::string>& clashes) const {
    const auto [at, fresh] = ids.emplace(id(path, name), path);
    if (!fresh) clashes.push_back("'" + at->first + "' of " + at->second + " and " + path);
  }

  static std::string checked_split(const h5::File& file, const std::string& object) {
    const std::string split = file.text(object, "split").value_or("");
    if (!is_split(split))
      throw InputError(file.path() + ":" + object, "has the split '" + split.substr(0, 60) + "'",
                       "import it again with {split} train, validation or test");
    return split;
  }

  /// A subject in two splits would let a test meet a person that training has seen.
  void check_subject(const std::string& path, const h5::File& file, const std::string& motion) {
    const std::string subject = file.text(motion, "subject").value_or("");
    const std::string split = checked_split(file, motion);
    if (subject.empty()) return;
    const std::string& first = splits_.emplace(subject, split).first->second;
    if (first != split)
      throw InputError(path,
                       "subject '" + subject + "' is in the split '" + split + "' here and in '" +
                           first + "' before",
                       "import one of them again with another {subject} or {split}");
  }

  void refuse(const std::vector<std::string>& clashes, const std::string& what) const {
    if (clashes.empty()) return;
    std::string named = clashes[0];
    if (clashes.size() > 1) named += " (and " + std::to_string(clashes.size() - 1) + " more)";
    throw InputError("", "two " + what + " have the same id: " + named,
                     prefix_ ? "rename one of the files, whose names are the prefixes"
                             : "add {prefix} to put the files' names before the ids");
  }

  bool prefix_;
  std::map<std::string, std::string> bodies_, motions_;  // id to file
  std::map<std::string, std::string> splits_;            // subject to split
  std::vector<std::string> body_clashes_, motion_clashes_;
};

}  // namespace

MergeSummary merge_data(const std::vector<std::string>& files, const std::string& out,
                        const MergeOptions& options) {
  const Plan plan(files, out, options.prefix);
  DatasetWriter writer(out, plan.info);
  MergeSummary done{0, 0, plan.info.license, plan.info.provenance};
  for (size_t i = 0; i < files.size(); ++i) {
    const h5::File file = open_schema_file(files[i]);
    SharedShapes shared;
    for (const std::string& name : plan.content[i].bodies) {
      Body body = read_body(file, name, shared);
      body.id = plan.id(files[i], name);
      writer.add(body);
      ++done.bodies;
    }
    for (const std::string& name : plan.content[i].motions) {
      Motion motion = read_motion(file, name);
      motion.id = plan.id(files[i], name);
      writer.add(motion);
      ++done.motions;
    }
  }
  writer.commit();
  return done;
}

}  // namespace restage
