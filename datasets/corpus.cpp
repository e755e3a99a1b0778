#include "datasets/corpus.h"

#include <cstdio>
#include <filesystem>
#include <map>
#include <set>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/motions.h"
#include "datasets/readers/file_sums.h"
#include "datasets/readers/sha256.h"
#include "datasets/schema.h"

namespace restage {
namespace {

void check_split(const std::string& split) {
  if (split != "train" && split != "validation" && split != "test")
    throw InputError("", "unknown split '" + split + "'", "use train, validation or test");
}

void check_not_empty(const Corpus& corpus, const std::string& where, const std::string& split) {
  const char* what = corpus.bodies.empty()    ? "bodies"
                     : corpus.motions.empty() ? "motions"
                                              : nullptr;
  if (!what) return;
  const std::string wrong = split.empty() ? std::string("no ") + what
                                          : std::string("no ") + what + " of split '" + split + "'";
  throw InputError(where, wrong, "give data with bodies and motions of every split that is used");
}

/// A subject in two splits would let a test meet a person that training has seen.
void check_subjects(const Corpus& corpus, const std::string& where) {
  std::map<std::string, std::string> split_of;
  for (const Motion& motion : corpus.motions) {
    if (motion.subject.empty()) continue;
    const std::string& split = split_of.emplace(motion.subject, motion.split).first->second;
    if (split != motion.split)
      throw InputError(
          where,
          "subject '" + motion.subject + "' is in the splits " + split + " and " + motion.split,
          "put all motions of a subject into one split");
  }
}

SplitCounts only(const SplitCounts& counts, const std::string& split) {
  SplitCounts out = counts;
  if (split.empty()) return out;
  if (split != "train") out.train = 0;
  if (split != "validation") out.validation = 0;
  if (split != "test") out.test = 0;
  return out;
}

std::string text(const SplitCounts& c) {
  return std::to_string(c.train) + "/" + std::to_string(c.validation) + "/" +
         std::to_string(c.test);
}

Corpus builtin_corpus(const CorpusSource& source, const std::string& split) {
  const SplitCounts b = only(source.bodies, split), m = only(source.motions, split);
  Corpus out;
  out.bodies = builtin_bodies(source.seed, b.train, b.validation, b.test, source.one_mesh);
  out.motions = builtin_motions(source.seed, m.train, m.validation, m.test);
  out.description = "built-in source, seed " + std::to_string(source.seed) +
                    ", train/validation/test bodies " + text(source.bodies) + ", motions " +
                    text(source.motions) + (source.one_mesh ? ", one mesh" : "");
  out.license = kBuiltinLicense;
  return out;
}

/// The file that holds a split: of a benchmark's folder each has its own.
std::string file_of(const std::string& source, const std::string& split) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(source, ignored)) return source;
  if (split.empty())
    throw InputError(source, "is a folder of splits", "name train.h5, validation.h5 or test.h5");
  return source + "/" + split + ".h5";
}

Corpus file_corpus(const std::string& source, const std::string& split) {
  const std::string path = file_of(source, split);
  Corpus out;
  const Inspection about = inspect(path);
  out.bodies = read_bodies(path, split);
  out.motions = read_motions(path, split);
  out.description = about.provenance;
  out.license = about.license;
  return out;
}

/// Leaves motions of `subject` alone in the split of training.
void keep_subject(Corpus& corpus, const std::string& subject, const std::string& where) {
  std::set<std::string> others;
  bool there = false;
  std::erase_if(corpus.motions, [&](const Motion& motion) {
    if (motion.split != "train") return false;
    const bool kept = motion.subject == subject;
    there = there || kept;
    if (!kept && !motion.subject.empty()) others.insert(motion.subject);
    return !kept;
  });
  if (there) return;
  std::string names;
  for (const std::string& other : others) names += (names.empty() ? "'" : ", '") + other + "'";
  throw InputError(where, "no motion to train on is of subject '" + subject + "'",
                   names.empty() ? "leave data.subject out: no motion names a subject"
                                 : "set data.subject to one of " + names);
}

JointDefinition definition_of(const std::vector<Body>& bodies, const std::string& source) {
  std::vector<NamedDefinition> all;
  for (const Body& body : bodies)
    all.push_back({body.definition, source + ": body '" + body.id + "'"});
  return common_definition(all);
}

