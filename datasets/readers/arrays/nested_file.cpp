#include "datasets/readers/arrays/nested_file.h"

#include <zlib.h>

#include <map>

#include "datasets/readers/arrays/pickle.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

using namespace std::string_view_literals;

std::vector<char> whole_file(const std::string& path, uint64_t max_memory) {
  FileStream in(path);
  if (in.size() > max_memory)
    throw InputError(path,
                     cat("takes ", in.size(), " bytes, more than the ", max_memory, " allowed"),
                     "allow more with {max-memory}");
  return in.take(in.size());
}

std::string_view view(const std::vector<char>& bytes) { return {bytes.data(), bytes.size()}; }

// ---- joblib packs with zlib --------------------------------------------------------------------

bool is_packed(std::string_view bytes) {
  if (bytes.size() < 2) return false;
  const int first = static_cast<unsigned char>(bytes[0]),
            second = static_cast<unsigned char>(bytes[1]);
  return (first == 0x78 && (first * 256 + second) % 31 == 0) || (first == 0x1f && second == 0x8b);
}

std::vector<char> unpacked(std::string_view packed, const std::string& path, uint64_t max_memory) {
  z_stream stream{};
  if (inflateInit2(&stream, MAX_WBITS + 32) != Z_OK)
    throw WorkError(path + ": could not start zlib; free some memory");
  const struct Guard {
    z_stream* stream;
    ~Guard() { inflateEnd(stream); }
  } guard{&stream};
  std::vector<char> out, piece(size_t{1} << 18);
  for (int state = Z_OK; state != Z_STREAM_END;) {
    if (stream.avail_in == 0) {
      const size_t n = std::min<size_t>(packed.size(), size_t{1} << 30);
      stream.next_in = reinterpret_cast<unsigned char*>(const_cast<char*>(packed.data()));
      stream.avail_in = static_cast<unsigned>(n);
      packed.remove_prefix(n);
    }
    stream.next_out = reinterpret_cast<unsigned char*>(piece.data());
    stream.avail_out = static_cast<unsigned>(piece.size());
    state = inflate(&stream, Z_NO_FLUSH);
    if (state != Z_OK && state != Z_STREAM_END)
      throw InputError(path, "is packed, and cut short or damaged", "copy or save it again");
    const size_t got = piece.size() - stream.avail_out;
    if (got > max_memory - std::min<uint64_t>(out.size(), max_memory))
      throw InputError(path, cat("unpacks to more than the ", max_memory, " bytes allowed"),
                       "allow more with {max-memory}");
    out.insert(out.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(got));
  }
  return out;
}

/// InputError for what joblib packs in other ways.
void refuse_other_packing(std::string_view bytes, const std::string& path) {
  for (const auto& [start, name] : {std::pair("BZh"sv, "bzip2"),
                                    {"\xFD\x37zXZ"sv, "xz"},
                                    {"\x5D\0\0"sv, "lzma"},
                                    {"\x04\x22\x4D\x18"sv, "lz4"},
                                    {"ZF"sv, "an old joblib"}})
    if (bytes.starts_with(start))
      throw InputError(path, cat("is packed with ", name),
                       "save it again with joblib.dump(x, FILE), without compress");
}

// ---- torch -------------------------------------------------------------------------------------

/// The member of torch's pickle; null if the archive is none of torch's.
const ZipFile::Member* torch_pickle(const ZipFile& zip) {
  for (const ZipFile::Member& member : zip.members())
    if (member.name == "data.pkl" || member.name.ends_with("/data.pkl")) return &member;
  return nullptr;
}

std::vector<char> member_bytes(const ZipFile& zip, const ZipFile::Member& member, uint64_t max) {
  if (member.size > max)
    throw InputError(
        zip.path(), cat("has a member of ", member.size, " bytes, more than the ", max, " allowed"),
        "allow more with {max-memory}");
  return zip.open(member)->take(member.size);
}

ValueTree read_torch_zip(const ZipFile& zip, const ZipFile::Member& pickle, uint64_t max_memory) {
  const std::string folder = pickle.name.substr(0, pickle.name.size() - 8);  // "data.pkl"
  if (const ZipFile::Member* order = zip.find(folder + "byteorder"))
    if (view(member_bytes(zip, *order, max_memory)) != "little")
      throw InputError(zip.path(), "was saved by a machine of the other byte order",
                       save_as_arrays(zip.path()));
  std::map<std::string, std::vector<char>> storages;
  uint64_t left = max_memory;
  PickleLimits limits{max_memory, {}};
  limits.storage = [&](const std::string& key, uint64_t bytes) -> std::string_view {
    const auto known = storages.find(key);
    if (known != storages.end()) return view(known->second);
    const ZipFile::Member* member = zip.find(folder + "data/" + key);
    if (member == nullptr || member->size < bytes)
      throw InputError(zip.path(), "lacks the numbers of a tensor", "copy or save it again");
    std::vector<char>& out = storages[key] = member_bytes(zip, *member, left);
    left -= out.size();
    return view(out);
  };
  ValueTree tree(zip.path());
  read_pickle(view(member_bytes(zip, pickle, max_memory)), limits, tree);
  return tree;
}

constexpr std::string_view kOldTorch = "\x80\x02\x8A\x0A\x6C\xFC\x9C\x46\xF9\x20\x6A\xA8\x50\x19.";

