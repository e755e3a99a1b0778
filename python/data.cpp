// restage.data: batches as the stages of a training see them.
#include <algorithm>

#include "datasets/sampling/clouds.h"
#include "datasets/sampling/pairs.h"
#include "datasets/sampling/transfers.h"
#include "datasets/sampling/windows.h"
#include "experiments/shipped_config.h"
#include "nn/config/config.h"
#include "python/copies.h"
#include "python/engine.h"
#include "python/feed.h"
#include "train/stages/deformation_stage.h"
#include "train/stages/motion_stage.h"
#include "train/stages/skeleton_stage.h"
#include "train/stages/transfer_stage.h"
#include "train/training/training.h"

namespace restage::python {
namespace {

/// What the sections of a configuration do not say, as other keys or the network decide it there.
struct Wishes {
  std::optional<int64_t> points, frames;
  std::optional<bool> rotations, skin_weights, truth;
};

struct Asked {
  TrainConfig config;
  std::string stage, split;  ///< `stage`: of examples()
  Wishes wishes;
};

/// `file` is a configuration, or empty: the defaults.
TrainConfig config_of(const std::string& file, const std::vector<std::string>& words) {
  TrainConfig config;
  if (!file.empty()) {
    load_config(config_file(file), words, config);
    return config;
  }
  ConfigNode tree = parse_yaml("{}", "options");
  for (const std::string& word : words) apply_override(tree, word);
  read_config(tree, config);
  return config;
}

int count_of(int64_t n, const char* what) {
  if (n < 1 || n > kMostPoints)
    throw InputError("", std::string(what) + " is " + std::to_string(n),
                     "give 1 to " + std::to_string(kMostPoints));
  return static_cast<int>(n);
}

/// A sampler, with the corpus that it draws from.
template <class Sampler>
struct Drawing {
  Corpus corpus;
  std::optional<Sampler> sampler;
};

/// Batch k of a stage whose step k has the samples k n ... k n + n - 1.
template <class Sampler, class Config>
Feed::Draw drawn_by(const Asked& asked, const Config& config, const char* name, int64_t n) {
  auto kept = std::make_shared<Drawing<Sampler>>();
  kept->corpus = load_corpus(asked.config.data, asked.split);
  kept->sampler.emplace(kept->corpus, config, sampler_seed(asked.config.seed, name));
  return [kept, n](int64_t k) {
    const auto batch = kept->sampler->batch(k * n, n);
    NamedTensors out = named_tensors(batch);
    if constexpr (std::is_same_v<Sampler, CloudSampler>)
      if (batch.past.defined())
        out.emplace_back("asked", Tensor::from<int64_t>({std::ssize(batch.asked)}, batch.asked));
    return out;
  };
}

template <class StageConfig>
const StageConfig& section(const Asked& asked, const char* stage) {
  return asked.config.section(stage).config.as<StageConfig>();
}

template <class M>
std::shared_ptr<M> network(const ModelChoice& choice) {
  return make_model_as<M>(choice.name, choice.sizes, Init{RngKey{}, DType::f32});
}

Feed::Draw clouds(const Asked& asked) {
  const auto& c = section<SkeletonStageConfig>(asked, "skeleton");
  const Wishes& w = asked.wishes;
  CloudConfig clouds = c.clouds;
  clouds.points =
      count_of(w.points ? *w.points : network<SkeletonModel>(c.model)->points(), "points");
  clouds.rotations = w.rotations.value_or(c.orientation_weight > 0);
  clouds.skin_weights = w.skin_weights.value_or(c.vote_weight > 0 || c.segmentation_weight > 0);
  return drawn_by<CloudSampler>(asked, clouds, "skeleton.clouds", c.optimiser.batch);
}

Feed::Draw windows(const Asked& asked) {
  const auto& c = section<MotionStageConfig>(asked, "motion");
  if (c.answers.tracks.sequences > 0)
    throw InputError("motion.answers", "asks an extractor about the windows",
                     "take restage.data.examples(config, 'motion'), or set sequences: 0");
  WindowConfig windows = c.windows;
  windows.truth = asked.wishes.truth.value_or(c.paired_share > 0);
  return drawn_by<WindowSampler>(asked, windows, "motion.windows", c.optimiser.batch);
}

Feed::Draw pairs(const Asked& asked) {
  const auto& c = section<DeformationStageConfig>(asked, "deformation");
  PairConfig pairs = c.pairs;
  pairs.skin_weights = asked.wishes.skin_weights.value_or(c.supervision > 0);
  return drawn_by<PairSampler>(asked, pairs, "deformation.pairs", c.optimiser.batch);
}

Feed::Draw transfers(const Asked& asked) {
  const auto& c = section<TransferStageConfig>(asked, "transfer");
  TransferConfig pairs = c.pairs;
  if (asked.wishes.frames) {
    pairs.frames = count_of(*asked.wishes.frames, "frames");
  } else {
    const auto net = network<TransferModel>(c.model);
    pairs.frames = static_cast<int>(net->frames());
    if (net->equal_counts()) pairs.points = 0;
  }
  return drawn_by<TransferSampler>(asked, pairs, "transfer.pairs", c.optimiser.batch);
}

/// A stage, with all that it keeps a reference to.
struct StageDrawing {
  TrainConfig config;
  TrainingData data;
  Bundle given;
  std::unique_ptr<Stage> stage;
};

/// What step k of a stage of the configuration sees, whichever stage it is.
Feed::Draw examples(const Asked& asked) {
  const std::string& name = asked.stage;
  auto kept = std::make_shared<StageDrawing>();
  kept->config = asked.config;
  TrainConfig& config = kept->config;
  StageSection& section = config.section(stage_type(name).name);
  section.from = section.init = std::nullopt;
  config.device = "cpu";
  config.loop.selection = {};
  config.loop.micro_batches = 1;
  if (name == "skeleton")  // it scans held-out people at once, and nobody asks for its figures
    section.config.as<SkeletonStageConfig>().validation_clouds = 1;
  for (const std::string& read : stage_type(name).reads(section.config)) {
    const auto& from = config.section(read).from;
    if (!from)
      throw InputError(name, "its examples are what the networks of '" + read + "' answer",
                       "give " + read + ".from: a weights file");
    kept->given.add(networks_of(stage_type(read), *from));
  }
  config.stages = stage_type(name).reads(section.config);
  config.stages.push_back(name);
  kept->data.train = load_corpus(config.data, asked.split);
  kept->data.validation = load_corpus(config.data, "validation");
  kept->stage = make_stage(config, name, kept->data, &kept->given);
  return [kept](int64_t k) { return kept->stage->examples(k); };
}

Feed::Draw draw_of(const std::string& kind, const Asked& asked) {
  if (kind == "clouds") return clouds(asked);
  if (kind == "windows") return windows(asked);
  if (kind == "pairs") return pairs(asked);
  if (kind == "transfers") return transfers(asked);
  return examples(asked);
}

/// With loop.overfit_batches the same batches come again, as in a training.
Feed::Draw repeated(Feed::Draw draw, int64_t batches) {
  if (batches <= 0) return draw;
  return [draw = std::move(draw), batches](int64_t k) { return draw(k % batches); };
}

// ---- in Python ----------------------------------------------------------------------------------

/// The tensor's memory as an array, which may be written to: nobody else has it.
py::array own_array(Tensor tensor) {
  if (tensor.shared()) tensor = tensor.clone();
  auto* kept = new Tensor(std::move(tensor));
  const py::capsule owner(kept, [](void* p) { delete static_cast<Tensor*>(p); });
  std::vector<py::ssize_t> shape;
  for (int i = 0; i < kept->rank(); ++i) shape.push_back(kept->size(i));
  switch (kept->dtype()) {
    case DType::f32:
      return py::array_t<float>(shape, kept->data<float>(), owner);
    case DType::f64:
      return py::array_t<double>(shape, kept->data<double>(), owner);
    case DType::i32:
      return py::array_t<int32_t>(shape, kept->data<int32_t>(), owner);
    case DType::i64:
      break;
  }
  return py::array_t<int64_t>(shape, kept->data<int64_t>(), owner);
}

py::dict arrays_of(NamedTensors tensors) {
  py::dict out;
  for (auto& [name, tensor] : tensors) out[py::str(name)] = own_array(std::exchange(tensor, {}));
  return out;
}

class PyBatches {
 public:
  using Bound = void;
  PyBatches(const std::string& kind, const std::string& file, const std::vector<std::string>& words,
            const Wishes& wishes, const std::string& stage, const std::string& split, int64_t start,
            const std::optional<int64_t>& steps, int64_t ahead) {
    constexpr int64_t kMostAhead = 1000, kMostSteps = int64_t{1} << 40;
    check("start", start, kMostSteps);
    check("ahead", ahead, kMostAhead);
    if (steps) check("steps", *steps, kMostSteps);
    Watch watch;
    watch.run([&] {
      const Asked asked{config_of(file, words), stage, split, wishes};
      Feed::Draw draw = repeated(draw_of(kind, asked), asked.config.loop.overfit_batches);
      feed_.emplace(std::move(draw), start, steps ? start + *steps : Feed::kEndless,
                    static_cast<size_t>(ahead));
    });
  }
  ~PyBatches() { close(); }

