#include "experiments/evaluation/mesh_frames.h"

#include <algorithm>
#include <filesystem>

#include "autograd/base/error.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/frames/frame_folder.h"

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

/// All vertices have to be there: which one is left out decides what the others are compared with.
Mesh read_whole(const std::string& file) {
  size_t left_out = 0;
  Mesh mesh = read_frame_mesh(file, left_out);
  if (left_out > 0)
    throw InputError(file, "has " + std::to_string(left_out) + " vertices that are no numbers",
                     "write finite coordinates for all vertices");
  if (mesh.vertices.empty()) throw InputError(file, "has no vertices", "give a mesh");
  return mesh;
}

}  // namespace

MeshFrames::MeshFrames(const std::string& folder) {
  std::vector<std::string> sequences = folders_in(folder);
  const std::vector<std::string> own = frame_files(folder);
  if (!own.empty() && !sequences.empty())
    throw InputError(own.front(), "may be a frame, and is beside folders",
                     "give a folder of meshes, or one folder of meshes for each sequence");
  if (sequences.empty()) sequences = {folder};
  for (const std::string& sequence : sequences) {
    const FrameList list = frame_list(sequence);
    remarks_.insert(remarks_.end(), list.remarks.begin(), list.remarks.end());
    for (size_t i = 1; i < list.numbers.size(); ++i)
      if (list.numbers[i] > list.numbers[i - 1] + 1) {
        remarks_.push_back("frames are missing after " + list.files[i - 1]);
        break;
      }
    const std::vector<std::string>& files = list.files;
    if (files.empty()) throw_no_frames(sequence);
    files_.insert(files_.end(), files.begin(), files.end());
    offset_.push_back(std::ssize(files_));
  }
  const Mesh first = read_whole(files_.front());
  vertex_count_ = std::ssize(first.vertices);
  faces_ = first.faces;
}

void MeshFrames::read(int64_t first, int64_t count, std::vector<double>& out) const {
  out.clear();
  for (int64_t f = first; f < first + count; ++f) {
    const std::string& file = files_[static_cast<size_t>(f)];
    const Mesh mesh = read_whole(file);
    if (std::ssize(mesh.vertices) != vertex_count_)
      throw InputError(file,
                       "has " + std::to_string(mesh.vertices.size()) + " vertices, and " +
                           files_.front() + " has " + std::to_string(vertex_count_),
                       "give frames of one mesh");
    for (const Point& p : mesh.vertices) out.insert(out.end(), {p.x(), p.y(), p.z()});
  }
}

}  // namespace restage
