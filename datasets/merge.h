// Several data files (bodies and motions) as one.
#pragma once

#include <string>
#include <vector>

namespace restage {

struct MergeOptions {
  bool prefix = false;  ///< every id gets its file's name in front: walk.h5's "01" is "walk_01"
};

struct MergeSummary {
  size_t bodies = 0, motions = 0;
  std::string license, provenance;
};

/// Writes the bodies and motions of all `files`, in their order, to `out` (whole or not at all),
/// one at a time. Licences and provenances, with the acknowledgements in them, are joined; what
/// several files say is said once. InputError: fewer than two files, a file that is damaged or
/// holds neither, ids that clash (which, and how to keep both), a subject that is in two splits,
/// `out` among `files`.
MergeSummary merge_data(const std::vector<std::string>& files, const std::string& out,
                        const MergeOptions& options = {});

}  // namespace restage
