#include "experiments/evaluation.h"

#include "nn/geometry/closed_form.h"
#include "train/stages/skeleton_stage.h"

namespace restage {
namespace {

/// Points of all frames of one sequence as doubles.
struct Buffer {
  std::vector<double> values;
  int64_t frames = 0, points = 0;
  template <class Container>
  void push(const Container& frame) {
    for (const auto& p : frame)
      for (int c = 0; c < 3; ++c) values.push_back(static_cast<double>(p[c]));
    points = static_cast<int64_t>(frame.size());
    ++frames;
  }
  metrics::Track track() const {
    return frames == 0 ? metrics::Track{} : metrics::Track{values.data(), frames, points};
  }
};

struct Predicted {
  Buffer joints, vertices;
};

/// What all rows of the table are measured against and made from, for one sequence.
struct Sequence {
  Buffer joints, vertices;     // truth
  std::vector<Joints> source;  // A's joints as this condition knows them
  std::optional<Joints> source_rest;
};

void add(const Predicted& p, const Sequence& s, metrics::Evaluation* into) {
  const metrics::SequenceView view{p.joints.track(), s.joints.track(), p.vertices.track(),
                                   p.vertices.frames > 0 ? s.vertices.track() : metrics::Track{},
                                   s.joints.frames};
  into->sequences.push_back(metrics::evaluate({&view, 1}).sequences[0]);
}

/// The rows that need no learning. Their surfaces use the model's skinning, since they have none.
void add_references(const Sequence& s, const Retargeter& target, SystemScores* scores) {
  Predicted rest, unchanged, closed;
  const auto poses = closed_form(s.source, target.rest(), s.source_rest);
  const auto carried = rest_pose_joints(s.source, target.rest());
  for (size_t f = 0; f < s.source.size(); ++f) {
    closed.joints.push(forward_kinematics(target.rest(), poses[f]).joints);
    rest.joints.push(carried[f]);
    unchanged.joints.push(s.source[f]);
    if (target.surface() == nullptr) continue;
    closed.vertices.push((*target.surface())(poses[f]));
    Points moved = target.target().vertices;
    for (Point& p : moved) p += (carried[f][0] - target.rest()[0]).cast<float>();
    rest.vertices.push(moved);
  }
  if (scores->references.empty())
    scores->references = {{"rest_pose", {}}, {"source_unchanged", {}}, {"closed_form", {}}};
  add(rest, s, &scores->references[0].second);
  add(unchanged, s, &scores->references[1].second);
  add(closed, s, &scores->references[2].second);
}

Sequence truth_of(const Performance& performance) {
  Sequence s;
  for (size_t i = 0; i < performance.frames(); ++i) {
    s.joints.push(performance.joints_b(i));
    s.vertices.push(performance.vertices_b(i));
  }
  return s;
}

void judge_retargeting(const Performance& performance, Retargeter& retargeter, bool clouds,
                       Sequence s, SystemScores* scores) {
  Predicted model;
  for (size_t i = 0; i < performance.frames(); ++i) {
    const auto frames = clouds ? retargeter.push(performance.cloud(i), "frame " + std::to_string(i))
                               : retargeter.push_joints(performance.joints_a(i));
    s.source.push_back(*retargeter.source_joints());
    for (const RetargetedFrame& f : frames) {
      model.joints.push(f.joints);
      if (retargeter.surface() != nullptr) model.vertices.push(f.vertices);
    }
  }
  if (!clouds) s.source_rest = performance.source().joints;
  add(model, s, &scores->model);
  scores->frames.push_back(s.joints.frames);
  add_references(s, retargeter, scores);
}

/// The surface alone; what stands still is the reference.
void judge_surface(const Performance& performance, const Surface& surface, const Sequence& s,
                   SystemScores* scores) {
  const Body& body = performance.target();
  Predicted model, rest;
  for (size_t i = 0; i < performance.frames(); ++i) {
    const Pose pose = performance.pose_b(i);
    model.vertices.push(surface(pose));
    Points moved = body.rest.vertices;
    for (Point& p : moved) p += (pose.root - body.joints[0]).cast<float>();
    rest.vertices.push(moved);
  }
  if (scores->references.empty()) scores->references = {{"rest_pose", {}}};
  add(model, s, &scores->model);
  add(rest, s, &scores->references[0].second);
  scores->frames.push_back(s.joints.frames);
}

/// What a condition needs, and what is not there of it.
struct Condition {
  const char* name;
  std::vector<std::string> roles;
};

std::string lacking(const Condition& condition, const Bundle& weights) {
  for (const std::string& role : condition.roles)
    if (weights.find(role) == nullptr)
      return std::string(condition.name) + ": no model for " + role;
  return "";
}

/// Extractor alone, on held-out clouds and T-poses.
void judge_extractor(const Bundle& weights, const Corpus& corpus, CloudConfig clouds,
                     SystemEvaluation* out) {
  auto* model = weights.find_as<SkeletonModel>("skeleton");
  if (model == nullptr) {
    out->missing.push_back("extractor: no model for skeleton");
    return;
  }
  clouds.points = static_cast<int>(model->points());
  clouds.mirror = false;
  clouds.scale_jitter = 0;
  const CloudSampler sampler(corpus, clouds, 2);
  out->joint_error = joint_error(*model, sampler.clouds(evaluation_clouds(corpus, 400, 2)));
  out->tpose_joint_error =
      joint_error(*model, sampler.clouds(evaluation_tposes(corpus, 8, clouds.tpose_heading, 2)));
}

}  // namespace

const SystemScores* SystemEvaluation::find(const std::string& condition) const {
  for (const auto& [name, scores] : conditions)
    if (name == condition) return &scores;
  return nullptr;
}

EvaluationOptions evaluation_options(const TrainConfig& config, const Corpus& test, uint64_t seed) {
  EvaluationOptions out;
  out.seed = seed;
  out.clouds = config.section("skeleton").config.as<SkeletonStageConfig>().clouds;
  out.sequences = evaluation_sequences(test, static_cast<size_t>(config.evaluation.sequences),
                                       static_cast<size_t>(config.evaluation.frames), seed);
  return out;
}

SystemEvaluation evaluate_system(const Bundle& weights, const std::string& weights_name,
                                 const Corpus& corpus, const EvaluationOptions& options) {
  SystemEvaluation out;
  for (const Condition& condition :
       {Condition{"clouds", {"skeleton", "motion"}}, Condition{"true_skeletons", {"motion"}},
        Condition{"true_poses", {"deformation.weights"}}}) {
    const std::string missing = lacking(condition, weights);
    if (!missing.empty())
      out.missing.push_back(missing);
    else
      out.conditions.emplace_back(condition.name, SystemScores{});
  }
  if (weights.find("motion") != nullptr && weights.find("deformation.weights") == nullptr)
    out.missing.push_back("surfaces: no model for deformation.weights");
  RetargetOptions retarget;
  retarget.seed = options.seed;
  retarget.force =
      true;  // a badly extracted target counts with its error instead of ending the table
  retarget.samples = 4;
  retarget.anchor = options.anchor;
  for (const EvalSequence& sequence : options.sequences) {
    const Performance performance(corpus, sequence, ScanConfig{}, options.seed);
    const Sequence truth = truth_of(performance);
    const Body& target = performance.target();
    for (auto& [name, scores] : out.conditions) {
      if (name == "true_poses") {
        judge_surface(performance, Surface(weights, weights_name, target.rest, target.joints),
                      truth, &scores);
      } else if (name == "clouds") {
        Retargeter retargeter(weights, weights_name, target.rest, target.id, retarget);
        judge_retargeting(performance, retargeter, true, truth, &scores);
      } else {
        Retargeter retargeter(weights, weights_name, target.rest, target.joints, retarget);
        judge_retargeting(performance, retargeter, false, truth, &scores);
      }
    }
  }
  for (auto& [name, scores] : out.conditions) {
    metrics::average(&scores.model);
    for (auto& reference : scores.references) metrics::average(&reference.second);
  }
  judge_extractor(weights, corpus, options.clouds, &out);
  return out;
}

}  // namespace restage
