#include "experiments/mesh_frames.h"

#include <algorithm>
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "datasets/readers/frame_folder.h"
#include "datasets/readers/mesh_io.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// The folders in a folder, in natural order, but hidden ones.
std::vector<std::string> folders_in(const std::string& folder) {
  std::vector<std::string> out;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && !entry.path().filename().string().starts_with("."))
      out.push_back(entry.path().string());
  std::sort(out.begin(), out.end(), natural_less);
  return out;
}

}  // namespace

MeshFrames::MeshFrames(const std::string& folder) {
  std::vector<std::string> sequences = folders_in(folder);
  if (const bool own = !frame_files(folder).empty(); own && !sequences.empty())
    throw InputError(folder, "holds meshes and folders",
                     "give a folder of meshes, or one folder of meshes for each sequence");
  else if (own || sequences.empty())
    sequences = {folder};
  for (const std::string& sequence : sequences) {
    const FrameList list = frame_list(sequence);
    for (const std::string& remark : list.remarks) log_warning(remark);
    const std::vector<std::string>& files = list.files;
    if (files.empty()) throw_no_frames(sequence);
    files_.insert(files_.end(), files.begin(), files.end());
    offset_.push_back(std::ssize(files_));
  }
  const Mesh first = read_mesh(files_.front());
  vertex_count_ = std::ssize(first.vertices);
  faces_ = first.faces;
}

void MeshFrames::read(int64_t first, int64_t count, std::vector<double>& out) const {
  out.clear();
  for (int64_t f = first; f < first + count; ++f) {
    const std::string& file = files_[static_cast<size_t>(f)];
    const Mesh mesh = read_mesh(file);
    if (std::ssize(mesh.vertices) != vertex_count_)
      throw InputError(file,
                       "has " + std::to_string(mesh.vertices.size()) + " vertices, and " +
                           files_.front() + " has " + std::to_string(vertex_count_),
                       "give frames of one mesh");
    for (const Point& p : mesh.vertices) out.insert(out.end(), {p.x(), p.y(), p.z()});
  }
}

}  // namespace restage
