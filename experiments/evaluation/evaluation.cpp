#include "experiments/evaluation/evaluation.h"

#include "autograd/base/interrupt.h"
#include "infer/transfer.h"
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
  std::vector<double> rotations;
  void turn(const Rotations& global) {
    for (const auto& q : quaternions(global)) rotations.insert(rotations.end(), q.begin(), q.end());
  }
};

/// What all rows of the table are measured against and made from, for one sequence.
struct Sequence {
  Predicted truth;
  std::vector<Joints> source;  // A's joints as this condition knows them
  std::optional<Joints> source_rest;
};

/// What is not every frame has no acceleration.
void add(const Predicted& p, const Sequence& s, const EvaluationOptions& how,
         metrics::Evaluation* into) {
  const metrics::SequenceView view{
      p.joints.track(),      p.joints.frames > 0 ? s.truth.joints.track() : metrics::Track{},
      p.vertices.track(),    p.vertices.frames > 0 ? s.truth.vertices.track() : metrics::Track{},
      s.truth.joints.frames, p.rotations,
      s.truth.rotations};
  const auto metrics = metrics_of_every(how.every, how.metrics);
  into->sequences.push_back(metrics::evaluate({&view, 1}, metrics).sequences[0]);
}

/// The rows that need no learning. Their surfaces use the system's skinning, since they have none.
void add_references(const Sequence& s, const System& system, const EvaluationOptions& how,
                    SystemScores* scores) {
  const Joints& target = *system.target_joints();
  Predicted rest, unchanged, closed;
  const auto poses = closed_form(s.source, target, s.source_rest);
  const auto carried = rest_pose_joints(s.source, target);
  for (size_t f = 0; f < s.source.size(); ++f) {
    const PosedSkeleton posed = forward_kinematics(target, poses[f]);
    closed.joints.push(posed.joints);
    closed.turn(posed.global);
    rest.joints.push(carried[f]);
    unchanged.joints.push(s.source[f]);
    if (system.rig() == nullptr) continue;
    closed.vertices.push(system.posed(poses[f]));
    Points moved = system.target().vertices;
    for (Point& p : moved) p += (carried[f][0] - target[0]).cast<float>();
    rest.vertices.push(moved);
  }
  if (scores->references.empty())
    scores->references = {{"rest_pose", {}}, {"source_unchanged", {}}, {"closed_form", {}}};
  add(rest, s, how, &scores->references[0].second);
  add(unchanged, s, how, &scores->references[1].second);
  add(closed, s, how, &scores->references[2].second);
}

Sequence truth_of(const Performance& performance, int64_t every) {
  Sequence s;
  for (size_t i = 0; i < performance.frames(); i += static_cast<size_t>(every)) {
    s.truth.joints.push(performance.joints_b(i));
    s.truth.vertices.push(performance.vertices_b(i));
    s.truth.turn(performance.rotations_b(i));
  }
  return s;
}

/// `push(i, show)`: frame i of the source, by whatever way the system takes it.
template <class Push>
void judge_retargeting(const Performance& performance, System& system, const Push& push,
                       const EvaluationOptions& how, Sequence s, SystemScores* scores) {
  Predicted model;
  const System::Show keep = [&](const RetargetedFrame& f) {
    if (f.joints) {
      model.joints.push(*f.joints);
      model.turn(to_global(f.pose.local));
    }
    if (!f.vertices.empty()) model.vertices.push(f.vertices);
  };
  for (size_t i = 0; i < performance.frames(); i += static_cast<size_t>(how.every)) {
    push(i, keep);
    if (system.source_joints() != nullptr) s.source.push_back(*system.source_joints());
  }
  system.finish(keep);
  add(model, s, how, &scores->model);
  if (model.joints.frames > 0)
    scores->joint_errors.push_back(joint_errors(model.joints.track(), s.truth.joints.track()));
  scores->frames.push_back(s.truth.joints.frames);
  if (how.every == 1 && system.target_joints() != nullptr && !s.source.empty())
    add_references(s, system, how, scores);
}

