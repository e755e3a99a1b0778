#include "datasets/benchmark/build.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/temporary.h"
#include "datasets/benchmark/characters.h"
#include "datasets/benchmark/floor.h"
#include "datasets/benchmark/manifest.h"
#include "datasets/benchmark/scans.h"
#include "datasets/benchmark/sequence.h"
#include "datasets/importers/batches.h"
#include "datasets/importers/import.h"
#include "datasets/importers/motions/cmu.h"
#include "datasets/readers/errors.h"
#include "datasets/sampling/thin_mesh.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// Where a folder can be put, links followed. An empty one that is there is made anew, to see
/// whether it can be replaced: no folder can in which somebody stands, or where a disk is mounted.
fs::path new_folder(const std::string& target) {
  std::error_code failed;
  fs::path out = fs::weakly_canonical(target, failed);
  if (!out.has_filename()) out = out.parent_path();
  if (!fs::exists(fs::symlink_status(out, failed))) return out;
  if (!fs::is_directory(out, failed) || !fs::is_empty(out, failed))
    throw InputError(target, "is there already", "give a new folder, or remove it");
  if (out == fs::current_path(failed) || !fs::remove(out, failed) ||
      !fs::create_directory(out, failed))
    throw InputError(target, "is there already and in use", "give a new folder");
  return out;
}

/// A folder beside the wanted one that takes its place on commit() and is removed otherwise.
class StagingFolder {
 public:
  explicit StagingFolder(const std::string& target)
      : target_(new_folder(target)), temporary_(name_beside(target_.string())) {
    std::error_code failed;
    fs::create_directory(path(), failed);
    if (failed)
      throw InputError(target, "cannot be made a folder", "give a place you can write to");
  }
  const std::string& path() const { return temporary_.path(); }
  void commit() {
    std::error_code failed;
    fs::rename(path(), target_, failed);
    if (failed) throw WorkError(target_.string() + ": cannot be put in place; is it in use?");
    temporary_.keep();
  }

 private:
  fs::path target_;
  Temporary temporary_;
};

class Builder {
 public:
  Builder(const BenchmarkRecipe& recipe, const std::string& where, const std::string& data)
      : r_(recipe),
        where_(where),
        key_(RngKey{recipe.seed, 0}.fold("benchmark")),
        model_(data + "/body"),
        rows_(read_recipes(data + "/body/bodies.csv")),
        info_(data_folder_info(true, true)) {
    read_clips(data);
    average_ = make_character({"average", "", {}, "", 0}, model_, rows_, key_);
    const auto vertices = std::ssize(average_.rest.vertices);
    if (r_.vertices >= vertices)
      throw InputError(where_, cat("bodies have ", vertices, " vertices, so 'vertices' takes none"),
                       "give fewer, or 0");
    thin_ = thin_mesh(average_.rest, static_cast<size_t>(r_.vertices));
    touching_ = outermost_vertices(average_);
    check_names();
    for (const CharacterRecipe& c : r_.characters)
      cast_.bodies.push_back(thinned(make_character(c, model_, rows_, key_)));
    for (const MotionRecipe& m : r_.motions) cast_.motions.push_back(test_clip(m.clip));
    check_views();
  }

  void build(const std::string& folder) {
    write_split("train", train_, folder);
    write_split("validation", r_.validation, folder);
    write_split("test", r_.test, folder);
    write_pairs("naked", r_.naked, folder);
    write_pairs("clothed", r_.clothed, folder);
    write_all_scans(folder);
  }

  const FileInfo& info() const { return info_; }

 private:
  void read_clips(const std::string& data) {
    add_clips(import_cmu(data + "/cmu/clips30.h5"), "cmu/clips30.h5");
    train_ = r_.train;
    for (const MoreClipsRecipe& more : r_.more) {
      std::error_code ignored;
      if (!fs::exists(data + "/" + more.file, ignored))
        throw InputError(where_, "more names " + more.file + ", which is not in " + data,
                         "put it there, or leave it out");
      std::vector<Motion> motions = import_cmu(data + "/" + more.file, more.without);
      for (const Motion& motion : motions) {
        if (!more.train) continue;
        const auto& named = train_.clips;
        if (std::find(named.begin(), named.end(), motion.id) != named.end())
          throw InputError(where_,
                           "clip '" + motion.id + "' is in train.clips, and all clips of " +
                               more.file + " are for training",
                           "list it once, or write 'train: false' beside the file");
        train_.clips.push_back(motion.id);
      }
      add_clips(std::move(motions), more.file);
    }
  }

