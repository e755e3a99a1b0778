// Which files of a folder are the frames of a sequence.
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/arrays/npz.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/camera_names.h"
#include "datasets/readers/frames/folders.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

std::string ending_of(const std::string& path) {
  return lower_case(fs::path(path).extension().string());
}

/// Of one frame in several kinds of files the first of these is taken, unless there are more files
/// of another.
constexpr std::string_view kEndings[] = {".ply", ".obj",    ".pcd",  ".glb", ".gltf", ".vrm",
                                         ".xyz", ".xyzrgb", ".xyzn", ".pts", ".asc",  ".npz",
                                         ".npy", ".csv",    ".txt",  ".bin"};

size_t rank_of(const std::string& ending) {
  return static_cast<size_t>(std::find(std::begin(kEndings), std::end(kEndings), ending) -
                             std::begin(kEndings));
}

/// Files of a folder that could be frames, in no order. Texts (.txt, .csv) only where there is
/// nothing else, and if they look like tables of points.
std::vector<std::string> candidates_in(const std::string& folder) {
  std::vector<std::string> out, texts;
  std::error_code error;
  for (fs::directory_iterator item(folder, error), end; !error && item != end;
       item.increment(error)) {
    const std::string path = item->path().string();
    std::error_code ignored;
    if (item->path().filename().string()[0] == '.' || item->is_directory(ignored)) continue;
    if (is_mesh_name(path) || is_cloud_name(path) || is_array_name(path)) out.push_back(path);
    if (may_be_cloud_name(path)) texts.push_back(path);
  }
  if (error) throw InputError(folder, "cannot be read (" + error.message() + ")", "check the path");
  if (out.empty())
    std::copy_if(texts.begin(), texts.end(), std::back_inserter(out), is_cloud_by_content);
  return out;
}

/// f1.ply and f1.PLY.
void refuse_capitals(const std::string& folder, const std::vector<std::string>& files) {
  std::map<std::string, std::string> seen;
  for (const std::string& file : files) {
    const std::string name = fs::path(file).filename().string();
    const auto [at, is_new] = seen.try_emplace(lower_case(name), name);
    if (!is_new)
      throw InputError(
          folder,
          cat("holds one frame twice: ", text::quote(std::min(name, at->second)), " and ",
              text::quote(std::max(name, at->second)), " differ in capital letters alone"),
          "keep one of the two, or give the frames other numbers");
  }
}

/// Of files of one name with several endings only one, with a remark.
std::vector<std::string> one_of_each(const std::vector<std::string>& files,
                                     std::vector<std::string>& remarks) {
  std::map<std::string, size_t> count;  // of an ending
  std::map<std::string, std::vector<std::string>> by_stem;
  for (const std::string& file : files) {
    ++count[ending_of(file)];
    by_stem[fs::path(file).stem().string()].push_back(file);
  }
  const auto better = [&](const std::string& a, const std::string& b) {
    const std::string x = ending_of(a), y = ending_of(b);
    if (is_array_name(a) != is_array_name(b)) return is_array_name(b);
    return count[x] != count[y] ? count[x] > count[y] : rank_of(x) < rank_of(y);
  };
  std::map<std::string, size_t> twice;
  std::vector<std::string> out;
  for (auto& [stem, same] : by_stem) {
    std::sort(same.begin(), same.end(), better);
    out.push_back(same[0]);
    for (size_t i = 1; i < same.size(); ++i) ++twice[ending_of(same[i])];
  }
  for (const auto& [ending, n] : twice)
    remarks.push_back(cat("left out ", counted(n, ending + " file"),
                          ": the same frames are there as another kind of file"));
  return out;
}

/// The frames among these files: meshes and clouds before arrays, which beside them are mostly
/// something else, unless only the arrays are a series.
FrameList frames_among(const std::string& folder, const std::vector<std::string>& files) {
  refuse_capitals(folder, files);
  std::vector<std::string> remarks, meshes, arrays;
  for (const std::string& file : one_of_each(files, remarks))
    (is_array_name(file) ? arrays : meshes).push_back(file);
  const bool series_of_arrays = meshes.size() == 1 && arrays.size() > 1;
  FrameList out = order_frames(meshes.empty() || series_of_arrays ? arrays : meshes, folder);
  const std::vector<std::string>& others = series_of_arrays ? meshes : arrays;
  if (!meshes.empty() && !others.empty())
    out.remarks.push_back(cat("left out ", counted(others.size(), ending_of(others[0]) + " file"),
                              " beside the ", out.files.size(), " frames"));
  out.remarks.insert(out.remarks.begin(), remarks.begin(), remarks.end());
  return out;
}

