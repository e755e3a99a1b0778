// Numbers of a glTF file: buffers, views, accessors, sparse changes. Every range is checked.
#include <algorithm>
#include <cmath>

#include "datasets/readers/errors.h"
#include "datasets/readers/gltf/gltf_detail.h"
#include "datasets/readers/text/numbers.h"

namespace restage::gltf {
namespace {

const Number& component(int type, const std::string& path, const std::string& what) {
  static constexpr std::pair<int, const Number*> kKnown[] = {
      {TINYGLTF_COMPONENT_TYPE_BYTE, &kNumber<int8_t>},
      {TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, &kNumber<uint8_t>},
      {TINYGLTF_COMPONENT_TYPE_SHORT, &kNumber<int16_t>},
      {TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, &kNumber<uint16_t>},
      {TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, &kNumber<uint32_t>},
      {TINYGLTF_COMPONENT_TYPE_FLOAT, &kNumber<float>}};
  for (const auto& [known, number] : kKnown)
    if (type == known) return *number;
  broken(path, cat(what, " are of the unknown component type ", type));
}

/// `count` elements of `size` bytes, `stride` apart.
struct Span {
  const char* first = nullptr;
  size_t stride = 0;
};

Span elements(const Document& document, int view_index, uint64_t offset, uint64_t count,
              size_t size, bool may_stride, const std::string& what) {
  const std::string& path = document.path;
  const auto& views = document.model.bufferViews;
  const auto& view = views[checked(view_index, views.size(), path, "buffer view")];
  const std::string_view buffer =
      document.buffers[checked(view.buffer, document.buffers.size(), path, "buffer")];
  if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset)
    broken(path, cat("buffer view ", view_index, " lies outside of its buffer"));
  const size_t stride = may_stride && view.byteStride != 0 ? view.byteStride : size;
  if (stride < size) broken(path, cat(what, " overlap (stride ", stride, ")"));
  // offset + (count - 1) * stride + size <= byteLength, without overflow
  const bool fits = offset <= view.byteLength && size <= view.byteLength - offset &&
                    (count - 1) <= (view.byteLength - offset - size) / stride;
  if (!fits) broken(path, what + " reach beyond their buffer view");
  return {buffer.data() + view.byteOffset + offset, stride};
}

const tinygltf::Accessor& accessor_of(const Document& document, int index, int type,
                                      const std::string& what) {
  const auto& list = document.model.accessors;
  const auto& out = list[checked(index, list.size(), document.path, "accessor")];
  if (out.type != type) broken(document.path, what + " are of the wrong type");
  if (out.count == 0) broken(document.path, what + " are none");
  return out;
}

/// Replaces the elements that a sparse accessor names.
template <class T>
void read_sparse(const Document& document, const tinygltf::Accessor& accessor, const Number& kind,
                 size_t width, double factor, const std::string& what, std::vector<T>& values) {
  const auto& sparse = accessor.sparse;
  const std::string& path = document.path;
  if (sparse.count <= 0 || static_cast<uint64_t>(sparse.count) > accessor.count ||
      sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0)
    broken(path, what + " have an impossible sparse part");
  const auto count = static_cast<size_t>(sparse.count);
  const Number& index = component(sparse.indices.componentType, path, "indices of " + what);
  if (!index.integer) broken(path, "indices of " + what + " are no integers");
  const Span places = elements(document, sparse.indices.bufferView,
                               static_cast<uint64_t>(sparse.indices.byteOffset), count, index.bytes,
                               false, "indices of " + what);
  const Span news =
      elements(document, sparse.values.bufferView, static_cast<uint64_t>(sparse.values.byteOffset),
               count, width * kind.bytes, false, "sparse " + what);
  for (size_t i = 0; i < count; ++i) {
    const double place = index.at(places.first + i * places.stride, false);
    if (!(place >= 0 && place < static_cast<double>(accessor.count)))
      broken(path, what + " have a sparse part out of range");
    for (size_t c = 0; c < width; ++c)
      values[static_cast<size_t>(place) * width + c] =
          static_cast<T>(kind.at(news.first + i * news.stride + c * kind.bytes, false) * factor);
  }
}

template <class T>
std::vector<T> read_values(const Document& document, const tinygltf::Accessor& accessor,
                           const Number& kind, double factor, const std::string& what,
                           Allowance& allowance) {
  const auto width = static_cast<size_t>(tinygltf::GetNumComponentsInType(accessor.type));
  allowance.spend(accessor.count, width * sizeof(T));
  std::vector<T> out;
  if (accessor.bufferView >= 0) {
    const Span span = elements(document, accessor.bufferView, accessor.byteOffset, accessor.count,
                               width * kind.bytes, true, what);
    out.resize(accessor.count * width);
    for (size_t i = 0; i < accessor.count; ++i)
      for (size_t c = 0; c < width; ++c)
        out[i * width + c] =
            static_cast<T>(kind.at(span.first + i * span.stride + c * kind.bytes, false) * factor);
  } else if (accessor.sparse.isSparse) {
    out.resize(accessor.count * width);
  } else if (!document.compression.empty()) {
    refuse_compression(document.compression, document.path);
  } else {
    broken(document.path, what + " have no data");
  }
  if (accessor.sparse.isSparse) read_sparse(document, accessor, kind, width, factor, what, out);
  return out;
}

}  // namespace

std::vector<float> read_floats(const Document& document, int index, int type,
                               const std::string& what, Allowance& allowance) {
  const tinygltf::Accessor& accessor = accessor_of(document, index, type, what);
  const Number& kind = component(accessor.componentType, document.path, what);
  const double factor = accessor.normalized && kind.integer ? 1.0 / kind.largest : 1.0;
  std::vector<float> out = read_values<float>(document, accessor, kind, factor, what, allowance);
  for (float& x : out) {
    if (!std::isfinite(x)) broken(document.path, what + " hold NaN or infinity");
    if (factor != 1.0) x = std::max(x, -1.0f);  // -128 / 127
  }
  return out;
}

std::vector<uint32_t> read_integers(const Document& document, int index, int type,
                                    const std::string& what, Allowance& allowance) {
  const tinygltf::Accessor& accessor = accessor_of(document, index, type, what);
  const int kind = accessor.componentType;
  if (kind != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
      kind != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
      kind != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
    broken(document.path, what + " are no unsigned integers");
  return read_values<uint32_t>(document, accessor, component(kind, document.path, what), 1.0, what,
                               allowance);
}

}  // namespace restage::gltf