  void add_clips(std::vector<Motion> motions, const std::string& file) {
    for (Motion& motion : motions) {
      const std::string id = motion.id;
      if (!clips_.emplace(id, std::move(motion)).second)
        throw InputError(where_, "clip '" + id.substr(0, 40) + "' of " + file + " is there already",
                         "leave one of the two out, by 'without'");
    }
  }

  Body thinned(Body body) const { return r_.vertices > 0 ? thin_body(body, thin_) : body; }

  const BodyRecipe& row(const std::string& id) const {
    const auto at =
        std::find_if(rows_.begin(), rows_.end(), [&](const BodyRecipe& r) { return r.id == id; });
    if (at == rows_.end())
      throw InputError(where_, "bodies.csv has no body '" + id.substr(0, 40) + "'",
                       "name one such as '" + rows_.front().id + "'");
    return *at;
  }

  const Motion& clip(const std::string& id) const {
    const auto at = clips_.find(id);
    if (at == clips_.end())
      throw InputError(where_, "there is no clip '" + id.substr(0, 40) + "'",
                       "name one such as '" + clips_.begin()->first + "'");
    return at->second;
  }

  /// Everything that names data, before anything is written.
  void check_names() const {
    std::map<std::string, std::string> split_of;
    const auto subject = [&](const std::string& id, const std::string& split) {
      const std::string& who = clip(id).subject;
      if (const auto [at, added] = split_of.emplace(who, split); !added && at->second != split)
        throw InputError(where_,
                         "clip '" + id + "' is of subject " + who + ", who is in " + at->second +
                             " and in " + split,
                         "keep a subject in one split");
    };
    for (const auto& [split, lists] :
         {std::pair{"train", &train_}, std::pair{"validation", &r_.validation},
          std::pair{"test", &r_.test}}) {
      for (const std::string& id : lists->bodies) row(id);
      for (const std::string& id : lists->clips) subject(id, split);
    }
    for (const CharacterRecipe& c : r_.characters)
      if (!c.body.empty()) row(c.body);
    for (const MotionRecipe& m : r_.motions) {
      subject(m.clip, "test");
      const auto frames = static_cast<int64_t>(clip(m.clip).frames());
      if (m.first >= frames || m.frames > frames - m.first)
        throw InputError(where_,
                         cat("motion '", m.id, "' ends after clip '", m.clip, "', which has ",
                             frames, " frames"),
                         "choose first and frames inside it");
    }
  }

  Motion grounded(const std::string& id) const {
    return on_floor(clip(id), average_, touching_, r_.floor_window);
  }

  Motion test_clip(const std::string& id) const {
    Motion out = grounded(id);
    out.split = "test";
    return out;
  }

  void write_split(const std::string& split, const SplitRecipe& lists, const std::string& folder) {
    if (lists.bodies.empty() && lists.clips.empty()) return;
    log_info(cat(split, ".h5: ", lists.bodies.size(), " bodies, ", lists.clips.size(), " clips"));
    DatasetWriter writer(folder + "/" + split + ".h5", info_);
    in_batches<Body>(
        lists.bodies.size(),
        [&](size_t i) {
          Body body = thinned(model_.build(row(lists.bodies[i])));
          body.split = split;
          return body;
        },
        [&](size_t, const Body& body) { writer.add(body); });
    for (const std::string& id : lists.clips) {
      Motion motion = grounded(id);
      motion.split = split;
      writer.add(motion);
    }
    writer.commit();
  }

  template <class T>
  static size_t index_of(const std::vector<T>& list, const std::string& id) {
    const auto at = std::find_if(list.begin(), list.end(), [&](const T& t) { return t.id == id; });
    return static_cast<size_t>(at - list.begin());  // check_recipe() knows that it is there
  }

  EvalSequence sequence(const std::string& source, const std::string& target, size_t motion) const {
    const MotionRecipe& m = r_.motions[motion];
    EvalSequence out;
    out.body_a = index_of(r_.characters, source);
    out.body_b = index_of(r_.characters, target);
    out.motion = motion;
    out.first = static_cast<size_t>(m.first);
    out.frames =
        m.frames > 0 ? static_cast<size_t>(m.frames) : cast_.motions[motion].frames() - out.first;
    return out;
  }