/// InputError if a fourth of the files or more are pointers of Git LFS.
void refuse_pointers(const FrameList& list, const std::string& folder) {
  constexpr uintmax_t kPointerBytes = 1024;
  std::vector<std::string> pointers;
  for (const std::string& file : list.files) {
    std::error_code error;
    const uintmax_t size = fs::file_size(file, error);
    if (!error && size < kPointerBytes && is_lfs_pointer(read_file(file))) pointers.push_back(file);
  }
  if (pointers.empty() || 4 * pointers.size() < list.files.size()) return;
  throw InputError(folder,
                   cat(pointers.size(), " of ", list.files.size(),
                       " frames are Git LFS pointers, not the files themselves, such as ",
                       fs::path(pointers[0]).filename().string()),
                   "run git lfs pull");
}

std::vector<std::string> folders_in(const std::string& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (fs::directory_iterator item(folder, error), end; !error && item != end;
       item.increment(error)) {
    std::error_code ignored;
    if (item->path().filename().string()[0] != '.' && item->is_directory(ignored))
      out.push_back(item->path().string());
  }
  std::sort(out.begin(), out.end(), natural_less);
  return out;
}

// ---- a folder a frame --------------------------------------------------------------------------

/// Files by what they are called below their frame's folder, with # for digits: "out/mesh_#.ply".
using FilesByName = std::map<std::string, std::vector<std::string>>;

std::string name_below(const std::string& folder, const std::string& file) {
  std::string out;
  for (const char c : file.substr(folder.size() + 1))
    if (const bool digit = c >= '0' && c <= '9'; !digit || !out.ends_with('#'))
      out += digit ? '#' : c;
  return out;
}

/// All that could be the frame of each folder. Texts only where no folder has anything else.
std::vector<FilesByName> files_of(const std::vector<std::string>& folders) {
  std::vector<std::vector<std::string>> all;
  bool only_texts = true;
  for (const std::string& folder : folders) {
    std::vector<std::string>& files = all.emplace_back();
    for (const std::string& inner : folders_below(folder))
      for (const std::string& file : candidates_in(inner)) files.push_back(file);
    only_texts = only_texts && std::all_of(files.begin(), files.end(), may_be_cloud_name);
  }
  std::vector<FilesByName> out;
  for (size_t i = 0; i < folders.size(); ++i) {
    FilesByName& names = out.emplace_back();
    for (const std::string& file : all[i])
      if (only_texts || !may_be_cloud_name(file))
        names[name_below(folders[i], file)].push_back(file);
  }
  return out;
}

/// Whether most of these folders hold series of files: each is a sequence by itself.
bool are_sequences(const std::vector<FilesByName>& folders) {
  size_t sequences = 0, filled = 0;
  for (const FilesByName& names : folders) {
    filled += !names.empty();
    sequences += std::any_of(names.begin(), names.end(),
                             [](const auto& name) { return name.second.size() > 1; });
  }
  return 2 * sequences > filled;
}

std::string without_ending(const std::string& name) {
  return name.substr(0, name.size() - fs::path(name).extension().string().size());
}

/// Names of the same stem ("mesh.ply", "mesh.obj"), and in how many folders one of them is.
struct Stem {
  std::map<std::string, size_t> names;  ///< and how many folders have each
  size_t folders = 0;
  bool mesh = false;  ///< or a cloud; else arrays
};

std::map<std::string, Stem> stems_of(const std::vector<FilesByName>& folders) {
  std::map<std::string, Stem> out;
  for (const FilesByName& names : folders) {
    std::set<std::string> here;
    for (const auto& [name, files] : names) {
      Stem& stem = out[without_ending(name)];
      ++stem.names[name];
      stem.mesh = stem.mesh || !is_array_name(name);
      here.insert(without_ending(name));
    }
    for (const std::string& stem : here) ++out[stem].folders;
  }
  return out;
}

