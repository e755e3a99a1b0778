#include "datasets/readers/arrays/npz.h"

#include "autograd/base/error.h"

namespace restage {
namespace {

constexpr const char* kEnding = ".npy";

}  // namespace

std::vector<std::string> Npz::names() const {
  std::vector<std::string> out;
  for (const ZipFile::Member& member : zip_.members())
    if (member.name.ends_with(kEnding))
      out.push_back(member.name.substr(0, member.name.size() - 4));
  return out;
}

bool Npz::has(const std::string& name) const { return zip_.find(name + kEnding) != nullptr; }

std::unique_ptr<ByteStream> Npz::open(const std::string& name) const {
  const ZipFile::Member* member = zip_.find(name + kEnding);
  if (member == nullptr)
    throw InputError(path(), "has no array '" + name + "' (it has " + list_of(names()) + ")",
                     "give a file that has one");
  return zip_.open(*member);
}

NpyArray Npz::array(const std::string& name) const {
  const std::unique_ptr<ByteStream> in = open(name);
  return NpyArray(*in, max_memory_);
}

NpyHeader Npz::header(const std::string& name) const {
  const std::unique_ptr<ByteStream> in = open(name);
  return read_npy_header(*in);
}

}  // namespace restage
