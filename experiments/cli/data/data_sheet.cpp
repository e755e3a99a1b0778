// restage data sheet: bodies and motions of a data file, or the sequences of a benchmark folder, on
// one picture.
#include <algorithm>
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/base/output_check.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "infer/render/figures.h"

namespace restage::cli {
namespace {

namespace fs = std::filesystem;
constexpr uint32_t kSource = 0x4a8bc9, kTarget = 0xe8a06c;

struct SheetArguments {
  std::string input, out, title;
  int columns = 11;
};

Figure figure(Points points, std::vector<Triangle> faces, uint32_t colour, std::string caption) {
  return {{{std::move(points), std::move(faces), colour}}, std::move(caption)};
}

Figure posed(const Body& body, const Motion& motion, size_t frame) {
  return figure(pose_surface(body, pose_on(motion, body, frame)), body.rest.faces, kTarget,
                motion.id + " " + body.id);
}

/// Bodies in T-pose; then the middle of every motion, bodies in turn.
std::vector<Figure> figures_of_file(const std::string& file) {
  const std::string kind = inspect(file).kind;
  if (kind != "bodies" && kind != "dataset")
    throw InputError(file, "holds no bodies",
                     "give a data file with bodies, or a benchmark folder");
  const std::vector<Body> bodies = read_bodies(file);
  std::vector<Figure> out;
  for (const Body& body : bodies)
    out.push_back(figure(body.rest.vertices, body.rest.faces, kSource, body.id));
  if (kind == "bodies") return out;
  size_t turn = 0;
  for (const Motion& motion : read_motions(file))
    out.push_back(posed(bodies[turn++ % bodies.size()], motion, motion.frames() / 2));
  return out;
}

Points frame_of(const Scans& scans, size_t frame) {
  return {scans.points.begin() + scans.frame_offset[frame],
          scans.points.begin() + scans.frame_offset[frame + 1]};
}

/// Scans in the world, where their truth says how they were put elsewhere.
void to_world(const std::string& truth, Points& cloud) {
  const h5::File file = open_schema_file(truth);
  if (!file.has("/source_to_world")) return;
  const std::vector<double> m = file.read<double>("/source_to_world", {3, 4});
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> map(m.data());
  for (Point& p : cloud) p = (map * p.cast<double>().homogeneous()).cast<float>();
}

/// The middle of every sequence: the cloud that goes in, the surface that should come out.
std::vector<Figure> figures_of_folder(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code failed;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failed))
    if (fs::exists(entry.path() / "truth.h5")) names.push_back(entry.path().filename().string());
  if (names.empty())
    throw InputError(folder, "holds no sequences",
                     "give a folder such as naked/ of a benchmark folder");
  std::sort(names.begin(), names.end());
  std::vector<Figure> out;
  for (const std::string& name : names) {
    const std::string path = folder + "/" + name;
    const Scans scans = read_scans(path + "/source.h5");
    const auto frame = static_cast<size_t>(scans.frames() / 2);
    Points cloud = frame_of(scans, frame);
    to_world(path + "/truth.h5", cloud);
    const Prediction truth = read_prediction(path + "/truth.h5");
    if (static_cast<int64_t>(frame) >= truth.frames)
      throw InputError(path + "/truth.h5", "has fewer frames than source.h5", "build it again");
    Points answer;
    const auto count = static_cast<size_t>(truth.vertex_count);
    for (size_t v = frame * count; v < (frame + 1) * count; ++v)
      answer.push_back(
          Vec3(truth.vertices[3 * v], truth.vertices[3 * v + 1], truth.vertices[3 * v + 2])
              .cast<float>());
    const size_t dash = name.find('-');
    out.push_back(figure(std::move(cloud), {}, kSource, name.substr(0, dash)));
    out.push_back(figure(std::move(answer), truth.faces, kTarget,
                         dash == name.npos ? "" : name.substr(dash + 1)));
  }
  return out;
}

int run_sheet(const SheetArguments& a, const Common& common) {
  if (!a.out.ends_with(".png")) throw InputError(a.out, "names no picture", "end --out in .png");
  if (a.columns < 1 || a.columns > 64)
    throw InputError("", "--columns " + std::to_string(a.columns) + " is out of range",
                     "give a number from 1 to 64");
  check_output(a.out, {a.input});
  FigureSheetOptions options;
  options.columns = a.columns;
  options.cell_height = 150;
  options.title = a.title;
  write_png(a.out, figure_sheet(fs::is_directory(a.input) ? figures_of_folder(a.input)
                                                          : figures_of_file(a.input),
                                options));
  print(common.json, {{"out", a.out}}, "wrote " + a.out + "\n");
  return 0;
}

}  // namespace

void add_data_sheet(Program& program, CommandOptions group) {
  auto [app, a] = program.add(
      group, "sheet", "draw all bodies and motions of a file, or all sequences of a folder",
      "restage data sheet benchmark/test.h5 --out test.png\n"
      "restage data sheet benchmark/scans --out scans.png\n"
      "restage data sheet data.h5 --columns 10 --title 'our people' --out people.png",
      run_sheet);
  app.add_option("INPUT", a.input, "data file with bodies (HDF5), or naked/, clothed/ or scans/")
      .required();
  app.add_option("--out", a.out, "sheet.png").required();
  app.add_option("--columns", a.columns, "figures in a row");
  app.add_option("--title", a.title, "a line at the top");
}

}  // namespace restage::cli
