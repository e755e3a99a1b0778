// Motions of a SMPL, SMPL-H or SMPL-X body (.npz): AMASS's (poses and trans, z up, at the rate of
// the recording), and those of estimators, which give the same numbers other names and shapes
// (body_parameters.h, body_rotations.h) and look at the world as a camera does. Skeletons come from
// the user's own body model (smpl.h), which no such file holds. Source: Mahmood et al. 2019; the
// SMPL-X files are of the 2023 release ("stageii").
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "datasets/importers/bodies/smpl.h"
#include "datasets/importers/motions/motion_clip.h"

namespace restage {

/// The body models at hand: one file for all, or a folder in which each is found by its family and
/// by "female", "male" or "neutral" in its name or its folder's (smplh/female/model.npz,
/// SMPLX_MALE.npz).
class BodyModels {
 public:
  /// What is no such model in a folder is left out. InputError: nothing there, no model in it.
  explicit BodyModels(const std::string& path, uint64_t max_memory = kMaxMemory);

  /// The model for a clip, loaded once; a single file stands for every gender. `family` nothing:
  /// the clip fits any, and the only one at hand is taken, else SMPL-H, SMPL-X, SMPL in this order.
  /// SMPL and SMPL-H stand in for each other, never for SMPL-X, whose shapes are others. What does
  /// not quite fit is remarked. InputError (about `clip`) if none fits.
  const SmplModel& find(std::optional<SmplFamily> family, const std::string& gender,
                        const std::string& clip, std::vector<std::string>& remarks);

 private:
  struct Entry {
    std::string path, gender;  ///< empty gender: the path does not say
    SmplFamily family;
  };
  std::vector<const Entry*> of_family(SmplFamily family) const;
  std::vector<const Entry*> usable(std::optional<SmplFamily> family,
                                   std::vector<std::string>& remarks) const;

  std::string path_;
  uint64_t max_memory_;
  std::vector<Entry> entries_;
  std::map<std::string, std::unique_ptr<SmplModel>> loaded_;
};

/// What is known of a motion from the place where it was found.
struct ParameterHints {
  bool world = false;   ///< in a world, y up unless it shows another axis
  bool camera = false;  ///< as a camera sees it: y down
  /// Frames without this person, where another's numbers stand: interpolated.
  std::vector<size_t> missing = {};
  std::vector<std::string> remarks = {};
};

/// Rotations of joints make a motion, unless there is a scan, too (CAPE's v_posed); the vertices
/// that an estimator gives beside its motion (verts) are none. `betas` without rotations are a
/// shape only (shape.npz, neutral_stagei.npz).
bool is_amass_motion(const Npz& file);
bool is_amass_shape(const Npz& file);

/// One clip at 30 fps, and what was done to it. Of the options the rate, the names and the up axis
/// count (automatic: in AMASS's layout z, or y or -y where the root turns a standing body's up
/// there; in others where the head is on average). A file of an estimator
/// that says no rate is taken for 30 fps, with a remark. InputError: another layout, no
/// translation, no rate, not finite, no model that fits. `fingers`: gets those of SMPL-H and
/// SMPL-X, one a frame; stays empty where the file has none.
Motion import_amass(const ArraySource& file, BodyModels& models, const MotionOptions& options,
                    ImportReport& report, std::vector<FingerTurns>* fingers = nullptr,
                    const ParameterHints& hints = {});
/// The same turns and path by another skeleton, where no body model is at hand: `like` (rest
/// joints, T-pose) with an adult's legs, which is remarked.
Motion import_amass(const ArraySource& file, const Joints& like, const MotionOptions& options,
                    ImportReport& report, std::vector<FingerTurns>* fingers = nullptr,
                    const ParameterHints& hints = {});

}  // namespace restage
