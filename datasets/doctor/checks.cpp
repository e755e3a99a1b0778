// What `restage retarget` asks before it starts.
#include <algorithm>
#include <cmath>

#include "autograd/base/error.h"
#include "datasets/doctor/examine_detail.h"
#include "datasets/doctor/words.h"

namespace restage {

using namespace doctor_detail;

namespace {

constexpr double kNoPerson = 3;  // standard deviations from a person's size in any unit

/// Metres? Refused only where another unit fits a person well.
void check_unit(const UnitGuess& guess, const std::string& where, const std::string& fix) {
  if (guess.unit.metres == 1 || guess.sure < kSure) return;
  throw InputError(where,
                   std::string("1 unit seems to be 1 ") + guess.unit.name + " (sure " +
                       per_cent(guess.sure) + "), metres are expected",
                   fix);
}

std::string up_words(const Orientation& o) {
  return std::string("the head seems to point along ") + kDirections[static_cast<size_t>(o.up)] +
         " (sure " + per_cent(o.up_sure) + "), +y is expected";
}

}  // namespace

void check_source(const std::vector<Mesh>& first_frames, const std::string& where) {
  OrientationVote vote;
  std::vector<double> sizes;
  for (const Mesh& frame : first_frames) {
    if (frame.vertices.size() < kEnoughPoints) return;
    const PersonShape shape = shape_of(frame);
    vote.add(shape.points);
    sizes.push_back(shape.size);
  }
  if (sizes.empty()) return;
  std::nth_element(sizes.begin(), sizes.begin() + std::ssize(sizes) / 2, sizes.end());
  const UnitGuess guess = guess_unit(sizes[sizes.size() / 2]);
  if (std::abs(guess.deviation) > kNoPerson) return;
  check_unit(guess, where,
             "give --scale " + number(guess.unit.metres) + ", or --force to take it as it is");
  const Orientation o = vote.result();
  if (o.up == 2 || o.up_sure < kVerySure) return;
  throw InputError(
      where, up_words(o),
      std::string(o.up == 4 ? "give --source-up z" : "restage doctor --fix OUT turns it") +
          ", or --force if it is so");
}

void check_target(const Mesh& target, const std::string& where) {
  if (target.vertices.size() < kEnoughPoints) return;
  const PersonShape shape = shape_of(target);
  const UnitGuess guess = guess_unit(shape.size);
  if (std::abs(guess.deviation) > kNoPerson) return;
  const std::string fix = "restage doctor --fix OUT mends it, --force takes it as it is";
  check_unit(guess, where, fix);
  OrientationVote vote;
  vote.add(shape.points);
  const Orientation o = vote.result();
  if (o.up_sure < kVerySure) return;
  if (o.up != 2) throw InputError(where, up_words(o), fix);
  if (o.facing != 4 && o.facing_sure >= kSure)
    throw InputError(where,
                     std::string("it seems to face ") + kDirections[static_cast<size_t>(o.facing)] +
                         " (sure " + per_cent(o.facing_sure) + "), a target faces +z",
                     fix);
}

}  // namespace restage
