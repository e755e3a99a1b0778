// Several people in one sequence of clouds: who is who, from frame to frame.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// Follows everybody in a sequence of clouds (metres, any axis up). In the first frame people are
/// pieces apart from each other, numbered as they stand from -x to +x; who comes later gets the
/// next number. A piece belongs to whoever was there a moment ago and moved on as before; where two
/// people touch, each point goes to the nearer of the two, by where their points were and by the
/// shape that each had alone, as most points around it do. Who is hidden goes on as before until
/// seen again.
class PeopleTracker {
 public:
  /// The points of each person; empty: not seen in this cloud. Points of nobody are left out.
  std::vector<Points> follow(const Points& cloud);
  size_t people() const { return people_.size(); }
  void restart() { people_.clear(); }

 private:
  struct Person {
    Points body;   ///< places where it was seen last, thinned
    Points alone;  ///< the same when it last touched nobody and was seen whole, about its middle
    Point middle = Point::Zero();    ///< which is here by now
    Point velocity = Point::Zero();  ///< metres a frame
    int unseen = 0;                  ///< frames
    double usual = 0;                ///< places that it is seen at
    bool mixed = false;              ///< touched somebody, and was not seen whole and alone since
    void begin(Points seen);
    void go_on();
    void see(Points seen, bool touches);
    void lay_on(const Points& seen);
  };
  struct Places;
  void begin(const Places& places, std::vector<int>& owner);
  void assign(const Places& places, std::vector<int>& owner);
  std::vector<size_t> reached(const Places& places, const std::vector<size_t>& piece) const;
  void share_out(const Places& places, const std::vector<size_t>& piece,
                 const std::vector<size_t>& claimants, const std::vector<std::vector<float>>& apart,
                 std::vector<int>& owner) const;
  void update(const Places& places, const std::vector<int>& owner,
              const std::vector<bool>& touched);
  std::vector<bool> touched_;

  std::vector<Person> people_;
};

}  // namespace restage
