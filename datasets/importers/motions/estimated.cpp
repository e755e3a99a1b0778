#include "datasets/importers/motions/estimated.h"

#include <algorithm>

#include "datasets/importers/motions/estimated_finder.h"
#include "datasets/readers/arrays/body_parameters.h"
#include "datasets/readers/arrays/nested_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/frame_names.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

using estimated_detail::Found;

bool tells_of_camera(const Npz& file) {
  return std::any_of(std::begin(estimated_detail::kCameraNames),
                     std::end(estimated_detail::kCameraNames),
                     [&](const char* name) { return file.has(name); });
}

/// What a plain archive's names say: WHAM's pose_world, a camera's cam_trans.
ParameterHints hints_of(const Npz& file) {
  const BodyParameters names = body_parameters(file);
  const std::string used = lower_case(cat(names.poses, " ", names.trans));
  ParameterHints out;
  out.world = used.find("world") != std::string::npos;
  out.camera = !out.world && (used.find("cam") != std::string::npos || tells_of_camera(file));
  return out;
}

/// A plain archive's motion; where it numbers its frames and leaves some out, these are filled.
EstimatedMotion plain_motion(const std::shared_ptr<const Npz>& file) {
  EstimatedMotion out{"", "", file, hints_of(*file), true};
  const std::vector<std::string> names = file->names();
  if (std::none_of(names.begin(), names.end(), estimated_detail::numbers_frames)) return out;
  estimated_detail::Arrays arrays;
  for (const std::string& name : names)
    if (is_body_parameter(name) || estimated_detail::numbers_frames(name) ||
        body_parameters(std::vector<std::string>{name}).moves())
      arrays[name] = shared_array(file->array(name));
  estimated_detail::fill_left_out(arrays, out.hints, file->path());
  if (out.hints.missing.empty()) return out;
  const auto gathered = std::make_shared<GatheredArrays>(file->path());
  for (const std::string& name : names)
    gathered->put(name, arrays.count(name) > 0 ? arrays[name] : shared_array(file->array(name)));
  out.arrays = gathered;
  return out;
}

/// Objects in an archive that holds nothing else of use.
class ObjectFault : public InputError {
 public:
  explicit ObjectFault(const InputError& fault) : InputError(fault) {}
};

/// Whether an archive whose top has a motion has it as AMASS has: no axis of people, and a path, or
/// nothing of a camera's that says why there is none.
bool is_plain(const Npz& file) {
  const BodyParameters names = body_parameters(file);
  const bool parts = !names.orient.empty() && !names.body.empty();
  const std::vector<int64_t> shape =
      file.header(parts && names.poses != "poses" ? names.body : names.poses).shape;
  const bool squares = shape.size() > 2 && shape.back() == 3 && shape[shape.size() - 2] == 3;
  if (shape.size() > 4 || (shape.size() == 4 && !squares && shape[1] > 1)) return false;
  if (shape.size() == 3 && shape[2] >= 63 && shape[1] > 1) return false;
  return !names.trans.empty() || !tells_of_camera(file);
}

/// Whether the archive's cloud is one for itself, not vertices that belong to a motion.
bool is_scan(const Npz& file) {
  try {
    const std::optional<CloudArray> cloud = named_cloud(file);
    const std::string name = cloud ? lower_case(cloud->name) : "";
    return cloud && name != "verts" && name != "vertices";
  } catch (const InputError&) {
    return false;  // of a kind that is not read
  }
}

bool has_cloud(const Npz& file) {
  try {
    return find_cloud(file).has_value();
  } catch (const InputError&) {
    return false;
  }
}