/// The stem that is every folder's frame: the only one that all of them hold; if there is none, the
/// only one that most of them hold. nullptr: there is none. InputError if several meshes or clouds
/// may be. Arrays count where no mesh or cloud
/// does.
const Stem* frame_stem(const std::map<std::string, Stem>& stems, size_t filled,
                       const std::string& folder) {
  for (const bool mesh : {true, false})
    for (const bool all : {true, false}) {
      std::vector<const Stem*> found;
      for (const auto& [name, stem] : stems)
        if (stem.mesh == mesh && (all ? stem.folders == filled : 2 * stem.folders > filled))
          found.push_back(&stem);
      if (found.size() == 1) return found[0];
      if (found.size() < 2 || !mesh) continue;
      const std::string a = found[0]->names.begin()->first, b = found[1]->names.begin()->first;
      throw InputError(folder,
                       cat("holds a folder a frame, and in each several files that may be the "
                           "frame, such as ",
                           text::quote(a), " and ", text::quote(b)),
                       cat("leave one of them in each folder, or copy the right ones into one "
                           "folder as 0000.ply, 0001.ply ...; if they are of several cameras, ",
                           kFuseCameras));
    }
  return nullptr;
}

/// Of its names that are there the one that most folders have; empty if none is there.
template <class IsThere>
std::string best_name(const Stem& stem, const IsThere& is_there) {
  std::string best;
  for (const auto& [name, count] : stem.names) {
    if (!is_there(name)) continue;
    const size_t most = best.empty() ? 0 : stem.names.at(best);
    if (count > most || (count == most && rank_of(ending_of(name)) < rank_of(ending_of(best))))
      best = name;
  }
  return best;
}

/// Arrays may be whole sequences.
bool is_sequence(const std::string& file) {
  if (!is_array_name(file)) return false;
  try {
    const std::optional<CloudArray> cloud = find_cloud(file);
    return !cloud || cloud->axes.sequence;
  } catch (const InputError&) {
    return false;  // said when its turn comes
  }
}

/// Whether a file below a frame's folder is of one of several cameras: cam0.ply, cam0/cloud.ply,
/// but not cam0/0001.ply, which is a frame.
bool is_of_camera(const std::string& folder, const std::string& file) {
  const fs::path below = fs::path(file).lexically_relative(folder).replace_extension();
  const std::string name = below.filename().string();
  if (is_camera_name(name)) return true;
  return name.find_first_of("0123456789") == std::string::npos &&
         std::any_of(below.begin(), below.end(),
                     [](const fs::path& part) { return is_camera_name(part.string()); });
}

/// InputError if each of these folders, as far as it holds anything, holds clouds of several
/// cameras.
void refuse_cameras_a_frame(const std::vector<std::string>& folders,
                            const std::vector<FilesByName>& files, const std::string& folder) {
  constexpr size_t kMostCameras = 16;
  std::vector<std::string> example;
  for (size_t i = 0; i < folders.size(); ++i) {
    std::vector<std::string> here;
    for (const auto& [name, same] : files[i]) here.insert(here.end(), same.begin(), same.end());
    if (here.empty()) continue;
    std::sort(here.begin(), here.end(), natural_less);
    const bool cameras = here.size() > 1 && here.size() <= kMostCameras &&
                         std::all_of(here.begin(), here.end(), [&](const std::string& file) {
                           return is_of_camera(folders[i], file);
                         });
    if (!cameras) return;
    if (example.empty()) example = here;
  }
  if (example.empty()) return;
  const auto shown = [&](const std::string& file) {
    return text::quote(fs::path(file).lexically_relative(folder).string());
  };
  throw InputError(
      folder,
      cat("holds a folder a frame, and in each the clouds of several cameras, such as ",
          shown(example[0]), " and ", shown(example[1])),
      kFuseCameras);
}

/// InputError for a folder that has something else in the place of its frame, which none of the
/// folders with a frame has beside it.
void refuse_other_name(const std::string& folder, const FilesByName& files,
                       const std::set<std::string>& companions, const Stem& chosen) {
  for (const auto& [name, same] : files)
    if (companions.count(without_ending(name)) == 0)
      throw InputError(
          folder,
          cat("holds ", text::quote(fs::path(same[0]).lexically_relative(folder).string()),
              " where the other folders have ",
              text::quote(best_name(chosen, [](const std::string&) { return true; }))),
          "give it the name that the others have, or take it out if this frame is missing");
}

