// restage stream --person: one of several people in clouds that are being captured.
#pragma once

#include <optional>
#include <string>

#include "datasets/doctor/people.h"

namespace restage::cli {

class StreamPerson {
 public:
  /// `asked`: empty (all points are the person's), a number from 0, or "nearest". InputError: none
  /// of these.
  explicit StreamPerson(const std::string& asked);

  /// Leaves the points of who is asked for, a cloud in metres, y up. Another `sender` shows other
  /// people. UnusableCloud: it does not show that person.
  void choose(Points& cloud, const std::string& where, int64_t sender);

 private:
  size_t nearest(const std::vector<Points>& people) const;

  bool any_ = false, nearest_ = false;
  std::optional<size_t> who_;
  PeopleTracker people_;
  int64_t sender_ = 0;
  int unseen_ = 0;  ///< clouds in a row that do not show who was nearest
};

}  // namespace restage::cli
