// Files of other kinds: what they are, and what makes one of ours of them.
#pragma once

#include <string>
#include <string_view>

namespace restage {

/// InputError for a file that is known, by its name or its first bytes, to be of a kind that is not
/// read where clouds and meshes are, with the way to convert it. Returns for all others.
void refuse_foreign_kind(const std::string& path);

/// The same by the first bytes alone, whatever the name says: FBX that is called .bvh, a zip
/// archive called .glb. What a name promises is no foreign kind: zip in .npz, xz in .bvh.xz.
/// Returns for a file that is not there.
void refuse_foreign_content(const std::string& path);
/// The same of bytes in memory: the whole file, or at least its first 512 bytes.
void refuse_foreign_content(std::string_view content, const std::string& path);

/// Whether these bytes are not a file but what Git LFS keeps in its place.
bool is_lfs_pointer(std::string_view content);

}  // namespace restage
