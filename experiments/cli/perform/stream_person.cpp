#include "experiments/cli/perform/stream_person.h"

#include <limits>

#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/importers/joints/joint_lines.h"
#include "datasets/readers/text/text.h"
#include "nn/models/extraction.h"
#include "nn/models/views.h"

namespace restage::cli {

StreamPerson::StreamPerson(const std::string& asked) : any_(!asked.empty()) {
  nearest_ = asked == kNearestPerson;
  int64_t number = -1;
  if (!any_ || nearest_) return;
  if (!text::parse(std::string_view(asked), number) || number < 0)
    throw InputError("", "--person is a number from 0, or nearest", "give one");
  who_ = static_cast<size_t>(number);
}

void StreamPerson::choose(Points& cloud, const std::string& where, int64_t sender) {
  constexpr int kGone = 60;  // clouds, some two seconds
  if (!any_) return;
  if (sender != sender_ || (nearest_ && unseen_ >= kGone)) {
    people_.restart();
    unseen_ = 0;
    if (nearest_) who_.reset();
  }
  sender_ = sender;
  std::vector<Points> people = people_.follow(cloud);
  if (nearest_ && !who_ && !people.empty()) who_ = nearest(people);
  ++unseen_;
  if (who_ && *who_ >= people.size())
    throw UnusableCloud(
        where, cat("shows ", counted(people.size(), "person", "people"), ", no number ", *who_),
        "count them from 0, from -x to +x");
  if (!who_ || people[*who_].size() < kLeastDistinctPoints)
    throw UnusableCloud(where, cat("does not show person ", who_ ? cat(*who_) : "0"),
                        "look where that person is");
  unseen_ = 0;
  cloud = std::move(people[*who_]);
}

/// By the middle: to the origin, where the sensor mostly is.
size_t StreamPerson::nearest(const std::vector<Points>& people) const {
  size_t out = 0;
  float least = std::numeric_limits<float>::infinity();
  for (size_t p = 0; p < people.size(); ++p) {
    if (people[p].empty()) continue;
    Point middle = Point::Zero();
    for (const Point& x : people[p]) middle += x;
    middle /= static_cast<float>(people[p].size());
    if (middle.norm() < least) least = middle.norm(), out = p;
  }
  return out;
}

}  // namespace restage::cli
