// restage sweep table: what came of a sweep, in rows.
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/sweep/table_formats.h"

namespace restage::cli {
namespace {

struct TableArguments {
  std::string dir, out;
  tables::TableOptions options;
};

/// A table must not replace what it is made of.
void check_place(const TableArguments& a) {
  if (a.out.empty()) return;
  tables::to_format({}, {}, a.out);  // before any work: is the ending known?
  std::vector<std::string> inputs = {a.dir + "/plan.json", a.dir + "/sweep.yaml"};
  std::error_code code;
  for (std::filesystem::directory_iterator at(a.dir + "/trials", code), end; !code && at != end;
       at.increment(code))
    inputs.push_back(at->path().string() + "/result.json");
  check_output(a.out, inputs);
}

int run_table(TableArguments a, const Common& common) {
  check_place(a);
  const tables::Results results = tables::read_results(a.dir);
  const tables::Table table = tables::make_table(results, a.options);
  if (!a.out.empty()) write_file_atomically(a.out, tables::to_format(table, results, a.out));
  // Bad input has one line, so notices come after all that can still be wrong.
  for (const auto* notices : {&results.notices, &table.notices})
    for (const std::string& notice : *notices) log_warning(on_one_line(notice));
  if (common.json) {
    print_json(tables::to_json(table, results));
  } else {
    print(tables::to_markdown(table, results));
  }
  if (!a.out.empty()) log_info("wrote " + a.out);
  return 0;
}

}  // namespace

void add_sweep_table(Program& program, CommandOptions group) {
  auto [app, a] = program.add(
      group, "table", "mean, deviation and 95 % interval of a sweep's trials, in rows",
      "restage sweep table runs/smoothness\n"
      "restage sweep table runs/smoothness --columns pa_mpjpe,acc --against quaternion\n"
      "restage sweep table runs/smoothness --rows motion.weights.smoothness --out table.tex",
      run_table);
  app.add_option("DIR", a.dir, "folder of the sweep").required();
  app.add_option("--rows", a.options.rows,
                 "KEY,... to group by, also 'case' (default: case and overrides)")
      .separated_by(',')
      .one_at_a_time();
  app.add_option("--columns", a.options.columns, "METRIC,... to show (default: all)")
      .separated_by(',')
      .one_at_a_time();
  app.add_option("--against", a.options.against, "differences to the row with this label");
  app.add_option("--out", a.out, "F.md, F.csv, F.tex or F.svg to write");
}

}  // namespace restage::cli
