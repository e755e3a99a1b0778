// `restage data import`: foreign data into one file of the project's schema.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "datasets/importers/motions/motion_clip.h"
#include "datasets/importers/report.h"
#include "datasets/readers/byte_stream.h"
#include "datasets/schema.h"

namespace restage {

struct ImportOptions {
  /// Of BVH and AMC files; which of them other kinds take: import_options.cpp.
  MotionOptions motion;
  std::string asf;                   ///< skeleton of AMC files; empty: the one beside each
  std::string clip;                  ///< of glTF files: this animation only; empty: all
  std::vector<std::string> without;  ///< of packed clips: import_cmu()
  std::string garment;  ///< dress the bodies in this garment of body/clothes; empty: skin
  std::string license = "unknown";  ///< of all but a data folder, whose licence is known
  /// Regular expression (ECMAScript) whose first group in a file's path below the folder names who
  /// moves; empty: as each kind of file has it.
  std::string subjects;
  std::string body_model;  ///< a SMPL, SMPL-H or SMPL-X model or a folder; AMASS needs it
  /// Of a file with several people's motions this one; empty: all.
  std::string person;
  /// For a body model as source: files of betas (read_betas), or "zeros" for the mean person.
  std::vector<std::string> betas;
  /// Of depth pictures: the camera's numbers or a file of them (read_intrinsics()); empty: the
  /// file's own.
  std::string intrinsics;
  double depth_scale = 0;            ///< metres a unit of depth; 0: by the kind of number
  bool keep_background = false;      ///< floors, walls and furniture too
  uint64_t max_memory = kMaxMemory;  ///< what unpacking one array may take
};

struct ImportSummary {
  size_t bodies = 0, motions = 0, frames = 0;  ///< frames of motions, or of scans
  size_t sequences = 0;                        ///< of scans
  size_t shapes = 0;                      ///< AMASS files left out because they hold a shape only
  std::vector<ImportReport> reports;      ///< one per file or sequence that was used
  std::map<std::string, size_t> ignored;  ///< files of a folder of no kind that was looked for,
                                          ///< by the ends of their names (".txt")
  std::vector<std::string> skipped;       ///< files of a folder that could not be used, and why
};

/// Licence, origin and required acknowledgement of what comes out of a data folder.
FileInfo data_folder_info(bool bodies, bool clips);

/// Whether `source` is a folder, or a file whose name ends like one that import_data() reads.
bool is_importable(const std::string& source);

/// Writes `out` (whole or not at all) from `source`, which is
/// - a folder laid out like the project's data folder: all bodies of body/makehuman.h5 by
///   body/bodies.csv and all clips of cmu/clips30.h5 (one of the two may be absent);
/// - packed clips of CMU (cmu.h), as in such a folder: their motions;
/// - a recording (.bvh, or .amc with its .asf; any may end in .xz): one motion;
/// - a rigged character (.glb, .gltf, .vrm, .fbx): its body and its animations (gltf_character.h);
/// - a tree of folders of recordings and characters, in the order of their names;
/// - an AMASS motion (.npz) or a tree of folders of them, subjects named by folder (amass.h);
/// - what a pose estimator writes (.npz, .npy, .pkl, .pt ...): a motion of each person
///   (estimated.h);
/// - a body model (.npz), giving bodies (smpl.h);
/// - pictures of a depth camera (PNG, NPZ, NPY; depth_frames.h): clouds of the person;
/// - scans: an array, HDF5, mesh or cloud file, or a tree of folders of them (scans.h).
/// An option that a kind of input does not take is an InputError, never ignored.
/// Unusable files of a folder are skipped and listed, and so is a scan sequence of a tree with a
/// frame that is unusable; if nothing is left, the first one's reason is the error.
/// InputError: no such source, nothing usable in it, damaged data. WorkError: disk full.
ImportSummary import_data(const std::string& source, const std::string& out,
                          const ImportOptions& options = {});

}  // namespace restage
