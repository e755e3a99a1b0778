// restage data fetch: a data folder from the original public addresses, or from a copy.
#include <filesystem>

#include "autograd/base/error.h"
#include "datasets/fetch/fetch.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"

namespace restage::cli {
namespace {

constexpr const char* kProjectsList = "configs/data/open_data.txt";

struct FetchOptions {
  std::string list = kProjectsList, out, from;
};

int run_fetch(const FetchOptions& o, const Common& common) {
  if (o.list == kProjectsList && !std::filesystem::exists(o.list))
    throw InputError(o.list, "is not below this folder",
                     "run it in the folder of Restage's sources, or name a LIST");
  const FetchSummary done = fetch_data(o.list, o.out, o.from);
  std::string text = o.out + ": " + std::to_string(done.fetched) + " files fetched, " +
                     std::to_string(done.present) + " there already\n";
  for (const std::string& path : done.missing)
    text += "missing " + path + ": " +
            (o.from.empty() ? "has no address; give --source a folder that holds it\n"
                            : "is not in " + o.from + "\n");
  print(common.json,
        {{"out", o.out},
         {"fetched", done.fetched},
         {"present", done.present},
         {"bytes", done.bytes},
         {"missing", done.missing}},
        text);
  return done.missing.empty() ? 0 : 1;
}

}  // namespace

void add_data_fetch(Program& program, CommandOptions group) {
  auto [app, o] =
      program.add(group, "fetch", "fill a data folder from public addresses, checked by SHA-256",
                  "restage data fetch --out data\n"
                  "restage data fetch --out data --source /mnt/copy_of_data",
                  run_fetch);
  app.add_option("LIST", o.list, "lines 'SHA256 BYTES PATH ADDRESS' (default: " + o.list + ")");
  app.add_option("--out", o.out, "data folder to fill").required();
  app.add_option("--source", o.from,
                 "folder laid out alike to copy from; CMU's recordings may lie anywhere in it "
                 "(default: the network)")
      .formerly("--from");
}

}  // namespace restage::cli
