// Samples of the skeleton extractor: a point cloud of a posed body and its joints (spec 2.1, 6.1).
#pragma once

#include "autograd/tensor/tensor.h"
#include "datasets/corpus.h"
#include "datasets/sampling/augment.h"
#include "datasets/sampling/frames.h"
#include "datasets/sampling/sensors.h"
#include "datasets/sampling/surface.h"

namespace restage {

struct CloudConfig {
  int points = 1024;
  double noise = 0.005;       ///< standard deviation per coordinate, metres
  bool heading = true;        ///< turn by any angle about y
  bool mirror = true;         ///< every second sample is a mirror image
  double tpose_share = 0.05;  ///< part of the samples that are rest poses: every target is one
  double tpose_heading = 30;  ///< rest poses turn by up to this, degrees: targets face +z
  double scale_jitter = 0;    ///< bodies are scaled by 1 +- this
  double min_fraction = 1.0;  ///< below 1: as few as this part of the points are distinct, others
                              ///< repeat them, as in a scan with too few points
  int frame_step = 1;         ///< only every so many frames of a motion; 30: one per second
  double recombined = 0;      ///< part in which a limb or the upper body performs another frame
  double bend = 0;            ///< every joint but the pelvis turned by about this, degrees
  double dressed = 0;         ///< part of the clouds whose person wears clothes and hair (dress.h)
  double one_camera = 0;      ///< part that one depth camera sees (sensors.h)
  double camera_ring = 0;     ///< part that three to seven cameras around see
  double intruder = 0;        ///< part of what cameras see with somebody else's limb beside it
  double things = 0;          ///< part with a thing in the hand or beside the foot (things.h)
  double cut_floor = 0;       ///< part whose lowest 1 to 8 cm were cut away with the floor
  double smoothed = 0;        ///< part whose surface a coarse volume has smoothed
  double skirts = 0;          ///< part with a skirt, or the lower part of a coat (skirt.h)
  double ceiling = 0;  ///< part of what cameras see that they see from above, 40 to 90 degrees
  double cropped = 0;  ///< part of which a desk or the picture's edge hides something (partial.h)
  double sparse = 0;   ///< part with as few as 64 different points (partial.h)
  double noisy = 0;    ///< part with more noise, up to most_noise
  double most_noise = 0.045;  ///< metres
  double tilted = 0;          ///< part that is turned about an axis along the floor (draw_tilt())
  double upright = 0;         ///< part turned until the trunk is upright, as retarget shows people
  double remembered = 0;      ///< part with a memory of the frame before (CloudBatch::past)
  bool skin_weights = false;  ///< also fill CloudBatch::weights
  bool rotations = false;     ///< also fill CloudBatch::turns
};

/// float32, metres. Points and joints are relative to the centroid of the points.
struct CloudBatch {
  Tensor points;   ///< [N, V, 3]
  Tensor joints;   ///< [N, 22, 3]
  Tensor weights;  ///< [N, V, 22] which joints move each point; only with CloudConfig::skin_weights
  Tensor turns;  ///< [N, 22, 6] rotation of each joint from the T-pose, two columns of its matrix;
                 ///< only with CloudConfig::rotations
  Tensor past;   ///< [N, 22, 4] as SkeletonInput has it; only with CloudConfig::remembered
  Tensor centres;              ///< [N, 3] the centroids, in the world
  std::vector<int64_t> asked;  ///< rows whose memory is to be the answer to CloudSampler::before()

