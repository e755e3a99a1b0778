#include "datasets/readers/foreign_kinds.h"

#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/byte_stream.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

/// A kind of file by its name or its first bytes.
struct ForeignKind {
  std::initializer_list<std::string_view> endings;  ///< of names
  std::initializer_list<std::string_view> starts;   ///< of contents
  const char* what;
  const char* mend;
};

using namespace std::string_view_literals;

const ForeignKind kForeignKinds[] = {
    // Text of FBX begins with a comment. FBX that is called so is read
    // (datasets/readers/fbx/fbx.h).
    {{},
     {"Kaydara FBX Binary", "; FBX"},
     "is FBX under another name",
     "rename it to .fbx, or open it in Blender and export GLB (glTF)"},
    {{".blend", ".blend1"},
     {"BLENDER"},
     "is a file of Blender, which is not read",
     "open it in Blender and export GLB (File > Export > glTF 2.0)"},
    {{".usd", ".usda", ".usdc", ".usdz"},
     {"#usda", "PXR-USDC"},
     "is USD, which is not read",
     "import it into Blender (File > Import > Universal Scene Description) and export GLB (glTF)"},
    {{".max"},
     {"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1"sv},
     "is a scene of 3ds Max, which is not read",
     "export FBX there, open this in Blender and export GLB (glTF)"},
    {{".ma", ".mb"},
     {"//Maya ASCII", "FOR4", "FOR8"},
     "is a scene of Maya, which is not read",
     "export FBX there, open this in Blender and export GLB (glTF)"},
    {{".pmx", ".pmd"},
     {"PMX ", "Pmd"},
     "is a model of MikuMikuDance, which is not read",
     "open it in Blender with MMD Tools and export GLB (glTF)"},
    {{".vmd"},
     {"Vocaloid Motion Data"},
     "is a motion of MikuMikuDance, which is not read",
     "open it in Blender with MMD Tools and export BVH"},
    {{".dae"}, {}, "is COLLADA, which is not read", "open it in Blender and export GLB (glTF)"},
    {{".3ds", ".x3d", ".c4d", ".lwo", ".abc", ".uasset", ".unitypackage", ".skp", ".ztl"},
     {},
     "is a scene of a kind that is not read",
     "open it in Blender or its own program and export GLB (glTF)"},
    {{".mvnx"},
     {},
     "is a recording of Xsens MVN, which is not read",
     "export BVH or FBX there (File > Export)"},
    {{".mot", ".sto"},
     {},
     "holds angles of an OpenSim model, which is not read",
     "give the joints' positions (TRC), or export BVH"},
    {{".c3d", ".trc", ".tak"},
     {},
     "holds markers, not a skeleton",
     "solve a skeleton in its own program and export BVH"},
    {{".stl", ".off", ".wrl", ".drc", ".las", ".laz", ".e57", ".ptx", ".vtk", ".vtp", ".splat"},
     {"solid ", "OFF\n", "OFF\r", "#VRML", "DRACO", "LASF", "ASTM-E57", "# vtk DataFile"},
     "is a cloud or mesh of a kind that is not read",
     "open it in MeshLab, CloudCompare or Open3D and save it as PLY"},
    {{".pkl", ".pickle", ".pt", ".pth", ".joblib"},
     {"\x80\x02"sv, "\x80\x03"sv, "\x80\x04"sv, "\x80\x05"sv},
     "is a pickle, of which only motions of a body model are read",
     "convert clouds to plain arrays (docs/formats.md shows how)"},
    {{".ckpt"}, {}, "holds a network's weights", "give what the network has written"},
    {{".r3d"},
     {},
     "is a recording of Record3D, which is not read",
     "export its point clouds there (PLY)"},
    {{".sog", ".spz", ".ksplat"},
     {},
     "is a Gaussian splat of a kind that is not read",
     "save it as uncompressed PLY, as SuperSplat does"},
    {{".mat"},
     {"MATLAB 5.0 MAT-file"},
     "is a file of MATLAB",
     "save it in MATLAB with -v7.3, which is HDF5, or the points with numpy.save "
     "(scipy.io.loadmat reads it)"},
    {{".bag", ".db3", ".mcap", ".mkv", ".mp4", ".mov", ".avi"},
     {"#ROSBAG", "SQLite format 3", "\x89MCAP"sv, "\x1A\x45\xDF\xA3"sv},
     "is a recording of a sensor or a film, not clouds",
     "export its clouds frame by frame, as PLY or PCD"},
    {{".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff"},
     {"\x89PNG"sv, "\xFF\xD8\xFF"sv, "\x76\x2F\x31\x01"sv, "II*\0"sv, "MM\0*"sv},
     "is a picture, not a cloud",
     "restage data import FOLDER --intrinsics FX,FY,CX,CY makes clouds of depth pictures (PNG of "
     "16 bits)"},
    {{},
     {"<!DOCTYPE html", "<!doctype html", "<html", "<HTML"},
     "is a web page, not what its name says",
     "download the file itself"},
};

