// Joints as JSON lines, a moment each: what a tracker writes while it sees somebody.
//   {"time": 1.033, "joints": [[x, y, z], null, ...]}
//   {"time": 1.033, "joints": {"left_hip": [x, y, z], ...}}
//   {"time": 1.033, "bodies": [{"body_id": 4, "joints": [...]}, ...]}
// and what joint_file.h says of one frame in a JSON file. Not known: null, NaN, a confidence of 0
// (the fourth number), 0 0 0 in a list but for its first joint, a name that is left out, a
// place that is nowhere in any unit (1e9).
#pragma once

#include <map>

#include "datasets/importers/joints/joint_file.h"

namespace restage {

struct JointLine {
  std::map<int64_t, FileFrame> people;  ///< by their ids, else by their places in the list
  std::optional<double> seconds;        ///< by the sender's clock; nothing: the line does not say
};

class JointLines {
 public:
  explicit JointLines(JointFileOptions options) : options_(std::move(options)) {}

  /// One line. InputError naming `where`: it is no JSON, or shows nobody's joints.
  JointLine read(const std::string& text, const std::string& where);
  /// Finds out of the first lines whose joints are wanted, and in which order they are. InputError
  /// as find_joint_recording().
  JointRecording learn(const std::vector<JointLine>& first, const std::string& where);
  /// The joints of the person that learn() chose; empty: the line does not show that person.
  /// InputError: another number of joints than the first lines had.
  FileFrame of_person(const JointLine& line, const std::string& where) const;
  /// What a line lacks that shows no pose of the person: the person, or hips and shoulders.
  std::string missing(const JointLine& line) const;
  /// How many names of joints have come so far; 0: joints have no names.
  size_t names() const { return names_.size(); }
  /// The order of joints that have names, as far as they have come.
  JointLayout named() const;

 private:
  JointFileOptions options_;
  std::vector<std::string> names_;
  bool any_ = false, named_ = false;  ///< lines have come; joints have names in them
  int64_t who_ = 0;
  size_t joints_ = 0;
};

}  // namespace restage
