// LibTorch's answers to the requests that ../restage_bench.cpp describes.
// usage: libtorch_bench FOLDER THREADS BLAS
// BLAS is a part of the path of the BLAS library that must be the one in use ("openblas-pthread").
#include <ATen/Parallel.h>
#include <dlfcn.h>

#include <chrono>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "items.h"

namespace bench {
namespace {

using nlohmann::json;

/// The file in which LibTorch finds its matrix product. Throws unless it is the BLAS expected and
/// no other is loaded: a wrong library path would otherwise time something else without a word.
std::string require_blas(const std::string& expected) {
  Dl_info found{};
  void* product = dlsym(RTLD_DEFAULT, "sgemm_");
  TORCH_CHECK(product && dladdr(product, &found), "no BLAS library is loaded");
  std::set<std::string> loaded = {found.dli_fname};
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);)
    for (const char* name : {"libblas.so", "libblis.so", "libopenblas"})
      if (line.find(name) != std::string::npos) loaded.insert(line.substr(line.find('/')));
  for (const std::string& path : loaded)
    TORCH_CHECK(path.find(expected) != std::string::npos, "the BLAS should be ", expected, ", but ",
                path, " is loaded");
  return found.dli_fname;
}

class Server {
 public:
  explicit Server(const std::string& folder) : inputs_(folder) {}

  json answer(const std::string& line) {
    std::istringstream words(line);
    std::string verb, name, variant;
    int repeats = 1;
    words >> verb >> name >> variant;
    inputs_.variant = variant;
    if (verb == "check") return {{"values", make(name, false)->check()}};
    TORCH_CHECK(verb == "run" && words >> repeats, "unknown request: ", line);
    return {{"ms", times(name, repeats)}};
  }

 private:
  std::unique_ptr<Item> make(const std::string& name, bool dropout) {
    auto item = make_item(name, inputs_, dropout);
    TORCH_CHECK(item, "there is no item '", name, "'");
    return item;
  }

  std::vector<double> times(const std::string& name, int repeats) {
    if (name != current_) {
      item_.reset();
      item_ = make(name, true);
      current_ = name;
      item_->run();
    }
    std::vector<double> out;
    for (int i = 0; i < repeats; ++i) {
      item_->prepare();
      const auto start = std::chrono::steady_clock::now();
      item_->run();
      out.push_back(
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
              .count());
    }
    return out;
  }

  Inputs inputs_;
  std::string current_;
  std::unique_ptr<Item> item_;
};

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  try {
    TORCH_CHECK(argc == 4, "usage: libtorch_bench FOLDER THREADS BLAS");
    torch::set_num_threads(std::stoi(argv[2]));
    torch::manual_seed(0);
    const std::string blas = bench::require_blas(argv[3]);
    bench::Server server(argv[1]);
    std::cout << nlohmann::json{{"blas", blas}, {"threads", at::get_num_threads()}}.dump()
              << std::endl;
    for (std::string line; std::getline(std::cin, line);)
      std::cout << server.answer(line).dump() << std::endl;
    return 0;
  } catch (const c10::Error& e) {
    std::cerr << "libtorch_bench: " << e.what_without_backtrace() << '\n';
    return 1;
  } catch (const std::exception& e) {
    std::cerr << "libtorch_bench: " << e.what() << '\n';
    return 1;
  }
}