/// The frame's file; empty if the folder has none.
std::string frame_in(const FilesByName& files, const Stem& stem) {
  const std::string name =
      best_name(stem, [&](const std::string& each) { return files.count(each) > 0; });
  return name.empty() ? "" : files.at(name)[0];
}

/// What was taken of the folders, and what was not.
void tell_choice(const std::map<std::string, Stem>& stems, const Stem& chosen, size_t lacking,
                 FrameList& out) {
  const std::string taken = best_name(chosen, [](const std::string&) { return true; });
  std::vector<std::string> others;
  for (const auto& [key, stem] : stems)
    for (const auto& [name, count] : stem.names)
      if (name != taken) others.push_back(name);
  out.remarks.insert(
      out.remarks.begin(),
      cat("a folder a frame: ", out.files.size(), " folders are one sequence",
          others.empty() ? ""
                         : cat("; ", text::quote(taken), " is taken of each, and left out are ",
                               list_of(others))));
  if (lacking > 0)
    out.remarks.push_back(cat(counted(lacking, "folder holds no ", "folders hold no "),
                              text::quote(taken), ": ",
                              lacking == 1 ? "a frame without points" : "frames without points"));
}

}  // namespace

FrameList frame_list(const std::string& folder) {
  FrameList out = frames_among(folder, candidates_in(folder));
  refuse_pointers(out, folder);
  return out;
}

FrameList folder_a_frame(const std::string& folder) {
  const std::vector<std::string> folders = folders_in(folder);
  if (folders.size() < 2) return {};
  const std::vector<FilesByName> all = files_of(folders);
  refuse_cameras_a_frame(folders, all, folder);
  if (are_sequences(all)) return {};
  FrameList out = order_folders(folders, folder);
  const std::vector<FilesByName> files = files_of(out.files);
  const auto filled = static_cast<size_t>(std::count_if(
      files.begin(), files.end(), [](const FilesByName& names) { return !names.empty(); }));
  if (filled < 2 || are_sequences(files)) return {};
  const std::map<std::string, Stem> stems = stems_of(files);
  const Stem* stem = frame_stem(stems, filled, folder);
  if (stem == nullptr || 2 * stem->folders <= out.files.size()) return {};
  size_t lacking = 0;
  std::set<std::string> companions;  // of the frame's file
  for (const FilesByName& names : files)
    if (!frame_in(names, *stem).empty())
      for (const auto& [name, same] : names) companions.insert(without_ending(name));
  for (size_t i = 0; i < out.files.size(); ++i) {
    const std::string file = frame_in(files[i], *stem);
    if (file.empty()) refuse_other_name(out.files[i], files[i], companions, *stem);
    lacking += file.empty();
    if (lacking == i && is_sequence(file)) return {};  // the first that is there
    out.files[i] = file.empty() ? out.files[i] + "/" : file;
  }
  tell_choice(stems, *stem, lacking, out);
  std::vector<std::string> beside;
  for (const std::string& file : frame_files(folder))
    beside.push_back(fs::path(file).filename().string());
  if (!beside.empty())
    out.remarks.push_back(cat("left out ", list_of(beside), ": beside the folders of the frames"));
  refuse_pointers(out, folder);
  return out;
}

FrameList frames_in(const std::string& folder) {
  FrameList files = frame_list(folder);
  if (files.is_series) return files;
  FrameList out = folder_a_frame(folder);
  return out.files.empty() ? files : out;
}

std::vector<std::string> frame_files(const std::string& folder) {
  std::vector<std::string> out = candidates_in(folder);
  std::sort(out.begin(), out.end(), natural_less);
  return out;
}

void throw_no_frames(const std::string& path) {
  std::vector<std::string> with_frames;
  for (const std::string& folder : folders_in(path))
    if (!candidates_in(folder).empty()) with_frames.push_back(folder);
  if (!with_frames.empty())
    throw InputError(
        path, cat("holds no frames itself, but ", with_frames.size(), " of its folders do"),
        cat("give one sequence, such as ", with_frames[0],
            " (if each folder is one moment, seen by several cameras: ", kFuseCameras, ")"));
  for (const std::string& file : files_below(path)) refuse_foreign_kind(file);
  throw InputError(path,
                   "holds no PLY, OBJ or glTF files, no clouds (PCD, XYZ) and no arrays (NPY, NPZ)",
                   "give a folder of numbered frames");
}

}  // namespace restage
