#include "datasets/importers/report.h"

#include "autograd/base/error.h"
#include "datasets/doctor/examine.h"

namespace restage {

void check_handedness(const Joints& rest, bool force, const std::string& path,
                      ImportReport& report) {
  if (!is_mirrored(rest).value_or(false)) return;
  const std::string wrong = std::string(kMirrored) + " (" + kMirroredBecause + ")";
  if (!force)
    throw InputError(path, wrong, std::string(kMirroredFix) + "; --force takes it as it is");
  report.remark(wrong + ": taken as it is");
}

}  // namespace restage
