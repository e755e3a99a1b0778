#include "datasets/doctor/people.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "datasets/doctor/parts.h"

namespace restage {
namespace {

constexpr float kPlace = 0.06f;  // metres: edge of the cubes that a cloud is thinned by
constexpr float kTouch = 0.16f;  // of what hangs together
constexpr float kNear = 0.5f;    // a loose piece belongs to somebody so near
constexpr float kTall = 0.5f;    // the least extent of a person
constexpr float kFast = 0.12f;   // metres a frame: nobody is faster
constexpr double kCrowd = 0.15;  // share of the largest piece that another person has
constexpr float kFollows = 0.2f, kPartFollows = 0.15f;  // how fast a velocity follows what is seen
constexpr size_t kMostPeople = 32, kMostPlaces = 6000;

float extent(const Points& points) {
  Point low = points[0], high = points[0];
  for (const Point& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  return (high - low).maxCoeff();
}

Point middle_of(const Points& points) {
  Point sum = Point::Zero();
  for (const Point& p : points) sum += p;
  return sum / static_cast<float>(std::max<size_t>(1, points.size()));
}

float distance(const Point& from, const Points& to, const Point& moved) {
  float least = std::numeric_limits<float>::infinity();
  for (const Point& p : to) least = std::min(least, (from - p - moved).squaredNorm());
  return std::sqrt(least);
}

}  // namespace

/// A thinned cloud, in pieces that hang together.
struct PeopleTracker::Places {
  Points at;
  std::vector<size_t> of_point;             ///< the place of each point of the cloud
  std::vector<std::vector<size_t>> pieces;  ///< places of each

