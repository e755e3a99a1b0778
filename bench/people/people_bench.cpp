// How often PeopleTracker takes one person for another, and what mix-ups do to the joints.
//   people_bench FILE [clips=50] [weights=FILE] [cameras=N] [apart=METRES]
//     test people of FILE who walk past each other before one depth camera and within six, 0.9 m,
//     0.6 m and 0.35 m apart, as Markdown. With weights: also the joints' errors beside those of
//     the same person alone.
//   people_bench FILE write=CLOUDS.h5 [cameras=6] [apart=0.6] [clip=0]
//     the clouds of one such passing
#include <chrono>
#include <cstdio>
#include <iostream>
#include <optional>
#include <string>

#include "autograd/base/error.h"
#include "datasets/corpus.h"
#include "datasets/doctor/people.h"
#include "datasets/sampling/scanner.h"
#include "datasets/schema.h"
#include "nn/metrics/metrics.h"
#include "nn/models/extraction.h"
#include "nn/weights/bundle.h"

namespace restage::bench {
namespace {

constexpr int kFrames = 120;
constexpr float kPath = 3.0f;   // metres
constexpr float kApart = 0.3f;  // metres between two surfaces: nearer ones count as touching
constexpr size_t kSeen = 128;   // points: fewer are somebody who is hidden

/// Two people who walk past each other, and the cameras before them.
struct Passing {
  const Body* bodies[2];
  const Motion* motions[2];
  float apart;
  std::vector<DepthCamera> cameras;
  RngKey key;

  /// Their motions in place, carried past each other.
  Pose pose(size_t person, int frame) const {
    const float t = static_cast<float>(frame) / (kFrames - 1);
    const Motion& motion = *motions[person];
    const size_t last = motion.frames() - 1, turns = static_cast<size_t>(frame) % (2 * last);
    Pose out = pose_on(motion, *bodies[person], std::min(turns, 2 * last - turns));  // to and fro
    out.root.x() = kPath * (person == 0 ? t - 0.5f : 0.5f - t);
    out.root.z() = person == 0 ? 0 : apart;
    return out;
  }
  std::array<Mesh, 2> people(int frame) const {
    std::array<Mesh, 2> out;
    for (size_t p = 0; p < 2; ++p)
      out[p] = {pose_surface(*bodies[p], pose(p, frame)), bodies[p]->rest.faces};
    return out;
  }
  Points scan(const Mesh& mesh, int frame) const {
    return scan_surface(mesh, cameras, {}, key.fold("scan").fold(static_cast<uint64_t>(frame)));
  }
};

Mesh both(const std::array<Mesh, 2>& people) {
  Mesh out = people[0];
  const auto first = static_cast<int32_t>(out.vertices.size());
  out.vertices.insert(out.vertices.end(), people[1].vertices.begin(), people[1].vertices.end());
  for (Triangle t : people[1].faces) {
    for (int32_t& v : t) v += first;
    out.faces.push_back(t);
  }
  return out;
}

float distance_to(const Point& p, const Points& some) {
  float least = 1e9f;
  for (size_t i = 0; i < some.size(); i += 3) least = std::min(least, (some[i] - p).squaredNorm());
  return std::sqrt(least);
}

float gap(const std::array<Mesh, 2>& people) {
  float least = 1e9f;
  for (size_t i = 0; i < people[0].vertices.size(); i += 7)
    least = std::min(least, distance_to(people[0].vertices[i], people[1].vertices));
  return least;
}

/// PA errors of one person's joints, metres: with nobody else in sight, from the points that are
/// the person's in truth, and from those that the tracker gives to the person.
struct Errors {
  double alone = 0, owned = 0, found = 0, frames = 0;
};

struct Result {
  int exchanged = 0;               ///< clips at whose end somebody has the other's points, or none
  int lost = 0, clips = 0;         ///< clips
  double strange = 0, points = 0;  ///< points of the other person, while touching
  double milliseconds = 0, frames = 0, hidden = 0;
  Errors apart, touching;
};

/// The joints of a person of whom a cloud comes in every frame.
class Seen {
 public:
  explicit Seen(SkeletonModel& model)
      : extract_(model, {.samples = 4, .keep_limbs = true, .any_size = true, .any_way_up = true}) {}

