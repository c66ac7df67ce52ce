#include "pade/paper/tables/beyond_tables.hpp"

#include <array>

#include <fmt/format.h>

#include "pade/paper/experiment/experiment_chain.hpp"
#include "pade/report/plot/plot.hpp"
#include "pade/report/report_text.hpp"

namespace pade::experiment {
namespace {

using evaluation::DepthAccuracy;
using evaluation::MotionNoise;
using evaluation::NoiseModel;
using evaluation::number_text;
using evaluation::percent_text;

constexpr std::size_t kShownRanges = 4;
constexpr std::array kShownNames = {"0-4 m", "4-8 m", "8-12 m", "12-16 m"};

DepthAccuracy accuracy(const Results& results, std::string_view cell, const MotionNoise& noise) {
  return mean_over(results.cells("beyond", "", cell, noise));
}

std::string noise_text(const MotionNoise& noise) {
  if (noise.level == 0) return "none";
  return fmt::format("{}, {:.0f} %", to_name(noise.model), 100 * noise.level);
}

}  // namespace

evaluation::ResultTable beyond_table(const Results& results) {
  evaluation::ResultTable table;
  table.name = "beyond";
  table.command = command_of(results.options, table.name);
  table.title = "Beyond the paper: the chain, one step after the other";
  table.note =
      "Mean absolute depth error in m (median; coverage), pooled over the pixels of a sequence and averaged "
      "over "
      "sequences, from the first depth image of each on. All pixels with truth; a depth beyond the range "
      "limit is "
      "none; doubtful pixels are left out, but for literal PADE. Noise is on each step between two frames, "
      "drawn "
      "once per sequence, and the chain is told its covariance. In brackets the mean after one common scale "
      "per "
      "frame, the median of depth over truth: the scale comes from GPS/INS alone, the rest the images can "
      "know.";
  table.columns = {"noise", "depth"};
  for (const char* range : kShownNames) table.columns.emplace_back(range);
  for (const MotionNoise& noise : chain_noises()) {
    for (const ChainMethod& method : chain_methods()) {
      if (noise.level == 0 && method.only_with_noise) continue;
      std::vector<std::string> row = {noise_text(noise), std::string(method.meaning)};
      const DepthAccuracy all = accuracy(results, method.name, noise);
      const DepthAccuracy one_scale = accuracy(results, scaled_cell(method.name), noise);
      for (std::size_t i = 0; i < kShownRanges; ++i) {
        const auto& range = all.ranges.at(i);
        row.push_back(range.pixels == 0
                          ? "–"
                          : fmt::format("{} ({}; {}) [{}]", number_text(range.mean, 3),
                                        number_text(range.median, 3), percent_text(range.coverage),
                                        number_text(one_scale.ranges.at(i).mean, 3)));
      }
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

Result<Plots> beyond_plots(const Results& results) {
  Plots plots;
  for (const MotionNoise& noise : {MotionNoise{}, MotionNoise{NoiseModel::multiplicative, 0.20},
                                   MotionNoise{NoiseModel::additive, 0.10}}) {
    evaluation::LinePlot plot;
    plot.frame.title = noise.level == 0 ? "exact poses" : fmt::format("noise: {}", noise_text(noise));
    plot.frame.x_label = "true depth [m]";
    plot.frame.y_label = "absolute depth error [m]";
    plot.frame.width = 560;
    plot.frame.height = 420;
    int style = 0;
    for (const ChainMethod& method : chain_methods()) {
      evaluation::LineSeries series{std::string(method.meaning), {}, {}, {}, {}, {style, 0, style}};
      ++style;
      if (noise.level == 0 && method.only_with_noise) continue;
      const DepthAccuracy all = accuracy(results, method.name, noise);
      for (std::size_t i = 0; i < kShownRanges; ++i) {
        series.x.push_back(2 + 4 * static_cast<double>(i));
        series.y.push_back(all.ranges.at(i).mean);
      }
      plot.series.push_back(std::move(series));
    }
    for (std::size_t i = 0; i < kShownRanges; ++i)
      plot.x_ticks.emplace_back(2 + 4 * static_cast<double>(i), kShownNames.at(i));
    auto svg = evaluation::line_plot(plot);
    if (!svg) return svg.error();
    plots.push_back(std::move(svg).value());
  }
  return plots;
}

}  // namespace pade::experiment
