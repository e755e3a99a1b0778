// Times what items.h lists. A driver (measure.py) starts it and asks, so that it can let this
// program and LibTorch's (libtorch/) take turns:
//   restage_bench inputs FOLDER ...    makes what both read
//   restage_bench list FOLDER          the items, as JSON
//   restage_bench serve FOLDER         answers requests, one line of JSON for each line:
//     run ITEM VARIANT N               {"ms": [N times]}, after one repetition that is not timed
//                                      if the item is not the last one asked for; where units are
//                                      left out also the shares that were not, "active" and
//                                      "active_scores" (autograd/kernels/stats.h), and "done_gflop"
//                                      of one repetition
//     check ITEM VARIANT               {"values": [...]}
//     memory ITEM VARIANT FEW MANY     what the process holds after FEW examples of a fresh item
//     and
//                                      after MANY, [MiB, MiB] each: "heap" (all that was asked for
//                                      and not freed, kept blocks of tensors included), "tensors",
//                                      "resident"
#include <malloc.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "autograd/base/parallel.h"
#include "autograd/kernels/instruction_sets.h"
#include "autograd/kernels/stats.h"
#include "autograd/tensor/tensor.h"
#include "bench/items.h"

namespace restage::bench {
namespace {

using nlohmann::json;

json list(const Inputs& inputs) {
  json out = json::array();
  for (const ItemInfo& i : items()) {
    std::vector<std::string> variants = {i.variant};
    if (std::any_of(i.models.begin(), i.models.end(),
                    [&](const std::string& m) { return inputs.has("trained", m); }))
      variants.push_back("trained");
    variants.insert(variants.end(), i.also.begin(), i.also.end());
    out.push_back({{"name", i.name},
                   {"what", i.what},
                   {"per", i.per},
                   {"examples", i.examples},
                   {"gflop", i.gflop},
                   {"variants", variants}});
  }
  return out;
}

/// Asked for and not freed, of all arenas.
double heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

double resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  double total = 0, resident = 0;
  statm >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

class Server {
 public:
  explicit Server(const std::string& folder) : inputs_(folder) {}

  json answer(const std::string& line) {
    std::istringstream words(line);
    std::string verb, name, variant;
    int64_t count = 1, many = 1;
    words >> verb >> name >> variant;
    if (verb == "check") return {{"values", make(name, variant, false)->check()}};
    if (verb == "run" && words >> count) return times(name, variant, count);
    if (verb == "memory" && words >> count >> many) return memory(name, variant, count, many);
    throw std::invalid_argument("unknown request: " + line);
  }

 private:
  static ItemInfo info(const std::string& name) {
    for (const ItemInfo& i : items())
      if (i.name == name) return i;
    throw std::invalid_argument("there is no item '" + name + "'");
  }
  std::unique_ptr<Item> make(const std::string& name, const std::string& variant, bool dropout) {
    return info(name).make(inputs_, variant, dropout);
  }

  json memory(const std::string& name, const std::string& variant, int64_t few, int64_t many) {
    item_.reset();
    current_.clear();
    const auto item = make(name, variant, true);
    const int each = info(name).examples;
    json out;
    for (int64_t done = 0; done < many;) {
      item->run();
      const bool passes = done < few && done + each >= few;
      done += each;
      if (!passes && done < many) continue;
      const auto add = [&](const char* key, double bytes) { out[key].push_back(bytes / 1048576); };
      add("heap", heap_bytes());
      add("tensors", static_cast<double>(memory_stats().in_use));
      add("resident", resident_bytes());
    }
    return out;
  }

  json times(const std::string& name, const std::string& variant, int64_t repeats) {
    if (const std::string wanted = name + " " + variant; wanted != current_) {
      item_.reset();
      item_ = make(name, variant, true);
      current_ = wanted;
      item_->run();
    }
    std::vector<double> ms;
    take_kernel_stats();
    for (int64_t i = 0; i < repeats; ++i) {
      item_->prepare();
      const auto start = std::chrono::steady_clock::now();
      item_->run();
      ms.push_back(
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
              .count());
    }
    const KernelStats work = take_kernel_stats();
    json out = {{"ms", ms}};
    if (std::isfinite(work.active_share)) {
      out["active"] = work.active_share;
      out["active_scores"] = work.active_score_share;
      out["done_gflop"] = 1e-9 * work.flops / static_cast<double>(std::max<int64_t>(1, repeats));
    }
    return out;
  }

  Inputs inputs_;
  std::string current_;
  std::unique_ptr<Item> item_;
};

int serve(const std::string& folder) {
  Server server(folder);
  for (std::string line; std::getline(std::cin, line);)
    std::cout << server.answer(line).dump() << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  CLI::App app("Times Restage; bench/README.md says how");
  app.require_subcommand(1);
  std::string folder, instructions;
  InputSettings settings;
  int threads = 0;
  CLI::App* make = app.add_subcommand("inputs", "make the folder of inputs");
  make->add_option("--data", settings.data, "'builtin' or a data set file");
  make->add_option("--trained", settings.trained, "weights file with a paper-size extractor");
  make->add_option("--lite", settings.lite, "weights file of the lite models")->required();
  make->add_option("--configs", settings.configs, "folder with lite/all.yaml and paper/all.yaml");
  CLI::App* show = app.add_subcommand("list", "list the items as JSON");
  CLI::App* answer = app.add_subcommand("serve", "answer requests on standard input");
  answer->add_option("--threads", threads, "number of threads (0: all cores)");
  answer->add_option("--instructions", instructions,
                     "set of vector instructions, e.g. avx2 (default: the best)");
  for (CLI::App* sub : {make, show, answer}) sub->add_option("folder", folder)->required();
  CLI11_PARSE(app, argc, argv);
  set_threads(threads);
  if (!instructions.empty()) use_instruction_set(instructions);
  if (*make) make_inputs(folder, settings);
  if (*show) std::cout << list(Inputs(folder)).dump(1) << '\n';
  return *answer ? serve(folder) : 0;
}

}  // namespace
}  // namespace restage::bench

int main(int argc, char** argv) {
  try {
    return restage::bench::run(argc, argv);
  } catch (const std::exception& e) {
    std::cerr << "restage_bench: " << e.what() << '\n';
    return 1;
  }
}
