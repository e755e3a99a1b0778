// The user's body models: which there are, and which one a clip needs.
#include <filesystem>

#include "datasets/importers/import_detail.h"
#include "datasets/importers/motions/amass.h"
#include "datasets/readers/arrays/nested_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/folders.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// By the name of the file or its folder: SMPLX_MALE.npz, female/model.npz.
std::string gender_of(const fs::path& file) {
  for (const fs::path& name : {file.filename(), file.parent_path().filename()})
    for (const char* gender : {"female", "male", "neutral"})  // "female" holds "male"
      if (lower_case(name.string()).find(gender) != std::string::npos) return gender;
  return "";
}

}  // namespace

BodyModels::BodyModels(const std::string& path, uint64_t max_memory)
    : path_(path), max_memory_(max_memory) {
  std::error_code ignored;
  const bool folder = fs::is_directory(path, ignored);
  if (is_pickle_name(path)) refuse_pickle(path);
  std::optional<InputError> first;  // reason why a file is none
  const std::vector<std::string> files =
      folder ? files_below(path, is_npz_name) : std::vector<std::string>{path};
  for (const std::string& file : files) {
    try {
      const Npz archive(file, max_memory);
      if (!is_smpl_model(archive))
        throw InputError(file, "is no body model (it has " + list_of(archive.names()) + ")",
                         "give a SMPL, SMPL-H or SMPL-X model as published (.npz)");
      entries_.push_back({file, gender_of(file), smpl_family(archive)});
    } catch (const InputError& error) {
      if (!folder) throw;  // a folder may hold other things too, such as MANO's hands
      if (!first) first = error;
    }
  }
  if (!entries_.empty()) return;
  const std::string none = "holds no SMPL, SMPL-H or SMPL-X model (.npz)";
  if (first) refuse_all(path, cat(none, " among ", files.size(), " files"), *first);
  if (const auto pickles = files_below(path, is_pickle_name); !pickles.empty())
    refuse_pickle(pickles[0]);
  throw InputError(path, none, "give a model or a folder of them as {body-model}");
}

std::vector<const BodyModels::Entry*> BodyModels::usable(std::optional<SmplFamily> family,
                                                         std::vector<std::string>& remarks) const {
  using enum SmplFamily;
  std::vector<const Entry*> out;
  if (!family) {  // 22 joints: those of any
    for (const SmplFamily any : {smplh, smplx, smpl})
      if (out.empty()) out = of_family(any);
    return out;
  }
  out = of_family(*family);
  if (!out.empty() || *family == smplx) return out;
  const SmplFamily other = *family == smplh ? smpl : smplh;
  out = of_family(other);
  if (!out.empty())
    remarks.push_back(cat("a ", to_string(other), " model stands in for ", to_string(*family),
                          ": their shapes are taken for the same"));
  return out;
}

const SmplModel& BodyModels::find(std::optional<SmplFamily> family, const std::string& gender,
                                  const std::string& clip, std::vector<std::string>& remarks) {
  const std::vector<const Entry*> usable = this->usable(family, remarks);
  if (usable.empty())
    throw InputError(clip,
                     cat("moves a ", to_string(*family), " body, ", path_, " is ",
                         to_string(entries_[0].family), ", whose shapes are others"),
                     cat("give a ", to_string(*family), " model as {body-model}"));
  const std::string wanted = gender.empty() ? "neutral" : gender;
  const Entry* chosen = usable.size() == 1 ? usable[0] : nullptr;
  for (const Entry* entry : usable)
    if (entry->gender == wanted) chosen = entry;
  if (chosen == nullptr)
    throw InputError(clip, "was fitted with a " + wanted + " body, whose model " + path_ + " lacks",
                     "add it, or give one model for all as {body-model}");
  if (chosen->gender != wanted && !chosen->gender.empty())
    remarks.push_back("fitted with a " + wanted + " body, but " + chosen->path + " is " +
                      chosen->gender + ": proportions are only roughly this person's");
  std::unique_ptr<SmplModel>& model = loaded_[chosen->path];
  if (!model) model = std::make_unique<SmplModel>(chosen->path, max_memory_);
  return *model;
}

std::vector<const BodyModels::Entry*> BodyModels::of_family(SmplFamily family) const {
  std::vector<const Entry*> out;
  for (const Entry& entry : entries_)
    if (entry.family == family) out.push_back(&entry);
  return out;
}

}  // namespace restage
