// All targets in one program:
//   restage_fuzz --list    names, longest input (bytes), largest allocation (MiB), dictionary
//   restage_fuzz --target=NAME --seeds=FOLDER    writes its seeds
//   restage_fuzz --target=NAME ...               libFuzzer; -help=1 lists its options
// An input may be read or refused by InputError in one short line. Everything else is a finding.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "tests/fuzz/targets.h"

// The HDF5 library itself forgets some memory when it refuses a damaged file.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5\n"; }

namespace restage::fuzz {
namespace {

const Target* chosen = nullptr;

/// "--name=value": the value of the last such argument, or nothing.
std::string option(int argc, char** argv, std::string_view name) {
  std::string out;
  for (int i = 1; i < argc; ++i)
    if (const std::string_view argument = argv[i];
        argument.starts_with(name) && argument.substr(name.size()).starts_with("="))
      out = argument.substr(name.size() + 1);
  return out;
}

void choose(const std::string& name) {
  for (const Target& target : targets())
    if (target.name == name) chosen = &target;
  if (chosen != nullptr) return;
  std::fprintf(stderr, "give --target=NAME, one of those that --list shows\n");
  std::exit(2);
}

[[noreturn]] void finding(const char* what, const std::string& message) {
  std::fprintf(stderr, "%s: %s\n", what, message.c_str());
  std::abort();
}

}  // namespace
}  // namespace restage::fuzz

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using namespace restage::fuzz;
  if (*argc == 2 && std::string_view((*argv)[1]) == "--list") {
    for (const Target& target : targets())
      std::printf("%s %zu %zu %s\n", std::string(target.name).c_str(), target.longest,
                  target.allocation, std::string(target.words).c_str());
    std::exit(0);
  }
  choose(option(*argc, *argv, "--target"));
  const std::string folder = option(*argc, *argv, "--seeds");
  if (folder.empty()) return 0;
  std::filesystem::create_directories(folder);
  for (const Seed& seed : seeds(chosen->name))
    restage::write_file_atomically(folder + "/" + seed.name, seed.bytes);
  std::exit(0);
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace restage::fuzz;
  try {
    chosen->read(std::string(reinterpret_cast<const char*>(data), size));
  } catch (const restage::InputError& error) {
    const std::string message = error.what();
    if (message.find('\n') != std::string::npos || message.size() >= 390)
      finding("the refusal is not one short line", message);
  } catch (const std::exception& error) {
    finding("another exception than InputError", error.what());
  }
  return 0;
}
