#include "datasets/split.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/base/rng.h"
#include "datasets/builtin/bodies.h"
#include "datasets/corpus.h"
#include "datasets/schema.h"
#include "datasets/schema_detail.h"

namespace restage {
namespace {

using Sizes = std::map<std::string, double>;
using Places = std::map<std::string, size_t>;  // split by name

void check_shares(const std::array<double, 3>& shares) {
  double sum = 0;
  bool good = true;
  for (const double share : shares) sum += share, good = good && share >= 0;
  if (!good || std::abs(sum - 1) > 1e-6)
    throw InputError("", "{shares} are no parts of a whole",
                     "give three numbers that add up to 1, such as 0.8,0.1,0.1");
}

/// In an order that the seed decides, each to the split that lacks most of its share.
Places deal(const Sizes& sizes, const std::array<double, 3>& shares, const RngKey& key,
            const Places& fixed) {
  std::vector<std::string> names;
  std::array<double, 3> has{};
  double all = 0;
  for (const auto& [name, size] : sizes) {
    all += size;
    if (const auto at = fixed.find(name); at != fixed.end())
      has[at->second] += size;
    else
      names.push_back(name);
  }
  Rng rng(key);
  for (size_t i = names.size(); i > 1; --i) std::swap(names[i - 1], names[rng.below(i)]);
  Places out = fixed;
  for (const std::string& name : names) {
    size_t to = 0;
    double most = -1e300;
    for (size_t s = 0; s < shares.size(); ++s) {
      if (shares[s] <= 0) continue;
      const double lacks = 1 - has[s] / (shares[s] * all);
      if (lacks > most) most = lacks, to = s;
    }
    out[name] = to;
    has[to] += sizes.at(name);
  }
  return out;
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return std::filesystem::equivalent(a, b, ignored);
}

/// What the file holds, without its values.
class Members {
 public:
  Members(const std::string& path, const h5::File& file, const SplitOptions& options) {
    if (file.has("/bodies") && !same_file(path, options.bodies))
      for (const std::string& id : file.children("/bodies")) bodies[id] = 1;
    if (file.has("/motions")) {
      const double fps = read_fps(file);
      for (const std::string& id : file.children("/motions")) {
        const std::string subject = file.text("/motions/" + id, "subject").value_or("");
        people.insert(subject);
        if (!options.only.empty() &&
            std::find(options.only.begin(), options.only.end(), subject) == options.only.end())
          continue;
        subject_of[id] = options.by_clip   ? (subject.empty() ? id : subject + "/" + id)
                         : subject.empty() ? id
                                           : subject;
        const auto frames =
            static_cast<double>(file.dataset("/motions/" + id + "/hips", {-1, 3}).rows());
        subjects[subject_of[id]] += frames / fps;
      }
    }
    for (const std::string& name : options.only)
      if (!people.contains(name))
        throw InputError(path, "has no person '" + name.substr(0, 40) + "'",
                         "'restage data inspect' lists its people");
    if (bodies.empty() && subjects.empty())
      throw InputError(path, "holds neither bodies nor motions",
                       "give a file that 'restage data build' or 'import' wrote");
  }
  Sizes bodies, subjects;                         // one each; seconds
  std::map<std::string, std::string> subject_of;  // by motion, of those that stay
  std::set<std::string> people;                   // of all motions
};

void need_enough(const std::string& path, const Sizes& of, const char* what, size_t wanted,
                 const char* fix) {
  if (of.empty() || of.size() >= wanted) return;
  throw InputError(path,
                   "holds " + std::to_string(of.size()) + " " + what + " for " +
                       std::to_string(wanted) + " splits",
                   fix);
}

/// Bodies that come along.
struct Guests {
  std::vector<Body> bodies;
  FileInfo info;
};

Guests guests_from(const SplitOptions& options) {
  Guests out;
  if (options.bodies == "builtin") {
    const SplitCounts count = CorpusSource().bodies;
    out.bodies = builtin_bodies(0, count.train, count.validation, count.test);
    out.info = {kBuiltinLicense, "restage's built-in bodies"};
    return out;
  }
  const h5::File file = open_schema_file(options.bodies);
  if (!file.has("/bodies"))
    throw InputError(options.bodies, "holds no bodies", "give a file with some, or builtin");
  SharedShapes shared;
  for (const std::string& id : file.children("/bodies"))
    out.bodies.push_back(read_body(file, id, shared));
  out.info.license = file.text("/", "license").value_or("unknown");
  out.info.provenance = file.text("/", "provenance").value_or("unknown");
  return out;
}

}  // namespace

SplitSummary split_data(const std::string& path, const std::string& out,
                        const SplitOptions& options) {
  check_shares(options.shares);
  check_output(out, {path, options.bodies});
  const h5::File file = open_schema_file(path);
  const Members members(path, file, options);
  const auto wanted = static_cast<size_t>(
      std::count_if(options.shares.begin(), options.shares.end(), [](double x) { return x > 0; }));
  need_enough(path, members.subjects, options.by_clip ? "clips" : "subjects", wanted,
              options.by_clip ? "import more, or give a share of 0"
                              : "import more people, or deal clips with {by} clip (the test then "
                                "meets people that training has seen)");
  const Guests guests = options.bodies.empty() ? Guests() : guests_from(options);
  for (const Body& guest : guests.bodies)
    if (members.bodies.contains(guest.id))
      throw InputError(options.bodies, "has a body '" + guest.id + "', and so has " + path,
                       "rename one of them");
  if (!members.bodies.empty() && guests.bodies.empty() && members.bodies.size() < wanted)
    log_warning(path + " holds " + std::to_string(members.bodies.size()) +
                " bodies, too few for every split; add others with {bodies}");
  const RngKey key = RngKey{options.seed, 0}.fold("data.split");
  const Places subjects = deal(members.subjects, options.shares, key.fold("subjects"), {});
  Places own;  // bodies of subjects
  for (const auto& [body, size] : members.bodies)
    if (const auto at = subjects.find(body); at != subjects.end()) own[body] = at->second;
  const Places bodies = deal(members.bodies, options.shares, key.fold("bodies"), own);

  FileInfo info;
  info.license = file.text("/", "license").value_or("unknown");
  info.provenance = file.text("/", "provenance").value_or("unknown");
  if (!guests.bodies.empty()) {
    info.license = joined_texts({info.license, guests.info.license});
    info.provenance = joined_texts({info.provenance, guests.info.provenance});
  }
  DatasetWriter writer(out, info);
  SharedShapes shared;
  SplitSummary summary;
  // In the order in which the file has them.
  if (!members.bodies.empty())
    for (const std::string& id : file.children("/bodies")) {
      Body body = read_body(file, id, shared);
      body.split = kSplits[bodies.at(id)];
      writer.add(body);
    }
  for (Body guest : guests.bodies) {
    if (const auto at = subjects.find(guest.id); at != subjects.end())
      guest.split = kSplits[at->second];
    writer.add(guest);
    const auto split = std::find(kSplits.begin(), kSplits.end(), guest.split);
    summary[static_cast<size_t>(split - kSplits.begin())].bodies.push_back(guest.id);
  }
  if (!members.subjects.empty())
    for (const std::string& id : file.children("/motions")) {
      const auto subject = members.subject_of.find(id);
      if (subject == members.subject_of.end()) continue;
      Motion motion = read_motion(file, id);
      motion.subject = subject->second;
      motion.split = kSplits[subjects.at(motion.subject)];
      writer.add(motion);
    }
  writer.commit();
  for (const auto& [name, split] : bodies) summary[split].bodies.push_back(name);
  for (const auto& [name, split] : subjects) {
    summary[split].subjects.push_back(name);
    summary[split].seconds += members.subjects.at(name);
  }
  return summary;
}

}  // namespace restage