/// The surface alone; what stands still is the reference.
void judge_surface(const Performance& performance, const Surface& surface,
                   const EvaluationOptions& how, const Sequence& s, SystemScores* scores) {
  const Body& body = performance.target();
  Predicted model, rest;
  for (size_t i = 0; i < performance.frames(); i += static_cast<size_t>(how.every)) {
    const Pose pose = performance.pose_b(i);
    model.vertices.push(surface(pose));
    Points moved = body.rest.vertices;
    for (Point& p : moved) p += (pose.root - body.joints[0]).cast<float>();
    rest.vertices.push(moved);
  }
  if (scores->references.empty()) scores->references = {{"rest_pose", {}}};
  add(model, s, how, &scores->model);
  add(rest, s, how, &scores->references[0].second);
  scores->frames.push_back(s.truth.joints.frames);
}

/// The extractor alone: of the source's clouds, or of the target's T-pose.
void judge_extraction(const Performance& performance, SkeletonModel& model, bool rest,
                      const EvaluationOptions& how, SystemScores* scores) {
  JointExtractor extract(model, {.samples = RetargetOptions{}.samples});
  const RngKey key = RngKey{how.seed, 0}.fold("skeleton");
  Predicted found;
  Sequence s;
  const auto judge = [&](const Points& cloud, const Joints& truth, const std::string& name) {
    found.joints.push(extract(cloud, name, key).joints);
    s.truth.joints.push(truth);
  };
  if (rest) {
    judge(performance.target().rest.vertices, performance.target().joints, "the T-pose");
  } else {
    for (size_t i = 0; i < performance.frames(); i += static_cast<size_t>(how.every))
      judge(performance.cloud(i), performance.joints_a(i), "frame " + std::to_string(i));
  }
  add(found, s, how, &scores->model);
  scores->joint_errors.push_back(joint_errors(found.joints.track(), s.truth.joints.track()));
  scores->frames.push_back(s.truth.joints.frames);
}

/// What a condition needs, and what is not there of it.
struct Condition {
  const char* name;
  std::vector<std::string> roles;
};

/// Known joints are for a system whose networks can be judged one by one; others see clouds and
/// nothing else. What is nothing but an extractor is judged as one.
std::vector<Condition> conditions_of(const SystemType& type, const Bundle& weights) {
  std::vector<Condition> out = {
      {needs_correspondence(weights) ? "true_vertices" : "clouds", type.roles}};
  if (!type.parts) return out;
  out.push_back({"true_skeletons", {"motion"}});
  out.push_back({"true_poses", {"deformation.weights"}});
  if (weights.find("skeleton") != nullptr && weights.find("motion") == nullptr &&
      weights.find("deformation.weights") == nullptr)
    for (const char* name : {"source_joints", "rest_joints"}) out.push_back({name, {"skeleton"}});
  return out;
}

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
  out->joint_error =
      skeleton_errors(*model, sampler.clouds(evaluation_clouds(corpus, 400, 2))).joints;
  out->tpose_joint_error =
      skeleton_errors(*model, sampler.clouds(evaluation_tposes(corpus, 8, clouds.tpose_heading, 2)))
          .joints;
}

}  // namespace

const SystemScores* SystemEvaluation::find(const std::string& condition) const {
  for (const auto& [name, scores] : conditions)
    if (name == condition) return &scores;
  return nullptr;
}

std::vector<double> joint_errors(const metrics::Track& pred, const metrics::Track& truth) {
  return metrics::mean_distance_by_point(pred, truth, {metrics::Alignment::Mode::frame, true});
}

std::vector<std::string> sequence_names(const std::vector<EvalSequence>& list, const Corpus& test) {
  std::vector<std::string> out;
  for (const EvalSequence& s : list)
    out.push_back(test.motions[s.motion].id + "@" + std::to_string(s.first) + ":" +
                  test.bodies[s.body_a].id + ">" + test.bodies[s.body_b].id);
  return out;
}