  /// named_tensors() and moved() of it.
  template <class F>
  void each(F&& f) {
    f("points", points);
    f("joints", joints);
    f("weights", weights);
    f("turns", turns);
    f("past", past);
    f("centres", centres);
  }
};

/// What a cloud shows; `rest` means the T-pose, whatever `at` says.
struct CloudSubject {
  size_t body = 0;
  bool rest = false;
  FrameRef at;
  int limb = -1;  ///< what hangs on this joint is posed as in `limb_at`; -1: nothing
  FrameRef limb_at;
  double bend = 0;    ///< radians, as CloudConfig::bend
  RngKey bend_key{};  ///< of the directions
  Augmentation augmentation;
  double scale = 1;
  Sensor sensor = Sensor::none;
  bool dressed = false;
  bool intruder = false;
  bool thing = false, cut_floor = false, skirt = false;
  double smoothed = 0;  ///< 0 to 1, of smoothing()
  bool ceiling = false, cropped = false, sparse = false;
  double noise = 0;               ///< metres; 0: CloudConfig::noise
  Mat3 shown = Mat3::Identity();  ///< turns all that the sensors saw
  enum class Memory { none, drawn, asked } memory = Memory::none;
  size_t step_back = 1;  ///< how many frames ago the remembered one is
};

class CloudSampler {
 public:
  /// Keeps a reference to `corpus`. InputError for settings out of range or bodies without surface.
  CloudSampler(const Corpus& corpus, const CloudConfig& config, uint64_t seed);

  /// Samples number first ... first + n - 1. Sample i is a function of (corpus, config, seed, i).
  CloudBatch batch(int64_t first, int64_t n) const;
  /// What sample i shows: a random body in a random frame of all motions, or at rest.
  CloudSubject subject(int64_t index) const;
  /// The clouds of given subjects, the i-th with the noise and points of sample i.
  CloudBatch clouds(const std::vector<CloudSubject>& subjects) const;
  /// The same people in the same clothes before the same cameras, a frame before: of those rows of
  /// batch(first, n) whose memory is asked for.
  CloudBatch before(int64_t first, const CloudBatch& batch) const;
  Pose pose(const CloudSubject& subject) const;
  /// At most `n` points in the world. Clothes and cameras are functions of `scene`, which the
  /// frames of a sequence share, all else of `key`.
  Points cloud(const CloudSubject& subject, size_t n, const RngKey& scene, const RngKey& key) const;

 private:
  /// Points of a surface, and their normals where clothes or sensors need them, turned, mirrored
  /// and scaled together with the joints.
  struct Drawn {
    Points points, normals;
    Joints joints;
    Rotations turns;
  };
  Drawn draw(const CloudSubject& subject, const SurfaceSamples& samples, const RngKey& key) const;
  void add_skirt(const CloudSubject& subject, const SurfaceSamples& samples, const RngKey& key,
                 Drawn* drawn) const;
  /// What a sensor sees of it; which of the samples each point is, kNobody of somebody else.
  struct Seen {
    SurfaceSamples samples;
    std::vector<size_t> which;
    Points points;
    Joints joints;
    Rotations turns;
  };
  Seen see(const CloudSubject& subject, size_t n, const RngKey& scene, const RngKey& key) const;
  static void turn(const Mat3& by, Seen* seen);
  void intrude(const RngKey& scene, const RngKey& key, Seen* seen) const;
  void put_thing(const RngKey& scene, const RngKey& key, bool cameras, Seen* seen) const;
  /// One row of a batch.
  struct Row {
    CloudSubject subject;
    RngKey scene, key;
  };
  void fill(const Row& row, int64_t i, CloudBatch& to) const;
  void fill_past(const Row& row, const Point& centre, float* to) const;
  CloudBatch make(const std::vector<Row>& rows) const;
  Joints true_joints(const CloudSubject& subject) const;
  /// What the shares from `ceiling` to `upright` say of sample `index`.
  void make_harder(int64_t index, CloudSubject* subject) const;

  const Corpus& corpus_;
  CloudConfig config_;
  RngKey key_;
  FrameIndex frames_;
  OwnBodies own_;
  std::vector<SurfaceSampler> surfaces_;
  std::vector<Points> smoothings_;  ///< of each body; empty where nothing is smoothed
};

}  // namespace restage