/// Older files of torch: a magic number, a version, a description, the value, the keys of its
/// storages, and these: how many elements (8 bytes), then they.
ValueTree read_old_torch(std::string_view bytes, const std::string& path, uint64_t max_memory) {
  std::map<std::string, uint64_t> sizes;
  std::map<std::string, std::string_view> storages;
  const std::string nothing(bytes.size(), '\0');  // stands in until they are found
  PickleLimits limits{max_memory, {}};
  limits.storage = [&](const std::string& key, uint64_t size) -> std::string_view {
    sizes[key] = size;
    if (size > nothing.size())
      throw InputError(path, "lacks the numbers of a tensor", "copy or save it again");
    return {nothing.data(), size};
  };
  for (int i = 0; i < 3; ++i) {
    ValueTree ignored(path);
    bytes.remove_prefix(read_pickle(bytes, {max_memory, {}}, ignored));
  }
  ValueTree first(path), keys(path), tree(path);
  const size_t value = read_pickle(bytes, limits, first);
  std::string_view rest = bytes.substr(value);
  rest.remove_prefix(read_pickle(rest, {max_memory, {}}, keys));
  const size_t count = keys.is(keys.root, ValueTree::Kind::list) ? keys.items(keys.root).size() : 0;
  for (size_t i = 0; i < count; ++i) {
    const std::string key = keys.key(keys.items(keys.root)[i]);
    const uint64_t size = sizes[key];
    if (rest.size() < 8 || size > rest.size() - 8)
      throw InputError(path, "lacks the numbers of a tensor", "copy or save it again");
    storages[key] = rest.substr(8, size);
    rest.remove_prefix(8 + size);
  }
  limits.storage = [&](const std::string& key, uint64_t size) -> std::string_view {
    const auto at = storages.find(key);
    if (at == storages.end() || at->second.size() < size)
      throw InputError(path, "lacks the numbers of a tensor", "copy or save it again");
    return at->second;
  };
  read_pickle(bytes, limits, tree);
  return tree;
}

// ---- numpy's objects ---------------------------------------------------------------------------

/// What stands behind the header of an array of objects.
void read_objects_into(ByteStream& in, uint64_t max_memory, ValueTree& tree) {
  if (in.left() > max_memory)
    throw InputError(in.where(), cat("takes ", in.left(), " bytes, more than allowed"),
                     "allow more with {max-memory}");
  const std::vector<char> bytes = in.take(in.left());
  read_pickle(view(bytes), {max_memory, {}}, tree);
}

/// An array of an archive.
class MemberArray : public LazyArray {
 public:
  MemberArray(std::shared_ptr<const Npz> file, std::string name, NpyHeader header)
      : file_(std::move(file)), name_(std::move(name)), header_(std::move(header)) {}
  NpyHeader header() const override { return header_; }
  NpyArray read() const override { return file_->array(name_); }

 private:
  std::shared_ptr<const Npz> file_;
  std::string name_;
  NpyHeader header_;
};

}  // namespace

bool is_pickle_name(const std::string& path) {
  return text::ends_in(path, {".pkl", ".pickle", ".pt", ".pth", ".joblib"});
}

bool holds_objects(const std::string& path) {
  try {
    FileStream in(path);
    return read_npy_header(in, true).is_object;
  } catch (const InputError&) {
    return false;
  }
}

std::string save_as_arrays(const std::string& path) {
  const bool torch = text::ends_in(path, {".pt", ".pth"});
  return cat("load it in Python (", torch ? "torch.load" : "pickle.load or joblib.load",
             ") and save poses [F, 72] and trans [F, 3] with numpy.savez");
}

ValueTree read_nested_file(const std::string& path, uint64_t max_memory) {
  {
    FileStream in(path);
    std::vector<char> head = in.take(std::min<uint64_t>(in.size(), 512));
    if (view(head).starts_with("\x93NUMPY")) {
      in.rewind();
      if (!read_npy_header(in, true).is_object)
        throw InputError(path, "holds an array of numbers and no objects", save_as_arrays(path));
      ValueTree tree(path);
      read_objects_into(in, max_memory, tree);
      return tree;
    }
    if (view(head).starts_with("PK\x03\x04"sv)) {
      const ZipFile zip(path);
      if (const ZipFile::Member* pickle = torch_pickle(zip))
        return read_torch_zip(zip, *pickle, max_memory);
      throw InputError(path, "is a zip archive without a pickle", save_as_arrays(path));
    }
    if (is_lfs_pointer(view(head)))
      throw InputError(path, "is a Git LFS pointer, not the file itself", "run git lfs pull");
  }
  std::vector<char> bytes = whole_file(path, max_memory);
  refuse_other_packing(view(bytes), path);
  if (is_packed(view(bytes))) bytes = unpacked(view(bytes), path, max_memory);
  if (view(bytes).starts_with(kOldTorch)) return read_old_torch(view(bytes), path, max_memory);
  ValueTree tree(path);
  read_pickle(view(bytes), {max_memory, {}}, tree);
  return tree;
}

ValueTree read_nested_arrays(const std::shared_ptr<const Npz>& file, uint64_t max_memory,
                             std::optional<InputError>& fault) {
  ValueTree tree(file->path());
  std::vector<ValueTree::Id> entries;
  for (const std::string& name : file->names()) {
    try {
      const std::unique_ptr<ByteStream> in = file->open(name);
      const NpyHeader header = read_npy_header(*in, true);
      ValueTree::Id value = 0;
      if (header.is_object) {
        read_objects_into(*in, max_memory, tree);
        value = tree.root;
      } else {
        value = tree.add_array(std::make_shared<MemberArray>(file, name, header));
      }
      entries.push_back(tree.add_text(name));
      entries.push_back(value);
    } catch (const InputError& error) {
      if (!fault) fault = error;
    }
  }
  tree.root = tree.add_map(std::move(entries));
  return tree;
}

}  // namespace restage