EvaluationOptions evaluation_options(const TrainConfig& config, const Corpus& test, uint64_t seed) {
  EvaluationOptions out;
  out.seed = seed;
  out.system = config.evaluation.system;
  out.anchor = config.evaluation.anchor;
  out.steady_bones = config.evaluation.steady_bones;
  out.keep_limbs = config.evaluation.keep_limbs;
  out.any_size = config.evaluation.any_size;
  out.any_way_up = config.evaluation.any_way_up;
  out.scans = config.evaluation.scans;
  out.clouds = config.section("skeleton").config.as<SkeletonStageConfig>().clouds;
  out.sequences = evaluation_sequences(test, static_cast<size_t>(config.evaluation.sequences),
                                       static_cast<size_t>(config.evaluation.frames), seed);
  return out;
}

SystemEvaluation evaluate_system(const Bundle& weights, const std::string& weights_name,
                                 const Corpus& corpus, const EvaluationOptions& options) {
  const SystemType& type = system_type(options.system);
  common_definition({{corpus.joints, "the data"},
                     {joint_definition(weights.only(type.roles), weights_name), weights_name}},
                    "judge the weights on data with the joints that they were trained on");
  SystemEvaluation out;
  for (const Condition& condition : conditions_of(type, weights)) {
    const std::string missing = lacking(condition, weights);
    if (!missing.empty())
      out.missing.push_back(missing);
    else
      out.conditions.emplace_back(condition.name, SystemScores{});
  }
  if (type.parts && weights.find("motion") != nullptr &&
      weights.find("deformation.weights") == nullptr)
    out.missing.push_back("surfaces: no model for deformation.weights");
  if (out.conditions.empty() && !(type.parts && weights.find("skeleton") != nullptr))
    throw InputError(
        weights_name,
        "cannot be judged as evaluation.system=" + type.name + ": " + out.missing.front(),
        "name the system of these weights, or train what is missing");
  RetargetOptions how;
  how.seed = options.seed;
  how.force = true;  // a badly extracted target counts with its error instead of ending the table
  how.anchor = options.anchor;
  how.steady_bones = options.steady_bones;
  how.keep_limbs = options.keep_limbs;
  how.any_size = options.any_size;
  how.any_way_up = options.any_way_up;
  for (const EvalSequence& sequence : options.sequences) {
    throw_if_stopped();
    const Performance performance(corpus, sequence, options.scans, options.seed);
    Sequence truth = truth_of(performance, options.every);
    const Body& target = performance.target();
    for (auto& [name, scores] : out.conditions) {
      if (name == "true_poses") {
        judge_surface(performance, Surface(weights, weights_name, target.rest, target.joints),
                      options, truth, &scores);
      } else if (name == "source_joints" || name == "rest_joints") {
        judge_extraction(performance, weights.need_as<SkeletonModel>("skeleton", weights_name),
                         name == "rest_joints", options, &scores);
      } else if (name == "clouds" || name == "true_vertices") {
        SystemInput input{weights, weights_name, target.rest, target.id, {}, how};
        if (type.needs_rest) input.rest = target.joints;
        const auto system = type.make(std::move(input));
        const bool clouds = name == "clouds";
        const auto push = [&](size_t i, const System::Show& show) {
          system->push(clouds ? performance.cloud(i) : performance.vertices_a(i),
                       "frame " + std::to_string(i), show);
        };
        judge_retargeting(performance, *system, push, options, truth, &scores);
      } else {
        Retargeter system(weights, weights_name, target.rest, target.joints, how);
        const auto push = [&](size_t i, const System::Show& show) {
          system.push_joints(performance.joints_a(i), show);
        };
        truth.source_rest = performance.source().joints;
        judge_retargeting(performance, system, push, options, truth, &scores);
        truth.source_rest.reset();
      }
    }
  }
  for (auto& [name, scores] : out.conditions) {
    metrics::average(&scores.model);
    for (auto& reference : scores.references) metrics::average(&reference.second);
  }
  if (type.parts) judge_extractor(weights, corpus, options.clouds, &out);
  return out;
}

}  // namespace restage
