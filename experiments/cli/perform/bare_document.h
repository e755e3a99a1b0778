// The document of a target without bones, which keeps everything that it holds and gets a skeleton
// of ours: a glTF or FBX file, or an OBJ or PLY file that has more than its shape.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "autograd/base/log.h"
#include "datasets/characters/gltf_document.h"
#include "datasets/characters/mesh_document.h"
#include "datasets/readers/gltf/gltf_blends.h"

namespace restage::cli {

class BareDocument {
 public:
  /// `vertices`: how many were read from the target. `small`: as mesh_document().
  BareDocument(const std::string& target, size_t vertices, bool small = false) {
    if (is_gltf_name(target)) {
      content_ = read_gltf_bytes(target);
    } else if (std::optional<MeshDocument> made = mesh_document(target, vertices, small)) {
      content_ = std::move(made->glb);
      vertex_ = std::move(made->vertex);
      for (const std::string& remark : made->remarks) remarks_.push_back(target + ": " + remark);
    } else {
      return;
    }
    file_ = parse_gltf(content_, target);
    if (file_.skin_nodes.empty()) document_ = std::make_unique<GltfDocument>(content_, target);
  }
  /// False: it is of another kind, or has bones that were not recognised.
  bool known() const { return document_ != nullptr; }
  /// What could not be taken.
  void say_remarks() const {
    for (const std::string& remark : remarks_) log_warning(remark);
  }
  void check(const std::string& out) const { document_->check_place(out); }
  /// Of each vertex of the target, how the document's nodes turn and stretch what it stores.
  std::vector<Mat3> stored(size_t vertices) const {
    const std::vector<Mat3> all = gltf_blends(file_, gltf_rest(file_));
    if (vertex_.empty()) return all;
    std::vector<Mat3> out(vertices, Mat3::Identity());
    for (size_t i = 0; i < vertex_.size(); ++i) out[static_cast<size_t>(vertex_[i])] = all[i];
    return out;
  }
  void write(const std::string& glb, const JointMoves* unposed, const std::string& out,
             const GltfDocument::Bulge* bulge = nullptr) {
    document_->wear(glb, file_, unposed, vertex_, bulge);
    document_->write(out);
  }

 private:
  std::string content_;
  std::vector<int32_t> vertex_;
  std::vector<std::string> remarks_;
  Gltf file_;
  std::unique_ptr<GltfDocument> document_;
};

}  // namespace restage::cli
