// import_data() of depth pictures: clouds of the person before one camera.
#include <filesystem>

#include "autograd/base/output_check.h"
#include "datasets/importers/depth/depth_frames.h"
#include "datasets/importers/import_detail.h"
#include "datasets/importers/scans.h"
#include "datasets/readers/depth/grey_png.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/array_frames.h"

namespace restage {
namespace {

/// InputError for files that cannot be depth pictures.
void check_kind(const std::string& source) {
  std::error_code ignored;
  if (std::filesystem::is_directory(source, ignored) || is_png_name(source) ||
      is_array_name(source))
    return;
  throw InputError(source, "is of no kind that holds depth pictures",
                   "give a folder of PNG files of 16 bits, NPZ or NPY, or leave {intrinsics} out");
}

Intrinsics camera_of(const DepthPictures& pictures, const std::string& source,
                     const ImportOptions& options) {
  if (!options.intrinsics.empty()) return read_intrinsics(options.intrinsics);
  if (const auto beside = pictures.intrinsics()) return *beside;
  throw InputError(source, "holds depth pictures, but nothing says what their camera is",
                   "give {intrinsics} FX,FY,CX,CY in pixels, or a file of them (the camera's "
                   "software shows them)");
}

}  // namespace

bool is_depth_source(const std::string& source, const ImportOptions& options) {
  return !options.intrinsics.empty() || holds_depth_pictures(source, options.max_memory);
}

ImportSummary import_depth(const std::string& source, const std::string& out,
                           const ImportOptions& options) {
  check_options({InputKind::depth}, source, options);
  check_kind(source);
  check_fps(options);
  auto pictures = open_depth_pictures(source, options.depth_scale, options.max_memory);
  check_output(out, pictures->files());
  const Intrinsics camera = camera_of(*pictures, source, options);
  DepthFrames frames(std::move(pictures), camera, options.keep_background, options.motion.force);
  ImportSummary summary;
  ImportReport report;
  report.file = source;
  frames.tell(report);
  ScanWriter writer(out, file_info(source, options));
  try {
    summary.frames = static_cast<size_t>(
        import_frames(frames, source, options.motion, frames.states_fps(), writer, report));
  } catch (const InputError&) {
    if (!frames.saw_nobody()) throw;
    throw InputError(source, "shows nobody: all that it shows is floors, walls and what rests",
                     "give {keep-background} to see it all, or other {intrinsics}");
  }
  summary.sequences = 1;
  summary.reports.push_back(std::move(report));
  writer.commit();
  return summary;
}

}  // namespace restage
