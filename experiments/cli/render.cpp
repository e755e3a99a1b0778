// restage render: a contact sheet or a page that plays source, result and truth.

#include "autograd/base/error.h"
#include "autograd/base/output_check.h"
#include "experiments/cli/clips.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "infer/render/page.h"
#include "infer/render/sheet.h"

namespace restage::cli {
namespace {

struct RenderOptions {
  std::string result, source, truth, out, title;
  int columns = 8;
  double fps = kFps;
  int64_t sequence = 0;
};

void check(const RenderOptions& options) {
  if (!options.out.ends_with(".png") && !options.out.ends_with(".html"))
    throw InputError(options.out, "names neither a picture nor a page",
                     "end --out in .png or .html");
  if (options.columns < 1 || options.columns > 64)
    throw InputError("", "--columns " + std::to_string(options.columns) + " is out of range",
                     "give a number from 1 to 64");
  if (!(options.fps > 0) || options.fps > 1000)
    throw InputError("", "--fps is out of range", "give frames per second above 0");
  check_output(options.out, {options.result, options.source, options.truth});
}

int run_render(const RenderOptions& options, const Common& common) {
  check(options);
  std::vector<Clip> clips;
  const auto add = [&](const std::string& path, const std::string& label) {
    if (!path.empty()) clips.push_back(read_clip(path, label, options.sequence));
  };
  add(options.source, "source");
  add(options.result, "result");
  add(options.truth, "truth");
  if (options.out.ends_with(".png")) {
    SheetOptions sheet;
    sheet.columns = options.columns;
    sheet.fps = options.fps;
    sheet.title = options.title;
    write_contact_sheet(options.out, clips, sheet);
  } else {
    PageOptions page;
    page.fps = options.fps;
    if (!options.title.empty()) page.title = options.title;
    write_page(options.out, clips, page);
  }
  print(common.json, {{"out", options.out}}, "wrote " + options.out + "\n");
  return 0;
}

}  // namespace

void add_render(Program& program) {
  auto [app, options] =
      program.add("render", "draw a result as a contact sheet or a page that plays it",
                  "restage render result.h5 --source scans/ --out sheet.png\n"
                  "restage render result.h5 --source scans.h5 --truth truth.h5 --out page.html",
                  run_render);
  app.add_option("RESULT", options.result, "prediction or scans (HDF5), or a folder of PLY or OBJ")
      ->required();
  app.add_option("--source", options.source, "what the motion was taken from");
  app.add_option("--truth", options.truth, "the true motion, if it is known");
  app.add_option("--out", options.out, "sheet.png or page.html")->required();
  app.add_option("--columns", options.columns, "moments on a sheet");
  app.add_option("--fps", options.fps, "frames per second of the input");
  app.add_option("--sequence", options.sequence, "which sequence of an HDF5 file, from 0");
  app.add_option("--title", options.title, "a line at the top");
}

}  // namespace restage::cli