  /// PA-MPJPE, metres.
  double operator()(const Points& cloud, const Joints& truth, const RngKey& key) {
    before_ = extract_(cloud, "person", key, before_ ? &*before_ : nullptr);
    const auto track = [](const Joints& joints) {
      return metrics::Track{joints[0].data(), 1, kJoints};
    };
    return *metrics::mean_distance(track(before_->joints), track(truth),
                                   {metrics::Alignment::Mode::frame, true});
  }
  void lose() { before_.reset(); }

 private:
  JointExtractor extract_;
  std::optional<SeenJoints> before_;
};

class Follower {
 public:
  Follower(Passing passing, SkeletonModel* model, Result& out) : passing_(passing), out_(out) {
    for (size_t person = 0; person < 2 && model != nullptr; ++person)
      for (auto* seen : {&alone_[person], &owned_[person], &found_[person]}) seen->emplace(*model);
  }

  void run() {
    for (int f = 0; f < kFrames; ++f) frame(f);
    out_.exchanged += exchanged_, out_.lost += lost_, ++out_.clips;
  }

 private:
  void frame(int f) {
    const std::array<Mesh, 2> people = passing_.people(f);
    const Points cloud = passing_.scan(both(people), f);
    const auto start = std::chrono::steady_clock::now();
    const std::vector<Points> found = tracker_.follow(cloud);
    out_.milliseconds +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    out_.frames += 1;
    lost_ = lost_ || found.size() > 2;
    const bool touching = gap(people) < kApart;
    for (size_t p = 0; p < std::min<size_t>(2, found.size()); ++p)
      count(cloud, found[p], people[p].vertices, people[1 - p].vertices, f, touching);
    if (!alone_[0]) return;
    Errors& errors = touching ? out_.touching : out_.apart;
    std::array<Points, 2> owned;
    for (const Point& p : cloud)
      owned[distance_to(p, people[0].vertices) <= distance_to(p, people[1].vertices) ? 0 : 1]
          .push_back(p);
    for (size_t p = 0; p < 2; ++p)
      compare(p, people[p], owned[p], p < found.size() ? found[p] : Points{}, f, errors);
  }

  /// Every fourth point that is mine in truth.
  static double owned(const Points& cloud, const Points& me, const Points& other) {
    double out = 0;
    for (size_t i = 0; i < cloud.size(); i += 4)
      out += distance_to(cloud[i], me) <= distance_to(cloud[i], other) ? 1 : 0;
    return out;
  }

  void count(const Points& cloud, const Points& mine, const Points& me, const Points& other, int f,
             bool touching) {
    double wrong = 0, all = 0;
    for (size_t i = 0; i < mine.size(); i += 4, ++all)
      wrong += distance_to(mine[i], me) <= distance_to(mine[i], other) ? 0 : 1;
    if (touching) out_.strange += wrong, out_.points += all;
    if (f > 100 && all > 20 && wrong > 0.5 * all) exchanged_ = true;
    if (f == kFrames - 1 && all - wrong < 0.5 * owned(cloud, me, other)) exchanged_ = true;
  }

  void compare(size_t person, const Mesh& me, const Points& owned, const Points& found, int f,
               Errors& errors) {
    const RngKey key = passing_.key.fold("look").fold(static_cast<uint64_t>(f));
    const Joints truth =
        forward_kinematics(passing_.bodies[person]->joints, passing_.pose(person, f)).joints;
    const double alone = (*alone_[person])(passing_.scan(me, f), truth, key);
    if (owned.size() < kSeen || found.size() < kSeen) {
      out_.hidden += 1;
      owned_[person]->lose(), found_[person]->lose();
      return;
    }
    errors.alone += alone;
    errors.owned += (*owned_[person])(owned, truth, key);
    errors.found += (*found_[person])(found, truth, key);
    errors.frames += 1;
  }

