#include "pade/paper/tables/experiment_plots.hpp"

#include <array>

#include <fmt/format.h>

#include "pade/report/plot/plot.hpp"

namespace pade::experiment {
namespace {

using evaluation::LinePlot;
using evaluation::LineSeries;
using evaluation::MotionNoise;
using evaluation::NoiseModel;

constexpr std::size_t kRanges = 4;
constexpr std::array kRangeNames = {"0-4 m", "4-8 m", "8-12 m", "12-16 m"};

/// How a method looks in every plot.
evaluation::SeriesStyle style_of(std::string_view cell) {
  if (cell == ttc) return {1, 0, 1};
  if (cell == pade_literal) return {0, 0, 0};
  if (cell == pade_exact) return {2, 0, 2};
  if (cell == ttc_exact) return {5, 0, 4};
  return {6, 2, 5};
}

void add_point(LineSeries& series, double x, const evaluation::Interval& y, bool band) {
  series.x.push_back(x);
  series.y.push_back(y.estimate);
  if (!band) return;
  const bool known = y.low <= y.high;
  series.low.push_back(known ? y.low : y.estimate);
  series.high.push_back(known ? y.high : y.estimate);
}

LinePlot plot_of(std::string title, std::string x, int width, int height) {
  LinePlot plot;
  plot.frame.title = std::move(title);
  plot.frame.x_label = std::move(x);
  plot.frame.y_label = "absolute depth error [m]";
  plot.frame.width = width;
  plot.frame.height = height;
  return plot;
}

Status draw(const LinePlot& plot, Plots& plots) {
  auto svg = evaluation::line_plot(plot);
  if (!svg) return svg.error();
  plots.push_back(std::move(svg).value());
  return {};
}

std::string_view model_text(NoiseModel model) {
  return model == NoiseModel::multiplicative ? "multiplicative" : "additive";
}

}  // namespace

Result<Plots> figure3_by_range(const Results& results) {
  Plots plots;
  const double level = noise_levels.back();
  for (const std::string& flow : flows_of(results.options, "figure3")) {
    for (const NoiseModel model : {NoiseModel::multiplicative, NoiseModel::additive}) {
      LinePlot plot = plot_of(fmt::format("{}, {} noise of {:.0f} %", flow, model_text(model), 100 * level),
                              "true depth [m]", 560, 420);
      const auto add = [&](std::string name, const NoisePoint& point, evaluation::SeriesStyle style,
                           bool band) {
        LineSeries series{std::move(name), {}, {}, {}, {}, style};
        for (std::size_t i = 0; i < kRanges; ++i)
          add_point(series, 2 + 4 * static_cast<double>(i), point.ranges.at(i), band);
        plot.series.push_back(std::move(series));
      };
      for (const std::string_view cell : {ttc, pade_literal, pade_exact}) {
        evaluation::SeriesStyle clean = style_of(cell);
        clean.dash = 2;
        add(shown_name(cell) + ", no noise", noise_point(results, flow, cell, {}), clean, false);
        add(shown_name(cell) + ", noise", noise_point(results, flow, cell, {model, level}), style_of(cell),
            true);
      }
      add("bound, noise", bound_point(results, flow, {model, level}), style_of(""), false);
      for (std::size_t i = 0; i < kRanges; ++i)
        plot.x_ticks.emplace_back(2 + 4 * static_cast<double>(i), kRangeNames.at(i));
      if (Status drawn = draw(plot, plots); !drawn) return drawn.error();
    }
  }
  return plots;
}

Result<Plots> figure3_by_level(const Results& results) {
  Plots plots;
  for (const std::string& flow : flows_of(results.options, "figure3")) {
    for (const NoiseModel model : {NoiseModel::multiplicative, NoiseModel::additive}) {
      for (std::size_t range = 0; range < kRanges; ++range) {
        LinePlot plot =
            plot_of(fmt::format("{}, {}", kRangeNames.at(range), model_text(model)), "noise [%]", 420, 320);
        for (const std::string_view cell : {ttc, pade_literal, pade_exact, std::string_view("bound")}) {
          LineSeries series{shown_name(cell), {}, {}, {}, {}, style_of(cell)};
          for (const double level : noise_levels) {
            const MotionNoise noise{model, level};
            const NoisePoint point =
                cell == "bound" ? bound_point(results, flow, noise) : noise_point(results, flow, cell, noise);
            add_point(series, 100 * level, point.ranges.at(range), cell != "bound");
          }
          plot.series.push_back(std::move(series));
        }
        if (Status drawn = draw(plot, plots); !drawn) return drawn.error();
      }
    }
  }
  return plots;
}

Result<Plots> windows_plots(const Results& results) {
  Plots plots;
  for (const std::string& flow : flows_of(results.options, "windows")) {
    for (std::size_t range = 0; range < kRanges; ++range) {
      LinePlot plot = plot_of(fmt::format("{}, {}", flow, kRangeNames.at(range)), "window n [px]", 420, 320);
      plot.log_x = true;
      for (const int n : window_sizes) plot.x_ticks.emplace_back(n, std::to_string(n));
      for (const std::string_view cell : {ttc, pade_literal, pade_exact, ttc_exact}) {
        LineSeries series{shown_name(cell), {}, {}, {}, {}, style_of(cell)};
        for (const int n : window_sizes) {
          const auto accuracy = mean_over(results.cells("windows", flow, fmt::format("{}-n{}", cell, n)));
          add_point(series, n, {accuracy.ranges.at(range).mean}, false);
        }
        plot.series.push_back(std::move(series));
      }
      if (Status drawn = draw(plot, plots); !drawn) return drawn.error();
    }
  }
  return plots;
}

Result<Plots> table1_plots(const Results& results) {
  Plots plots;
  for (const std::string_view cell : {ttc, pade_literal, pade_exact}) {
    evaluation::BarPlot plot;
    plot.frame.title = shown_name(cell);
    plot.frame.y_label = "absolute depth error [m]";
    plot.frame.width = 560;
    plot.frame.height = 360;
    plot.groups.assign(kRangeNames.begin(), kRangeNames.end());
    for (const std::string& flow : flows_of(results.options, "table1")) {
      const auto cells = results.cells("table1", flow, cell);
      evaluation::BarSeries series{flow, {}};
      for (std::size_t range = 0; range < kRanges; ++range) {
        std::vector<double> errors;
        for (const SequenceCell& one : cells) errors.push_back(one.cell->accuracy.ranges.at(range).mean);
        const evaluation::Interval interval = evaluation::bootstrap_mean(errors);
        series.values.push_back(interval.estimate);
        series.low.push_back(interval.low);
        series.high.push_back(interval.high);
      }
      plot.series.push_back(std::move(series));
    }
    auto svg = evaluation::bar_plot(plot);
    if (!svg) return svg.error();
    plots.push_back(std::move(svg).value());
  }
  return plots;
}

}  // namespace pade::experiment
