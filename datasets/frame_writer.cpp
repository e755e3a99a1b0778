#include "datasets/frame_writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/format.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// Whether a FrameFolderWriter wrote the file. The name alone does not tell: other programs call
/// their frames frame_000001.ply, too.
bool is_our_frame(const fs::path& path) {
  const std::string name = path.filename().string();
  if (name.size() < 16 || !name.starts_with("frame_")) return false;
  const size_t dot = name.size() - 4;
  const bool ply = name.ends_with(".ply");
  if (!ply && !name.ends_with(".obj")) return false;
  std::error_code error;
  if (name.find_first_not_of("0123456789", 6) != dot ||
      fs::symlink_status(path, error).type() != fs::file_type::regular)
    return false;
  std::string head(80, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), std::ssize(head));
  head.resize(static_cast<size_t>(file.gcount()));
  return is_ours(ply ? MeshFormat::ply : MeshFormat::obj, head);
}

/// InputError unless `folder` may be replaced; see FrameFolderWriter.
void check_replaceable(const std::string& folder) {
  std::error_code code;
  const fs::file_type kind = fs::symlink_status(folder, code).type();
  if (kind == fs::file_type::none) throw_unwritable(folder, code.value());
  if (kind == fs::file_type::not_found) return;
  if (!fs::is_directory(folder, code) || fs::is_symlink(folder, code))
    throw InputError(folder, "exists and is not a folder", "give another name");
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code))
    if (!is_our_frame(it->path()))
      throw InputError(folder,
                       "holds a file that restage did not write (" +
                           it->path().filename().string() + ") and would delete",
                       "give a new or an empty folder");
  if (code) throw_unwritable(folder, code.value());
}

/// The folder's name without slashes at the end, if that folder may be replaced.
std::string checked(std::string folder) {
  while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
  if (folder.empty() || folder == "/" || folder == "." || folder == "..")
    throw InputError(folder, "cannot be replaced by a folder of frames", "give a folder's name");
  check_replaceable(folder);
  return folder;
}

void write_plain(const std::string& path, const std::string& bytes, const std::string& target) {
  std::FILE* out = std::fopen(path.c_str(), "wb");
  if (out == nullptr) throw_unwritable(target, errno);
  const size_t written = std::fwrite(bytes.data(), 1, bytes.size(), out);
  const int code = errno;
  if (std::fclose(out) != 0) throw_unwritable(target, errno);
  if (written != bytes.size()) throw_unwritable(target, code);
}

/// Makes sure that all frames are on the disk. One flush of the whole file system takes far less
/// time than one flush for every file.
void flush_folder(const std::string& folder, const std::string& target) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) throw_unwritable(target, errno);
  const int result = ::syncfs(fd);
  const int code = errno;
  ::close(fd);
  if (result != 0) throw_unwritable(target, code);
}

/// Exchanges the names of two folders: in one step if the file system can do that, else in three.
void swap_folders(const std::string& temporary, const std::string& folder) {
  if (::renameat2(AT_FDCWD, temporary.c_str(), AT_FDCWD, folder.c_str(), RENAME_EXCHANGE) == 0)
    return;
  const std::string old = temporary + ".old";
  if (::rename(folder.c_str(), old.c_str()) != 0 ||
      ::rename(temporary.c_str(), folder.c_str()) != 0 ||
      ::rename(old.c_str(), temporary.c_str()) != 0)
    throw_unwritable(folder, errno);
}

}  // namespace

FrameFolderWriter::FrameFolderWriter(std::string folder, std::vector<Triangle> faces,
                                     MeshFormat format)
    : folder_(checked(std::move(folder))),
      temporary_(name_beside(folder_, ".")),
      faces_(std::move(faces)),
      format_(format) {
  std::error_code code;
  fs::remove_all(temporary_.path(), code);
  if (!fs::create_directory(temporary_.path(), code) || code)
    throw_unwritable(folder_, code ? code.value() : EEXIST);
}

FrameFolderWriter::FrameFolderWriter(std::string folder, MeshFormat format, Make made)
    : FrameFolderWriter(std::move(folder), {}, format) {
  made_ = std::move(made);
}

void FrameFolderWriter::push(const Points& vertices, const std::vector<Triangle>& faces) {
  const std::string name = format("/frame_%06zu.%s", frames_, extension(format_));
  if (!vertices.empty() || !faces.empty()) check_mesh(folder_ + name, vertices, faces);
  write_plain(temporary_.path() + name,
              made_ ? made_(vertices) : mesh_bytes(format_, vertices, faces), folder_);
  ++frames_;
}

void FrameFolderWriter::commit() {
  flush_folder(temporary_.path(), folder_);
  check_replaceable(folder_);
  // rename() replaces a folder that is empty. A folder that holds frames of an earlier run changes
  // places with the new one and is then removed.
  if (::rename(temporary_.path().c_str(), folder_.c_str()) != 0) {
    if (errno != ENOTEMPTY && errno != EEXIST) throw_unwritable(folder_, errno);
    swap_folders(temporary_.path(), folder_);
    std::error_code ignored;
    fs::remove_all(temporary_.path(), ignored);
  }
  temporary_.keep();
  const fs::path parent = fs::path(folder_).parent_path();
  flush_folder(parent.empty() ? "." : parent.string(), folder_);
}

}  // namespace restage
