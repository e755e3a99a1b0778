#include "bench/inputs.h"

#include <algorithm>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "bench/transfers.h"
#include "datasets/sampling/clouds.h"
#include "datasets/sampling/evaluation.h"
#include "datasets/sampling/pairs.h"
#include "datasets/sampling/windows.h"
#include "nn/config/config.h"
#include "nn/models/even_points.h"
#include "nn/weights/bundle.h"
#include "nn/weights/state.h"

namespace restage::bench {
namespace {

constexpr int64_t kBatch = 4, kWindows = 64;
constexpr int kCloudPoints = 1024;  ///< of a frame, and of what the paper's extractor sees

struct Model {
  const char* file;  ///< in the folder
  const char* name;  ///< in the registry
};
constexpr Model kModels[] = {{"skeleton", "skeleton/point_transformer"},
                             {"pointnet", "skeleton/pointnet"},
                             {"smrm", "smrm/rot6d"},
                             {"weights", "deformation/weights"},
                             {"offsets", "deformation/offsets"}};

Tensor relative(const Joints& joints, const Vec3& origin) {
  Points p;
  for (const Vec3& j : joints) p.push_back((j - origin).cast<float>());
  return tensor_of(p);
}

/// [a.size(), rows of each...] from tensors of one shape.
Tensor stack(const std::vector<Tensor>& parts) {
  std::vector<float> all;
  for (const Tensor& t : parts) all.insert(all.end(), t.data<float>(), t.data<float>() + t.numel());
  return Tensor::from<float>({static_cast<int64_t>(parts.size()), parts[0].size(0), 3}, all);
}

/// Sorted and about its centroid, as the online extraction puts every cloud.
Points in_order(Points cloud, Point* centre) {
  std::sort(cloud.begin(), cloud.end(), [](const Point& a, const Point& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  });
  *centre = centroid(cloud);
  for (Point& p : cloud) p -= *centre;
  return cloud;
}

/// The points of frame `i` that the retargeter shows its extractor, with one choice a frame and
/// seed 0 (infer/retargeter.cpp, nn/models/extraction.cpp). LibTorch's program gets them from here,
/// so that both do the same work on the same points; the retargeter chooses by itself, and is timed
/// with that. If the rule changes there and not here, the comparison of answers fails.
Points chosen_points(const Points& cloud, size_t i) {
  const RngKey key = RngKey{0, 0}.fold("frame").fold(static_cast<uint64_t>(i));
  EvenPoints even;
  even.arrange(cloud);
  Points out;
  even.choose(kCloudPoints, Rng(key).uniform(), &out);
  return out;
}

/// Frames of one body's performance as clouds of 1,024 points, and another body as target.
void add_performance(TensorFile& file, const Corpus& corpus) {
  const EvalSequence sequence =
      evaluation_sequences(corpus, 1, static_cast<size_t>(kFrames), 0).at(0);
  const Performance performance(corpus, sequence, ScanConfig{kCloudPoints, kCloudPoints, 0.005}, 0);
  std::vector<Tensor> clouds, chosen, joints, roots;
  for (size_t i = 0; i < performance.frames(); ++i) {
    Point centre;
    const Points cloud = in_order(performance.cloud(i), &centre);
    clouds.push_back(tensor_of(cloud));
    chosen.push_back(tensor_of(chosen_points(cloud, i)));
    const Joints a = performance.joints_a(i);
    joints.push_back(relative(a, a[0]));
    roots.push_back(tensor_of(Points{a[0].cast<float>()}));
  }
  file.tensors["frames.clouds"] = stack(clouds);
  file.tensors["frames.chosen"] = stack(chosen);
  file.tensors["frames.joints"] = stack(joints);
  file.tensors["frames.roots"] = stack(roots);
  const Body& b = performance.target();
  const SurfaceSamples surface =
      SurfaceSampler(b).draw(RngKey{0, 0}.fold("target"), static_cast<size_t>(kSurfacePoints));
  Points points = surface.on_rest(b);
  for (Point& p : points) p -= b.joints[0].cast<float>();
  file.tensors["target.points"] = tensor_of(points);
  file.tensors["target.joints"] = relative(b.joints, b.joints[0]);
}

void add_batches(TensorFile& file, const Corpus& corpus) {
  const CloudBatch clouds = CloudSampler(corpus, CloudConfig{}, 0).batch(0, kBatch);
  file.tensors["clouds.points"] = clouds.points;
  file.tensors["clouds.joints"] = clouds.joints;
  const WindowBatch windows = WindowSampler(corpus, WindowConfig{}, 0).batch(0, kWindows);
  file.tensors["windows.joints"] = windows.joints_a;
  file.tensors["windows.trans"] = windows.trans_a;
  file.tensors["windows.rest_a"] = windows.rest_a;
  file.tensors["windows.rest_b"] = windows.rest_b;
  file.tensors["windows.sixd"] = windows.sixd_a;
  file.tensors["windows.self_mask"] = windows.self_mask;
  PairConfig pair_config;
  pair_config.points = static_cast<int>(kSurfacePoints);
  const PairBatch pairs = PairSampler(corpus, pair_config, 0).batch(0, kBatch);
  file.tensors["pairs.rest_points"] = pairs.rest_points;
  file.tensors["pairs.posed_points"] = pairs.posed_points;
  file.tensors["pairs.rest_joints"] = pairs.rest_joints;
  file.tensors["pairs.local"] = pairs.local;
  file.tensors["pairs.axis_angle"] = pairs.axis_angle;
}

void write_weights(const std::string& folder, const std::string& name, Module& net) {
  std::filesystem::create_directories(folder);
  write_safetensors(folder + "/" + name + ".safetensors", to_file(net));
}

/// Batches and first weights of the systems without a skeleton.
void add_transfers(const std::string& folder, TensorFile& file, const Corpus& corpus) {
  for (const TransferCase& c : transfer_cases()) {
    const auto net = transfer_model(c);
    write_weights(folder + "/initial", c.name, *net);
    transfer_batch(corpus, c, net->frames()).each([&](const char* part, const Tensor& value) {
      file.tensors[c.name + "." + part] = value;
    });
  }
}

/// What the kernels get: numbers without meaning.
void add_kernel_inputs(TensorFile& file) {
  const auto noise = [&](const char* name, const Shape& shape) {
    Tensor t = Tensor::empty(shape);
    const RngKey key = RngKey{0, 0}.fold(name);
    for (int64_t i = 0; i < t.numel(); ++i)
      t.data<float>()[i] = static_cast<float>(normal(key, static_cast<uint64_t>(i)));
    file.tensors[std::string("kernel.") + name] = t;
  };
  noise("features", {1, 1024, 32});
  noise("sequence", {16, 30, 578});
  for (const char* name : {"queries", "keys", "values"}) noise(name, {1, kMostAttended, 64});
}

bool same_shapes(Module& a, Module& b) {
  const auto x = state_of(a), y = state_of(b);
  return std::equal(x.begin(), x.end(), y.begin(), y.end(), [](const auto& s, const auto& t) {
    return s.name == t.name && s.value->shape() == t.value->shape();
  });
}

/// Those models of a weights file that have the paper's sizes.
void add_trained(const std::string& folder, const std::string& weights) {
  const Bundle set = load_bundle(weights);
  const std::pair<const char*, const char*> all[] = {{"skeleton", "skeleton"},
                                                     {"weights", "deformation.weights"},
                                                     {"offsets", "deformation.offsets"}};
  for (const auto& [file, role] : all)
    for (const Model& m : kModels) {
      auto* net = set.find_as<Module>(role);
      if (net != nullptr && std::string(m.file) == file &&
          same_shapes(*net, *make_model(m.name, model_config(m.name), Init{})))
        write_weights(folder + "/trained", file, *net);
    }
}

/// All bodies and motions of a file; of the built-in source its usual numbers, for both sizes.
void write_training(const std::string& folder, const InputSettings& settings,
                    const std::string& size) {
  TrainConfig config;
  load_config(settings.configs + "/" + size + "/all.yaml", {}, config);
  config.data = {};
  config.data.source = settings.data == "builtin"
                           ? settings.data
                           : std::filesystem::absolute(settings.data).string();
  write_file_atomically(folder + "/" + size + ".yaml", resolved_yaml(config));
}

}  // namespace

Tensor tensor_of(const Points& points) {
  Tensor t = Tensor::empty({std::ssize(points), 3});
  std::copy_n(points[0].data(), t.numel(), t.data<float>());
  return t;
}

void make_inputs(const std::string& folder, const InputSettings& settings) {
  std::filesystem::remove_all(folder + "/trained");
  CorpusSource source;
  source.source = settings.data;
  source.bodies = {4, 0, 0};
  source.motions = {8, 0, 0};
  const Corpus corpus = load_corpus(source, "train");
  TensorFile file;
  add_batches(file, corpus);
  add_performance(file, corpus);
  add_kernel_inputs(file);
  add_transfers(folder, file, corpus);
  file.metadata["data"] = corpus.description;
  for (const Model& m : kModels)
    write_weights(
        folder + "/initial", m.file,
        *make_model(m.name, model_config(m.name), Init{RngKey{0, 0}.fold(m.name), DType::f32}));
  for (const char* size : {"lite", "paper"}) write_training(folder, settings, size);
  add_trained(folder, settings.lite);
  if (!settings.trained.empty()) add_trained(folder, settings.trained);
  std::filesystem::copy_file(settings.lite, folder + "/lite.safetensors",
                             std::filesystem::copy_options::overwrite_existing);
  write_safetensors(folder + "/inputs.safetensors", file);
}

Inputs::Inputs(std::string folder)
    : folder_(std::move(folder)), file_(read_safetensors(folder_ + "/inputs.safetensors")) {}

const Tensor& Inputs::at(const std::string& name) const { return file_.at(name, folder_); }

std::string Inputs::path(const std::string& variant, const std::string& model) const {
  return folder_ + "/" + variant + "/" + model + ".safetensors";
}

bool Inputs::has(const std::string& variant, const std::string& model) const {
  return std::filesystem::exists(path(variant, model));
}

TrainConfig Inputs::training(const std::string& size) const {
  TrainConfig config;
  load_config(folder_ + "/" + size + ".yaml", {}, config);
  return config;
}

void Inputs::load(Module& module, const std::string& variant, const std::string& model,
                  const std::string& prefix) const {
  const std::string file = path(has(variant, model) ? variant : "initial", model);
  load_state(module, read_safetensors(file), prefix, file);
}

}  // namespace restage::bench