  explicit Places(const Points& cloud) {
    std::map<std::array<int, 3>, size_t> cubes;
    std::vector<float> count;
    for (const Point& p : cloud) {
      std::array<int, 3> cube;
      for (size_t axis = 0; axis < 3; ++axis)
        cube[axis] = static_cast<int>(
            std::floor(std::clamp(p[static_cast<int>(axis)] / kPlace, -1e6f, 1e6f)));
      const auto [where, fresh] = cubes.emplace(cube, at.size());
      if (fresh) at.push_back(Point::Zero()), count.push_back(0);
      at[where->second] += p;
      count[where->second] += 1;
      of_point.push_back(where->second);
    }
    for (size_t i = 0; i < at.size(); ++i) at[i] /= count[i];
    Pieces whole(at.size());
    if (at.size() <= kMostPlaces)
      for (size_t i = 0; i < at.size(); ++i)
        for (size_t j = 0; j < i; ++j)
          if ((at[i] - at[j]).squaredNorm() < kTouch * kTouch) whole.join(i, j);
    std::map<size_t, std::vector<size_t>> by_piece;
    for (size_t i = 0; i < at.size(); ++i) by_piece[whole.of(i)].push_back(i);
    for (auto& [piece, places] : by_piece) pieces.push_back(std::move(places));
    std::stable_sort(pieces.begin(), pieces.end(),
                     [](const auto& a, const auto& b) { return a.size() > b.size(); });
  }
  Points of(const std::vector<size_t>& places) const {
    Points out;
    for (const size_t i : places) out.push_back(at[i]);
    return out;
  }
};

void PeopleTracker::Person::begin(Points seen) {
  body = std::move(seen);
  usual = static_cast<double>(body.size());
  middle = middle_of(body);
  alone = body;
  for (Point& x : alone) x -= middle;
}

void PeopleTracker::begin(const Places& places, std::vector<int>& owner) {
  std::vector<std::pair<float, Points>> found;  // x of the middle
  for (const std::vector<size_t>& piece : places.pieces) {
    const auto least = kCrowd * static_cast<double>(places.pieces[0].size());
    Points body = places.of(piece);
    if (static_cast<double>(piece.size()) < least || extent(body) < kTall ||
        found.size() == kMostPeople)
      continue;
    found.emplace_back(middle_of(body).x(), std::move(body));
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (auto& [x, body] : found) {
    people_.emplace_back();
    people_.back().begin(std::move(body));
  }
  assign(places, owner);
}

void PeopleTracker::assign(const Places& places, std::vector<int>& owner) {
  const size_t n = people_.size();
  std::vector<std::vector<float>> apart(places.at.size(), std::vector<float>(n));
  for (size_t i = 0; i < places.at.size(); ++i)
    for (size_t p = 0; p < n; ++p)
      apart[i][p] = distance(places.at[i], people_[p].body, people_[p].velocity);
  const auto nearest = [&](size_t i) {
    return static_cast<size_t>(std::min_element(apart[i].begin(), apart[i].end()) -
                               apart[i].begin());
  };
  for (const std::vector<size_t>& piece : places.pieces) {
    constexpr float kHere = 0.25f;  // metres between two frames
    constexpr double kShare = 0.15;
    const std::vector<size_t> reaches = reached(places, piece);
    std::vector<size_t> claims(n);
    float least = std::numeric_limits<float>::infinity();
    size_t by = 0;
    for (const size_t i : piece) {
      if (n == 0) break;
      const size_t p = nearest(i);
      if (apart[i][p] < kHere) ++claims[p];
      if (apart[i][p] < least) least = apart[i][p], by = p;
    }
    std::vector<size_t> claimants;
    for (size_t p = 0; p < n; ++p)
      if (static_cast<double>(claims[p]) > kShare * static_cast<double>(piece.size()) ||
          static_cast<double>(claims[p]) > 0.3 * people_[p].usual ||
          static_cast<double>(reaches[p]) > kShare * people_[p].usual)
        claimants.push_back(p);
    const bool large =
        static_cast<double>(piece.size()) > kCrowd * static_cast<double>(places.pieces[0].size()) &&
        extent(places.of(piece)) > 2 * kTall;
    if (claimants.empty() &&
        least < kNear + 0.03f * static_cast<float>(people_.empty() ? 0 : people_[by].unseen))
      claimants.push_back(by);
    if (claimants.empty() && large && people_.size() < kMostPeople) {
      for (const size_t i : piece) owner[i] = static_cast<int>(people_.size());
      people_.emplace_back();
      people_.back().begin(places.of(piece));
      continue;
    }
    for (const size_t p : claimants)
      if (claimants.size() > 1) touched_[p] = true;
    if (claimants.size() == 1)
      for (const size_t i : piece) owner[i] = static_cast<int>(claimants[0]);
    else if (!claimants.empty())
      share_out(places, piece, claimants, apart, owner);
  }
}

/// Who is hidden by whom it touches loses points to the other, and would never claim them again: to
/// which places the shape reaches that each mixed-up person had alone.
std::vector<size_t> PeopleTracker::reached(const Places& places,
                                           const std::vector<size_t>& piece) const {
  constexpr float kFits = 0.1f;  // metres
  std::vector<size_t> out(people_.size());
  for (size_t p = 0; p < people_.size(); ++p) {
    const Person& one = people_[p];
    if (!one.mixed) continue;
    for (const size_t i : piece)
      out[p] += distance(places.at[i], one.alone, one.middle + one.velocity) < kFits;
  }
  return out;
}

/// Where people touch, what is taken for another once would stay so: the shape that a person had
/// alone counts as well as where the person's points were a moment ago. Neighbours decide together,
/// since limbs are not given away in spots.
void PeopleTracker::share_out(const Places& places, const std::vector<size_t>& piece,
                              const std::vector<size_t>& claimants,
                              const std::vector<std::vector<float>>& apart,
                              std::vector<int>& owner) const {
  constexpr float kOfShape = 0.7f;                       // of the cost of the person's points
  constexpr float kReaches = 0.2f, kNeighbours = 0.15f;  // metres
  const size_t n = claimants.size();
  std::vector<float> costs(piece.size() * n), means(costs.size());
  for (size_t k = 0; k < piece.size(); ++k)
    for (size_t c = 0; c < n; ++c) {
      const Person& one = people_[claimants[c]];
      const float off = distance(places.at[piece[k]], one.alone, one.middle + one.velocity);
      costs[k * n + c] =
          std::min(kReaches, apart[piece[k]][claimants[c]]) + kOfShape * std::min(kReaches, off);
    }
  for (int again = 0; again < 2; ++again) {
    for (size_t k = 0; k < piece.size(); ++k) {
      float count = 0;
      std::fill_n(means.begin() + static_cast<std::ptrdiff_t>(k * n), n, 0.0f);
      for (size_t l = 0; l < piece.size(); ++l) {
        if ((places.at[piece[k]] - places.at[piece[l]]).squaredNorm() > kNeighbours * kNeighbours)
          continue;
        count += 1;
        for (size_t c = 0; c < n; ++c) means[k * n + c] += costs[l * n + c];
      }
      for (size_t c = 0; c < n; ++c) means[k * n + c] /= count;
    }
    costs.swap(means);
  }
  for (size_t k = 0; k < piece.size(); ++k) {
    const auto first = costs.begin() + static_cast<std::ptrdiff_t>(k * n);
    const auto least = std::min_element(first, first + static_cast<std::ptrdiff_t>(n));
    owner[piece[k]] = static_cast<int>(claimants[static_cast<size_t>(least - first)]);
  }
}

/// Moves the person's middle until the shape that the person had alone lies on what is seen.
void PeopleTracker::Person::lay_on(const Points& seen) {
  constexpr float kWithin = 0.2f;  // metres
  for (int again = 0; again < 2; ++again) {
    Points steps;
    for (const Point& x : seen) {
      Point step = Point::Constant(kWithin);
      for (const Point& a : alone)
        if (const Point to = x - a - middle; to.squaredNorm() < step.squaredNorm()) step = to;
      if (step.norm() < kWithin) steps.push_back(step);
    }
    if (steps.size() > 10) middle += 0.9f * middle_of(steps);
  }
}

/// Nothing is seen: on as before, and slower from frame to frame.
void PeopleTracker::Person::go_on() {
  constexpr float kSlows = 0.97f;
  for (Point& x : body) x += velocity;
  middle += velocity;
  velocity *= kSlows;
  ++unseen;
}

/// A part that comes into sight or goes out of it moves the middle of what is seen, and nobody:
/// only who is seen whole moves with it.
void PeopleTracker::Person::see(Points seen, bool touches) {
  constexpr double kPart = 0.15, kMost = 0.6, kWhole = 0.85, kTwo = 1.4;  // of what is usual
  const double share = static_cast<double>(seen.size()) / std::max(1.0, usual);
  const bool sure = share > kMost && share < kTwo && !touches && unseen == 0;
  const auto move = [this](const Point& step, float follows) {
    const float most = std::min(1.0f, kFast / std::max(1e-6f, step.norm()));
    velocity = (1 - follows) * velocity + follows * most * step;
  };
  mixed = !sure && (mixed || touches);
  if (sure && share > kWhole) {
    const Point now = middle_of(seen);
    move(now - middle, kFollows);
    middle = now;
  } else {
    const Point before = middle;
    middle += velocity;
    if (share > kPart) lay_on(seen);
    move(middle - before, kPartFollows);
  }
  if (sure && share > kWhole) {
    alone = seen;
    for (Point& x : alone) x -= middle;
  }
  if (!touches && share > kMost)
    usual += (sure ? 0.1 : 0.02) * (static_cast<double>(seen.size()) - usual);
  if (share < kMost)  // what is hidden is where the rest of the person is
    for (const Point& x : alone) seen.push_back(x + middle);
  body = std::move(seen);
  unseen = 0;
}

void PeopleTracker::update(const Places& places, const std::vector<int>& owner,
                           const std::vector<bool>& touched) {
  std::vector<Points> bodies(people_.size());
  for (size_t i = 0; i < places.at.size(); ++i)
    if (owner[i] >= 0) bodies[static_cast<size_t>(owner[i])].push_back(places.at[i]);
  for (size_t p = 0; p < people_.size(); ++p) {
    Person& one = people_[p];
    if (bodies[p].empty())
      one.go_on();
    else
      one.see(std::move(bodies[p]), touched[p]);
  }
}

std::vector<Points> PeopleTracker::follow(const Points& cloud) {
  const Places places(cloud);
  std::vector<int> owner(places.at.size(), -1);
  touched_.assign(kMostPeople + 1, false);
  if (people_.empty())
    begin(places, owner);
  else
    assign(places, owner);
  std::vector<Points> out(people_.size());
  for (size_t i = 0; i < cloud.size(); ++i)
    if (const int p = owner[places.of_point[i]]; p >= 0)
      out[static_cast<size_t>(p)].push_back(cloud[i]);
  update(places, owner, touched_);
  return out;
}

}  // namespace restage