/// SHA-256 of pieces, each with its length.
class Sum {
 public:
  void add(const void* data, size_t bytes) {
    const uint64_t length = bytes;
    sha_.add({reinterpret_cast<const char*>(&length), sizeof length});
    sha_.add({static_cast<const char*>(data), bytes});
  }
  template <class T>
  void add(const std::vector<T>& values) {
    add(values.data(), values.size() * sizeof(T));
  }
  void add(const std::string& text) { add(text.data(), text.size()); }
  void add(const Joints& joints) {
    for (const Vec3& x : joints) add(x.data(), sizeof(double) * 3);
  }
  template <class Matrix>
  void add_matrix(const Matrix& m) {
    add(m.data(), static_cast<size_t>(m.size()) * sizeof(*m.data()));
  }
  std::string hex() { return sha_.hex(); }

 private:
  Sha256 sha_;
};

void add(Sum& sum, const Body& body) {
  sum.add(body.id);
  sum.add(body.split);
  sum.add(body.joints);
  sum.add(body.rest.vertices);
  sum.add(body.rest.faces);
  sum.add_matrix(body.weights);
  if (body.blend_shapes) sum.add_matrix(body.blend_shapes->directions);
}

void add(Sum& sum, const Motion& motion) {
  sum.add(motion.id);
  sum.add(motion.subject);
  sum.add(motion.split);
  sum.add(motion.rest);
  for (const auto& frame : motion.global)
    for (const Eigen::Quaternionf& q : frame) sum.add(q.coeffs().data(), sizeof(float) * 4);
  sum.add(motion.hips);
}

}  // namespace

Corpus load_corpus(const CorpusSource& source, const std::string& split) {
  if (!split.empty()) check_split(split);
  const bool builtin = source.source == "builtin";
  Corpus out = builtin ? builtin_corpus(source, split) : file_corpus(source.source, split);
  const std::string where = builtin ? "built-in data" : source.source;
  check_not_empty(out, where, split);
  check_subjects(out, where);
  if (!source.subject.empty() && split != "validation" && split != "test")
    keep_subject(out, source.subject, where);
  out.joints = definition_of(out.bodies, where);
  return out;
}

Corpus subset(const Corpus& corpus, const std::string& split) {
  check_split(split);
  Corpus out;
  for (const Body& body : corpus.bodies)
    if (body.split == split) out.bodies.push_back(body);
  for (const Motion& motion : corpus.motions)
    if (motion.split == split) out.motions.push_back(motion);
  out.description = corpus.description;
  out.license = corpus.license;
  out.joints = corpus.joints;
  check_not_empty(out, "data", split);
  return out;
}

std::vector<std::string> remarks(const CorpusSource& source, const Corpus& train) {
  constexpr size_t kFewBodies = 4;
  std::vector<std::string> out;
  if (source.source == "builtin") return out;
  std::set<std::string> people;
  for (const Motion& motion : train.motions) people.insert(motion.subject);
  if (people.size() == 1 && !people.begin()->empty() && source.subject.empty())
    out.push_back("all motions to train on are of one subject ('" + *people.begin() +
                  "'): what is learned may hold for nobody else");
  if (train.bodies.size() < kFewBodies)
    out.push_back("there are " + std::to_string(train.bodies.size()) +
                  " bodies to train on; more of them can be put in with 'restage data merge'");
  std::error_code ignored;
  if (std::filesystem::is_directory(source.source, ignored)) return out;
  const Inspection about = inspect(source.source);
  const auto test = about.splits.find("test");
  for (const char* what : {"bodies", "motions"})
    if (test == about.splits.end() || !test->second.contains(what))
      out.push_back(source.source + " has no " + what +
                    " of split 'test', so 'restage eval run=' has nothing to measure on; "
                    "'restage data split' deals them");
  return out;
}

std::string checksum(const Corpus& corpus) {
  Sum sum;
  for (const Body& body : corpus.bodies) add(sum, body);
  for (const Motion& motion : corpus.motions) add(sum, motion);
  return sum.hex();
}

std::string content_of_file(const std::string& path) {
  // Another rule of checksum() needs another name here, or old sums are taken for new ones.
  return kept_sum(path, "checksum 2 of ", [&] { return checksum(file_corpus(path, "")); });
}

}  // namespace restage