/// Archives, and what unpacks them.
const ForeignKind kArchives[] = {
    {{".zip"}, {"PK\x03\x04"sv, "PK\x05\x06"sv}, "is a zip archive", "unzip"},
    {{".tar", ".tar.gz", ".tgz", ".tar.xz", ".tar.bz2"}, {}, "is a tar archive", "tar xf"},
    {{".gz"}, {"\x1F\x8B"sv}, "is packed with gzip", "gunzip"},
    {{".7z"}, {"7z\xBC\xAF\x27\x1C"sv}, "is a 7z archive", "7z x"},
    {{".rar"}, {"Rar!\x1A\x07"sv}, "is a RAR archive", "unrar x"},
    {{".bz2"}, {"BZh"}, "is packed with bzip2", "bunzip2"},
    {{".zst"}, {"\x28\xB5\x2F\xFD"sv}, "is packed with Zstandard", "unzstd"},
    {{".xz"}, {"\xFD\x37zXZ"sv}, "is packed with xz", "unxz"},
};

constexpr uint64_t kFirstBytes = 512;  // bytes that tell every kind

bool is_packed_text_name(const std::string& path) {
  return text::ends_in(path, {".bvh.xz", ".amc.xz", ".asf.xz"});
}

/// What has a name that says more of it than that it is packed.
bool is_named_kind(const std::string& path) {
  return text::ends_in(path, {".r3d", ".sog", ".spz", ".ksplat", ".ckpt"});
}

/// Zip in .npz and .usdz, xz in .bvh.xz.
bool is_promised(const ForeignKind& archive, const std::string& path) {
  return (archive.what == kArchives[0].what && text::ends_in(path, {".npz", ".usdz"})) ||
         is_packed_text_name(path);
}

bool is_fbx_in_place(const ForeignKind& kind, const std::string& path) {
  return kind.what == kForeignKinds[0].what && text::ends_in(path, {".fbx"});
}

[[noreturn]] void refuse_archive(const ForeignKind& kind, const std::string& path) {
  throw InputError(path, cat(kind.what, ", which is not opened"),
                   cat("unpack it (", kind.mend, " FILE) and give what was inside"));
}

bool starts_with_any(std::string_view content, const ForeignKind& kind) {
  for (const std::string_view start : kind.starts)
    if (content.starts_with(start)) return true;
  return false;
}

/// An XML document is COLLADA if it says so near its start.
bool is_collada(std::string_view content) {
  return content.starts_with("<?xml") &&
         content.substr(0, kFirstBytes).find("<COLLADA") != content.npos;
}

}  // namespace

bool is_lfs_pointer(std::string_view content) {
  return content.starts_with("version https://git-lfs.github.com/spec/");
}

void refuse_foreign_content(std::string_view content, const std::string& path) {
  for (const ForeignKind& kind : kForeignKinds)
    if (is_named_kind(path) && text::ends_in(path, kind.endings))
      throw InputError(path, kind.what, kind.mend);
  if (is_lfs_pointer(content))
    throw InputError(path, "is a Git LFS pointer, not the file itself", "run git lfs pull");
  const std::string_view bare = content.starts_with("\xEF\xBB\xBF") ? content.substr(3) : content;
  for (const ForeignKind& kind : kForeignKinds)
    if (starts_with_any(bare, kind) && !is_fbx_in_place(kind, path))
      throw InputError(path, kind.what, kind.mend);
  if (is_collada(bare))
    throw InputError(path, "is COLLADA, which is not read",
                     "open it in Blender and export GLB (glTF)");
  for (const ForeignKind& kind : kArchives)
    if (starts_with_any(content, kind) && !is_promised(kind, path)) refuse_archive(kind, path);
  if (content.size() >= 262 && content.substr(257, 5) == "ustar")
    refuse_archive(kArchives[1], path);
}

void refuse_foreign_content(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return;
  FileStream file(path);
  const std::vector<char> head = file.take(std::min<uint64_t>(kFirstBytes, file.size()));
  refuse_foreign_content({head.data(), head.size()}, path);
}

void refuse_foreign_kind(const std::string& path) {
  for (const ForeignKind& kind : kForeignKinds)
    if (text::ends_in(path, kind.endings)) throw InputError(path, kind.what, kind.mend);
  for (const ForeignKind& kind : kArchives)
    if (text::ends_in(path, kind.endings) && !is_packed_text_name(path)) refuse_archive(kind, path);
  if (text::ends_in(path, {".bvh", ".bvh.xz", ".amc", ".amc.xz"}))
    throw InputError(path, "is a recording of a skeleton, not clouds",
                     "restage data import FILE --out M.h5, then restage data perform --bodies B.h5 "
                     "--motions M.h5 --out DIR makes clouds of it, DIR/source.h5");
  if (text::ends_in(path, {".asf", ".asf.xz"}))
    throw InputError(path, "is a skeleton without a motion",
                     "restage data import FILE.amc --asf FILE.asf");
  refuse_foreign_content(path);
}

}  // namespace restage