  py::dict next() {
    std::optional<NamedTensors> batch;
    {
      const py::gil_scoped_release released;
      batch = feed_->next([] {
        const py::gil_scoped_acquire acquired;
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      });
    }
    if (!batch) throw py::stop_iteration();
    return arrays_of(std::move(*batch));
  }
  py::dict at(int64_t step) const {
    check("step", step, int64_t{1} << 40);
    Watch watch;
    return arrays_of(watch.run([&] { return feed_->at(step); }));
  }
  int64_t step() const { return feed_->number(); }
  size_t ready() const { return feed_->ready(); }
  void close() {
    const py::gil_scoped_release released;
    if (feed_) feed_->close();
  }

 private:
  static void check(const char* name, int64_t value, int64_t most) {
    if (value < 0 || value > most)
      throw InputError("", std::string(name) + " is " + std::to_string(value),
                       "give 0 to " + std::to_string(most));
  }
  std::optional<Feed> feed_;
};

}  // namespace

void add_data(py::module_& m) {
  py::class_<PyBatches> batches(
      m, "Batches",
      R"(Batches without an end, or so many as `steps` says: dicts of NumPy arrays.

Batch number k is a function of the configuration, the seed and k alone. A thread draws the next ones while Python
works; it does not hold the GIL.)");
  refuse_copies(batches,
                "Batches cannot be copied or pickled, as a thread draws them: make them anew with "
                "start=batches.step");
  batches
      .def(
          py::init([](const std::string& kind, const std::string& file,
                      const std::vector<std::string>& words, const std::string& split,
                      int64_t start, const std::optional<int64_t>& steps, int64_t ahead,
                      const std::optional<int64_t>& points, const std::optional<int64_t>& frames,
                      const std::optional<bool>& rotations, const std::optional<bool>& skin_weights,
                      const std::optional<bool>& truth, const std::string& stage) {
            return std::make_unique<PyBatches>(
                kind, file, words, Wishes{points, frames, rotations, skin_weights, truth}, stage,
                split, start, steps, ahead);
          }),
          py::arg("kind"), py::arg("config"), py::arg("words"), py::kw_only(), py::arg("split"),
          py::arg("start"), py::arg("steps"), py::arg("ahead"), py::arg("points") = py::none(),
          py::arg("frames") = py::none(), py::arg("rotations") = py::none(),
          py::arg("skin_weights") = py::none(), py::arg("truth") = py::none(),
          py::arg("stage") = "")
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__", &PyBatches::next)
      .def("at", &PyBatches::at, py::arg("step"),
           "The batch of any step, drawn now; what comes next stays the same.")
      .def_property_readonly("step", &PyBatches::step, "the number of the batch that comes next")
      .def_property_readonly("ready", &PyBatches::ready,
                             "how many batches are drawn beforehand now")
      .def("close", &PyBatches::close, "Ends the thread that draws; nothing comes any more.");
}

}  // namespace restage::python