  const Passing passing_;
  Result& out_;
  PeopleTracker tracker_;
  std::array<std::optional<Seen>, 2> alone_, owned_, found_;
  bool exchanged_ = false, lost_ = false;
};

Passing passing(const Corpus& corpus, int clip, float apart, int cameras) {
  const Rng rng(RngKey{11, 0}.fold("people").fold(static_cast<uint64_t>(clip)));
  Rng draw = rng;
  Passing out{{}, {}, apart, {}, rng.key()};
  for (const Body*& body : out.bodies) body = &corpus.bodies[draw.below(corpus.bodies.size())];
  for (const Motion*& motion : out.motions)
    motion = &corpus.motions[draw.below(corpus.motions.size())];
  out.cameras = camera_ring(cameras, 4.2, cameras == 1 ? 0 : 0.3, Vec3(0, 0.9, 0), {1.0, 1.6});
  return out;
}

std::string errors(const Errors& e) {
  if (e.frames == 0) return "-";
  char text[64];
  std::snprintf(text, sizeof text, "%.1f; %.1f; %.1f", 1000 * e.alone / e.frames,
                1000 * e.owned / e.frames, 1000 * e.found / e.frames);
  return text;
}

struct Asked {
  std::string file, weights, write;
  int clips = 50, clip = 0;
  std::vector<int> cameras{1, 6};
  std::vector<float> apart{0.9f, 0.6f, 0.35f};
};

void write(const Passing& passing, const std::string& path) {
  FileInfo info;
  info.provenance = "two people who pass each other, by people_bench";
  ScanWriter writer(path, info);
  for (int f = 0; f < kFrames; ++f) writer.append(passing.scan(both(passing.people(f)), f));
  writer.commit();
}

int run(const Asked& asked) {
  CorpusSource source;
  source.source = asked.file;
  const Corpus corpus = load_corpus(source, "test");
  if (!asked.write.empty()) {
    const float apart = asked.apart.size() == 1 ? asked.apart[0] : 0.6f;
    write(passing(corpus, asked.clip, apart, asked.cameras.back()), asked.write);
    return 0;
  }
  std::optional<Bundle> bundle;
  if (!asked.weights.empty()) bundle = load_bundle(asked.weights);
  SkeletonModel* model =
      bundle ? &bundle->need_as<SkeletonModel>("skeleton", weights_path(asked.weights)) : nullptr;
  std::printf(
      "| cameras | apart | exchanged | a third person | touching: points of the other | hidden | "
      "apart: "
      "PA-MPJPE "
      "alone; own points; found | touching | ms a frame |\n"
      "|---|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  for (const int cameras : asked.cameras)
    for (const float apart : asked.apart) {
      Result r;
      for (int clip = 0; clip < asked.clips; ++clip)
        Follower(passing(corpus, clip, apart, cameras), model, r).run();
      std::printf("| %d | %.2f m | %d of %d | %d | %.1f %% | %.1f %% | %s | %s | %.1f |\n", cameras,
                  double{apart}, r.exchanged, r.clips, r.lost,
                  100 * r.strange / std::max(1.0, r.points), 50 * r.hidden / r.frames,
                  errors(r.apart).c_str(), errors(r.touching).c_str(), r.milliseconds / r.frames);
      std::fflush(stdout);
    }
  return 0;
}

}  // namespace
}  // namespace restage::bench

int main(int argc, char** argv) {
  try {
    restage::bench::Asked asked;
    bool right = argc >= 2;
    if (right) asked.file = argv[1];
    for (int i = 2; i < argc; ++i) {
      const std::string word = argv[i], value = word.substr(word.find('=') + 1);
      if (word.rfind("clips=", 0) == 0)
        asked.clips = std::stoi(value);
      else if (word.rfind("weights=", 0) == 0)
        asked.weights = value;
      else if (word.rfind("write=", 0) == 0)
        asked.write = value;
      else if (word.rfind("clip=", 0) == 0)
        asked.clip = std::stoi(value);
      else if (word.rfind("cameras=", 0) == 0)
        asked.cameras = {std::stoi(value)};
      else if (word.rfind("apart=", 0) == 0)
        asked.apart = {std::stof(value)};
      else
        right = false;
    }
    if (right) return restage::bench::run(asked);
  } catch (const restage::Error& error) {
    std::cerr << error.what() << "\n";
    return error.exit_code;
  }
  std::cerr << "people_bench FILE [clips=N] [weights=FILE] [cameras=N] [apart=METRES]\n"
               "people_bench FILE write=CLOUDS.h5 [cameras=N] [apart=METRES] [clip=N]\n";
  return 2;
}
