// Which way a person in a cloud is up, and which way they face, whatever they are doing.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// The six directions along axes in the order +x -x +y -y +z -z.
inline constexpr std::array<const char*, 6> kDirections = {"+x", "-x", "+y", "-y", "+z", "-z"};
Vec3 direction(int index);

struct Orientation {
  int up = 2;              ///< index of kDirections
  double up_sure = 0;      ///< probability; 1/6 says nothing
  int facing = 4;          ///< the axis nearest to where the person faces, at right angles to `up`
  double facing_sure = 0;  ///< probability of that axis if `up` is right
  double turned = 0;       ///< degrees from that axis, towards their left; about -45 to 45
  double turned_sure = 0;  ///< probability that the person faces within 45 degrees of that angle
  /// Whether the angle is sure enough to turn by it: never where the up axis is in question.
  bool is_turn_sure() const { return up_sure >= 0.9 && turned_sure >= 0.9; }
  /// The permutation of axes that brings `up` to +y and `facing` to +z.
  Mat3 turn() const;
  /// The turn that brings `up` to +y and the angle that is `turned` from `facing` to +z.
  Mat3 exact_turn() const;
};

/// Sums up clouds of one person in one frame of reference. Order of points is of no consequence
/// unless there are more than 4,096.
class OrientationVote {
 public:
  /// Metres or any unit. Clouds whose points all lie in one place say nothing. `faces`: whether
  /// the cloud also has a vote on where the person faces (who walks a circle faces everywhere).
  void add(const Points& cloud, bool faces = true);
  Orientation result() const;
  /// The same where `up` is known.
  Orientation result(int up) const;

 private:
  static constexpr int kHeadings = 24;
  std::array<std::array<double, kHeadings>, 6> facing_{};  // sums of probabilities
  std::array<double, 6> up_{};
  int clouds_ = 0;
};

/// Which direction is up in clouds from all of a take, metres, in which somebody may lie or fall:
/// of the directions along which somebody surely stands in a fifth of the clouds, that along which
/// the lowest point moves least, since the floor stays where it is. `given` is one of them only
/// over a floor: there the lowest point moves by less than 0.15 m, and by less than half as much as
/// along the direction of most clouds. Nothing if nobody stands so often along any. Who hangs from
/// a bar or stands on the hands all the time cannot be told from somebody upright in another frame.
std::optional<int> up_of_take(const std::vector<Points>& clouds, int given);

}  // namespace restage
