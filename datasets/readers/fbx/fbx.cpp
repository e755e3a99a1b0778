#include "datasets/readers/fbx/fbx.h"

#include <memory>
#include <mutex>

#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#ifdef RESTAGE_ASSIMP
#include "datasets/readers/fbx/assimp/fbx_process.h"
#endif

namespace restage {

bool is_fbx_name(const std::string& path) { return text::ends_in(path, {".fbx"}); }

bool starts_as_fbx(std::string_view content) {
  if (content.starts_with("Kaydara FBX Binary")) return true;
  if (content.starts_with("\xEF\xBB\xBF")) content.remove_prefix(3);
  const size_t first = content.find_first_not_of(" \t\r\n");
  if (first == content.npos) return false;
  content = content.substr(first, 200);
  return (content.front() == ';' && content.find("FBX") != content.npos) ||
         content.starts_with("FBXHeaderExtension");
}

std::string fbx_as_glb(std::string_view content, const std::string& path,
                       std::vector<std::string>* remarks) {
  if (!starts_as_fbx(content))
    throw InputError(path, "is no FBX file", "export it again, or export GLB (glTF) from Blender");
#ifdef RESTAGE_ASSIMP
  // A command reads its target more than once (what it is, the rig, what is written), and reading
  // takes seconds: the last document is kept.
  struct Made {
    std::string content, path, glb;
    std::vector<std::string> remarks;
  };
  static std::mutex mutex;
  static std::unique_ptr<const Made> last;
  const std::lock_guard lock(mutex);
  if (!last || last->path != path || last->content != content) {
    Made made{std::string(content), path, "", {}};
    made.glb = fbx_in_a_process(content, path, &made.remarks);
    last = std::make_unique<const Made>(std::move(made));
  }
  if (remarks != nullptr)
    remarks->insert(remarks->end(), last->remarks.begin(), last->remarks.end());
  return last->glb;
#else
  static_cast<void>(remarks);
  throw InputError(path, "is FBX, and this program was built without Assimp, which reads it",
                   "install libassimp-dev and build again, or open it in Blender and export GLB "
                   "(glTF)");
#endif
}

}  // namespace restage