  static std::string made(const std::string& folder, const std::string& name) {
    log_info(fs::path(folder).filename().string() + "/" + name);
    fs::create_directories(folder + "/" + name);
    return folder + "/" + name;
  }

  void write_pairs(const std::string& set, const std::vector<PairRecipe>& pairs,
                   const std::string& folder) const {
    for (size_t m = 0; m < r_.motions.size(); ++m)
      for (const PairRecipe& p : pairs) {
        throw_if_stopped();
        const std::string& motion = r_.motions[m].id;
        if (!p.motions.empty() &&
            std::find(p.motions.begin(), p.motions.end(), motion) == p.motions.end())
          continue;
        write_sequence(Performance(cast_, sequence(p.source, p.target, m), ScanConfig{}, r_.seed),
                       info_, made(folder + "/" + set, motion + "-" + p.source + "-" + p.target),
                       r_.rotations);
      }
  }

  ScanScene scene(const ScanRecipe& s) const {
    ScanScene out{{cast_, sequence(s.source, s.target, index_of(r_.motions, s.motion)),
                   ScanConfig{}, r_.seed},
                  r_.scanners[index_of(r_.scanners, s.scanner)],
                  nullptr,
                  key_.fold("scans").fold(name_of(s))};
    if (!s.intruder.empty()) out.intruder = &cast_.bodies[index_of(r_.characters, s.intruder)];
    return out;
  }

  /// Cameras that see nobody are told before anything is written.
  void check_views() const {
    for (const ScanRecipe& s : r_.scans) {
      const size_t seen = points_in_first_frame(scene(s));
      if (seen < kLeastPoints)
        throw InputError(
            where_,
            cat("scanner '", s.scanner, "' sees ", seen, " points of '", s.source, "' in motion '",
                s.motion, "', at least ", kLeastPoints, " are needed"),
            "bring it nearer, or give it more pixels and less dropout");
    }
  }

  void write_all_scans(const std::string& folder) const {
    for (const ScanRecipe& s : r_.scans)
      write_scan_sequence(scene(s), s.known_frame, r_.rotations, info_,
                          made(folder + "/scans", name_of(s)));
  }

  const BenchmarkRecipe& r_;
  const std::string& where_;
  RngKey key_;
  MakeHuman model_;
  std::vector<BodyRecipe> rows_;
  FileInfo info_;
  std::map<std::string, Motion> clips_;
  SplitRecipe train_;  ///< with all clips of BenchmarkRecipe::more
  Body average_;
  ThinMesh thin_;  ///< of every body, where the recipe says so
  std::vector<int32_t> touching_;
  Corpus cast_;
};

/// Files of the data folder that the benchmark is made from.
std::set<std::string> inputs_of(const BenchmarkRecipe& recipe) {
  std::set<std::string> out = {"body/makehuman.h5", "body/bodies.csv", "cmu/clips30.h5"};
  for (const MoreClipsRecipe& more : recipe.more) out.insert(more.file);
  for (const CharacterRecipe& c : recipe.characters)
    if (!c.garment.empty())
      for (const char* ending : {".obj.gz", ".mhclo.gz"})
        out.insert("body/clothes/" + c.garment + ending);
  return out;
}

}  // namespace

BenchmarkSummary build_benchmark(const BenchmarkRecipe& recipe, const std::string& recipe_text,
                                 const std::string& where, const std::string& data,
                                 const std::string& out) {
  check_recipe(recipe, where);
  Builder builder(recipe, where, data);
  StagingFolder staging(out);
  log_info(cat("building ", out, " with seed ", recipe.seed));  // inputs are fine
  builder.build(staging.path());
  write_file_atomically(staging.path() + "/recipe.yaml", recipe_text);
  Manifest manifest;
  manifest.protocol = recipe.protocol;
  manifest.seed = recipe.seed;
  manifest.license = builder.info().license;
  manifest.provenance = builder.info().provenance;
  for (const std::string& name : inputs_of(recipe))
    manifest.inputs[name] = describe_file(data + "/" + name);
  manifest.files = describe_files(staging.path());
  write_manifest(staging.path(), manifest);
  staging.commit();
  BenchmarkSummary summary;
  summary.files = manifest.files.size() + 1;
  for (const auto& [name, file] : manifest.files) summary.bytes += file.bytes;
  return summary;
}

}  // namespace restage