std::vector<EstimatedMotion> of_archive(const std::string& path, uint64_t max_memory) {
  const auto file = std::make_shared<const Npz>(path, max_memory);
  const bool top = is_amass_motion(*file);
  if (top && is_plain(*file)) return {plain_motion(file)};
  if (!top && (is_scan(*file) || is_smpl_model(*file))) return {};
  std::optional<InputError> fault;
  std::vector<EstimatedMotion> out =
      estimated_motions(read_nested_arrays(file, max_memory, fault), max_memory);
  if (out.empty() && top) return {plain_motion(file)};
  if (out.empty() && fault && !has_cloud(*file)) throw ObjectFault(*fault);
  return out;
}

}  // namespace

std::vector<EstimatedMotion> estimated_motions(const ValueTree& tree, uint64_t max_memory) {
  estimated_detail::Finder finder(tree, max_memory);
  std::vector<Found> found = finder.find();
  if (found.empty() && finder.fault()) throw *finder.fault();
  if (std::any_of(found.begin(), found.end(), [](const Found& f) { return !f.by_frames; }))
    std::erase_if(found, [](const Found& f) { return f.by_frames; });
  std::stable_sort(found.begin(), found.end(),
                   [](const Found& a, const Found& b) { return a.rank < b.rank; });
  std::vector<EstimatedMotion> out;
  for (Found& one : found)
    if (std::none_of(out.begin(), out.end(),
                     [&](const EstimatedMotion& m) { return m.person == one.motion.person; }))
      out.push_back(std::move(one.motion));
  // What has no name where others have is of one of them, under another name.
  if (out.size() > 1) std::erase_if(out, [](const EstimatedMotion& m) { return m.person.empty(); });
  std::stable_sort(out.begin(), out.end(), [](const EstimatedMotion& a, const EstimatedMotion& b) {
    return natural_less(a.person, b.person);
  });
  return out;
}

bool may_hold_estimates(const std::string& path) {
  return is_npz_name(path) || is_pickle_name(path) ||
         (text::ends_in(path, {".npy"}) && holds_objects(path));
}

bool holds_estimates(const std::string& path, uint64_t max_memory) {
  if (!is_npz_name(path)) return true;
  try {
    return !of_archive(path, max_memory).empty();
  } catch (const ObjectFault&) {
    throw;
  } catch (const InputError&) {
    return false;  // what reads clouds says what is wrong
  }
}

std::vector<EstimatedMotion> read_estimated(const std::string& path, uint64_t max_memory) {
  if (is_npz_name(path)) return of_archive(path, max_memory);
  const ValueTree tree = read_nested_file(path, max_memory);
  std::vector<EstimatedMotion> out = estimated_motions(tree, max_memory);
  if (!out.empty()) return out;
  const bool torch = text::ends_in(path, {".pt", ".pth"});
  const std::string holds = tree.summary();
  const bool vertices = holds.find("vert") != std::string::npos;
  throw InputError(path,
                   cat(torch ? "is a file of torch.save and holds" : "holds",
                       " no motion of a body model (it holds ", holds, ")"),
                   vertices
                       ? "load it in Python and save each frame's vertices with numpy.savez, as "
                         "pred_vertices beside pred_cam_t"
                       : save_as_arrays(path));
}

EstimatedMotion one_person(std::vector<EstimatedMotion> all, const std::string& person,
                           const std::string& path) {
  std::vector<std::string> names;
  for (EstimatedMotion& motion : all) {
    if (motion.person == person && (!person.empty() || all.size() == 1)) return std::move(motion);
    names.push_back(motion.person);
  }
  if (all.size() == 1 && all[0].person.empty() && (person == "0" || person == "1"))
    return std::move(all[0]);
  if (all.size() == 1 && person.empty()) return std::move(all[0]);
  if (all.size() == 1 && all[0].person.empty())
    throw InputError(path, "holds one person, who has no number", "leave {person} out");
  if (person.empty())
    throw InputError(path, cat("holds ", all.size(), " people: ", list_of(names)),
                     "choose one with {person} " + text::quote(names.empty() ? "" : names[0]));
  throw InputError(path, "holds no person " + text::quote(person) + ", but " + list_of(names),
                   "give one of these as {person}");
}

}  // namespace restage
