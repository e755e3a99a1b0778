#include "datasets/readers/fbx/assimp/fbx_process.h"

#include <algorithm>

#include "autograd/base/child_process.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/fbx/assimp/fbx_scene.h"

namespace restage {
namespace {

constexpr const char* kMend = "export it again, or export GLB (glTF) from Blender";

// What the child answers: this letter, then parts that end in a zero byte, then (kDocument) the
// document.
constexpr char kDocument = 'D', kRefused = 'R', kUnreadable = 'U';

std::string answer_of(std::string_view content, const std::string& path) {
  std::string out;
  const auto part = [&](const std::string& text) {
    out += text;
    out += '\0';
  };
  try {
    std::vector<std::string> remarks;
    const std::string glb = fbx_to_glb(content, path, &remarks);
    out = kDocument;
    part(std::to_string(remarks.size()));
    for (const std::string& remark : remarks) part(remark);
    return out + glb;
  } catch (const InputError& error) {
    out = kRefused;
    for (const std::string& text : {error.where(), error.cause(), error.mend()}) part(text);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    out = kUnreadable;
    part(cat("cannot be read (", assimp_words(error.what()), ")"));
  }
  return out;
}

/// Takes the next part off the answer.
std::string next_part(std::string_view& answer) {
  const size_t end = std::min(answer.find('\0'), answer.size());
  std::string out(answer.substr(0, end));
  answer.remove_prefix(std::min(end + 1, answer.size()));
  return out;
}

void check_end(ChildResult::End end, const std::string& path) {
  using enum ChildResult::End;
  if (end == no_memory)
    throw InputError(path, "takes far more memory than a file of its size should", kMend);
  if (end == no_end)
    throw InputError(path, "takes far longer to read than a file of its size should", kMend);
  if (end == crashed) throw InputError(path, "is so broken that its reader crashed", kMend);
}

}  // namespace

std::string fbx_in_a_process(std::string_view content, const std::string& path,
                             std::vector<std::string>* remarks) {
  const ChildLimits limits{(uint64_t{1} << 30) + 64 * uint64_t{content.size()},  // texts need 30
                           static_cast<unsigned>(60 + content.size() / 1'000'000)};
  const ChildResult child = in_a_child(limits, path, [&] { return answer_of(content, path); });
  check_end(child.end, path);
  std::string_view answer(child.answer);
  answer.remove_prefix(1);
  if (child.answer[0] == kRefused) {
    const std::string where = next_part(answer), cause = next_part(answer);
    throw InputError(where, cause, next_part(answer));
  }
  if (child.answer[0] == kUnreadable) throw InputError(path, next_part(answer), kMend);
  const size_t count = std::stoul(next_part(answer));
  for (size_t i = 0; i < count; ++i) {
    std::string remark = next_part(answer);
    if (remarks != nullptr) remarks->push_back(std::move(remark));
  }
  return std::string(answer);
}

}  // namespace restage
