#include "experiments/cli/training/find_rate.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "experiments/sweep/svg.h"

namespace restage::cli {
namespace {

using tables::Axis;
using tables::colour_of;
using tables::short_number;
using tables::Svg;

constexpr double kPanelWidth = 420, kPanelHeight = 180, kPanelStep = 250;

Json rate_or_null(double rate) { return rate > 0 ? Json(rate) : Json(); }

void draw_sweep(const RateSweep& sweep, double x, double y, Svg* svg) {
  svg->text(x, y - 8, sweep.stage + ": loss over learning rate", "start", 12);
  if (sweep.rates.empty()) return svg->text(x, y + 20, "the first step already failed");
  const auto [low, high] = std::minmax_element(sweep.smoothed.begin(), sweep.smoothed.end());
  const double least = std::min(*low, *std::min_element(sweep.losses.begin(), sweep.losses.end()));
  const Axis across(std::log10(sweep.rates.front()), std::log10(sweep.rates.back()), x,
                    x + kPanelWidth),
      up(least, *high, y + kPanelHeight, y);
  for (const double mark : up.marks()) {
    svg->line(x, up.at(mark), x + kPanelWidth, up.at(mark), "#ddd");
    svg->text(x - 5, up.at(mark) + 4, short_number(mark), "end", 10, "#555");
  }
  for (double decade = std::ceil(across.low); decade <= across.high; ++decade)
    svg->text(across.at(decade), y + kPanelHeight + 14, format("1e%.0f", decade), "middle", 10,
              "#555");
  std::vector<std::pair<double, double>> mean;
  for (size_t i = 0; i < sweep.rates.size(); ++i) {
    const double at = across.at(std::log10(sweep.rates[i]));
    svg->dot(at, up.at(std::min(sweep.losses[i], up.high)), 1.5, "#999");
    mean.emplace_back(at, up.at(sweep.smoothed[i]));
  }
  svg->polyline(mean, colour_of(0));
  if (sweep.steepest == 0) return;
  const double at = across.at(std::log10(sweep.steepest));
  svg->line(at, y, at, y + kPanelHeight, colour_of(1), 2);
  svg->text(at + 4, y + 12, "suggested: " + format("%.2g", sweep.steepest), "start", 11,
            colour_of(1));
}

}  // namespace

Json rates_json(const std::vector<RateSweep>& sweeps) {
  Json list = Json::array();
  for (const RateSweep& s : sweeps)
    list.push_back({{"stage", s.stage},
                    {"suggested", rate_or_null(s.steepest)},
                    {"tenth_of_least", rate_or_null(s.tenth_of_least)},
                    {"steps", s.rates.size()}});
  return {{"stages", list}};
}

std::string rates_markdown(const std::vector<RateSweep>& sweeps) {
  std::vector<std::vector<std::string>> rows{
      {"stage", "suggested rate", "a tenth of the rate of the least loss", "steps"}};
  const auto shown = [](double rate) { return rate > 0 ? format("%.2g", rate) : std::string("-"); };
  std::string lines;
  for (const RateSweep& s : sweeps) {
    rows.push_back(
        {s.stage, shown(s.steepest), shown(s.tenth_of_least), std::to_string(s.rates.size())});
    lines += s.steepest > 0
                 ? s.stage + ".optimiser.schedule.rate=" + shown(s.steepest) + "\n"
                 : s.stage + ": the loss does not fall clearly; try a larger optimiser.batch\n";
  }
  return markdown_table(rows) + "\n" + lines;
}

std::string rates_svg(const std::vector<RateSweep>& sweeps) {
  Svg svg;
  for (size_t i = 0; i < sweeps.size(); ++i)
    draw_sweep(sweeps[i], 60, 30 + kPanelStep * static_cast<double>(i), &svg);
  return svg.document(kPanelWidth + 90,
                      10 + kPanelStep * static_cast<double>(std::max<size_t>(sweeps.size(), 1)));
}

}  // namespace restage::cli
