#include "datasets/readers/foreign_kinds.h"

#include "datasets/readers/errors.h"
#include "datasets/readers/text.h"

namespace restage {
namespace {

struct ForeignKind {
  std::initializer_list<std::string_view> endings;
  const char* what;
  const char* mend;
};

const ForeignKind kForeignKinds[] = {
    {{".fbx"}, "is FBX, which is not read", "open it in Blender and export GLB (glTF)"},
    {{".dae", ".blend", ".usd", ".usda", ".usdc", ".usdz", ".max", ".ma", ".mb", ".3ds", ".x3d"},
     "is a scene of a kind that is not read",
     "open it in Blender or its own program and export GLB (glTF)"},
    {{".c3d", ".trc", ".tak"},
     "holds markers, not a skeleton",
     "solve a skeleton in its own program and export BVH"},
    {{".vmd"}, "is a motion of MikuMikuDance", "open it in Blender (MMD Tools) and export BVH"},
    {{".stl", ".off", ".wrl", ".drc", ".las", ".laz", ".e57", ".ptx", ".vtk", ".vtp"},
     "is a cloud or mesh of a kind that is not read",
     "open it in MeshLab, CloudCompare or Open3D and save it as PLY"},
    {{".pkl", ".pickle", ".pt", ".pth"},
     "is a pickle, which can run code and is never read",
     "convert it to plain arrays (docs/data.md shows how)"},
    {{".mat"},
     "is a file of MATLAB",
     "save it in MATLAB with -v7.3, which is HDF5, or the points with numpy.save "
     "(scipy.io.loadmat reads it)"},
    {{".bag", ".db3", ".mcap", ".mkv", ".mp4", ".mov", ".avi"},
     "is a recording of a sensor or a film, not clouds",
     "export its clouds frame by frame, as PLY or PCD"},
    {{".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff"},
     "is a picture, not a cloud",
     "make clouds of depth pictures with the camera's own tools, as PLY"},
};

}  // namespace

void refuse_foreign_kind(const std::string& path) {
  for (const ForeignKind& kind : kForeignKinds)
    if (text::ends_in(path, kind.endings)) throw InputError(path, kind.what, kind.mend);
  if (text::ends_in(path, {".bvh", ".bvh.xz", ".amc", ".amc.xz"}))
    throw InputError(path, "is a recording of a skeleton, not clouds",
                     "restage data import FILE --out M.h5, then restage data perform --bodies B.h5 "
                     "--motions M.h5 --out DIR makes clouds of it, DIR/source.h5");
  if (text::ends_in(path, {".asf", ".asf.xz"}))
    throw InputError(path, "is a skeleton without a motion",
                     "restage data import FILE.amc --asf FILE.asf");
}

}  // namespace restage
