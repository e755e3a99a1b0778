#include "experiments/evaluation.h"

#include "nn/geometry/closed_form.h"

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

void finish(metrics::Evaluation* e) {
  const size_t columns = metrics::table().size();
  for (size_t m = 0; m < columns; ++m) {
    double total = 0;
    int count = 0;
    for (const metrics::Values& row : e->sequences)
      if (row[m]) total += *row[m], ++count;
    e->mean.push_back(count > 0 ? metrics::Value(total / count) : std::nullopt);
  }
}

/// The rows that need no learning. Their surfaces use the model's skinning, since they have none.
void add_references(const Sequence& s, const Retargeter& target, SystemScores* scores) {
  Predicted rest, unchanged, closed;
  const auto poses = closed_form(s.source, target.rest(), s.source_rest);
  const auto carried = rest_pose_joints(s.source, target.rest());
  for (size_t f = 0; f < s.source.size(); ++f) {
    closed.joints.push(forward_kinematics(target.rest(), poses[f]).joints);
    closed.vertices.push(target.pose_vertices(poses[f]));
    rest.joints.push(carried[f]);
    Points moved = target.target().vertices;
    for (Point& p : moved) p += (carried[f][0] - target.rest()[0]).cast<float>();
    rest.vertices.push(moved);
    unchanged.joints.push(s.source[f]);
  }
  if (scores->references.empty())
    scores->references = {{"rest_pose", {}}, {"source_unchanged", {}}, {"closed_form", {}}};
  add(rest, s, &scores->references[0].second);
  add(unchanged, s, &scores->references[1].second);
  add(closed, s, &scores->references[2].second);
}

void judge(const Performance& performance, Retargeter& retargeter, bool clouds,
           SystemScores* scores) {
  Sequence s;
  Predicted model;
  for (size_t i = 0; i < performance.frames(); ++i) {
    s.joints.push(performance.joints_b(i));
    s.vertices.push(performance.vertices_b(i));
    const auto frames = clouds ? retargeter.push(performance.cloud(i), "frame " + std::to_string(i))
                               : retargeter.push_joints(performance.joints_a(i));
    s.source.push_back(retargeter.source_joints());
    for (const RetargetedFrame& f : frames) {
      model.joints.push(f.joints);
      model.vertices.push(f.vertices);
    }
  }
  if (!clouds) s.source_rest = performance.source().joints;
  add(model, s, &scores->model);
  scores->frames.push_back(s.joints.frames);
  add_references(s, retargeter, scores);
}

}  // namespace

SystemEvaluation evaluate_system(const ModelSet& models, const Corpus& corpus,
                                 const std::vector<EvalSequence>& list, uint64_t seed,
                                 double anchor) {
  SystemEvaluation out;
  RetargetOptions options;
  options.seed = seed;
  options.force =
      true;  // a badly extracted target counts with its error instead of ending the table
  options.samples = 4;
  options.anchor = anchor;
  for (const EvalSequence& sequence : list) {
    const Performance performance(corpus, sequence, ScanConfig{}, seed);
    Retargeter from_clouds(models, performance.target().rest, performance.target().id, options);
    judge(performance, from_clouds, true, &out.extracted);
    Retargeter from_truth(models, performance.target().rest, performance.target().joints, options);
    judge(performance, from_truth, false, &out.truth);
  }
  for (SystemScores* scores : {&out.extracted, &out.truth}) {
    finish(&scores->model);
    for (auto& reference : scores->references) finish(&reference.second);
  }
  return out;
}

}  // namespace restage
