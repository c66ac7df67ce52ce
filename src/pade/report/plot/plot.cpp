#include "pade/report/plot/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "pade/report/plot/gnuplot.hpp"
#include "pade/report/plot/inline_svg.hpp"

namespace pade::evaluation {
namespace {

// Okabe and Ito, Color Universal Design, 2008; yellow is left out, it cannot be seen on white.
constexpr std::array<std::string_view, 7> kColours = {"0072b2", "d55e00", "009e73", "cc79a7",
                                                      "56b4e9", "e69f00", "000000"};
constexpr std::array<std::string_view, 4> kDashes = {"1", "(9,5)", "(2,4)", "(12,4,2,4)"};
constexpr std::array<int, 6> kMarks = {7, 5, 9, 11, 13, 6};   // of gnuplot's SVG terminal
constexpr std::array<int, 6> kPatterns = {3, 4, 1, 5, 2, 6};  // solid, hatched, crossed, ...
constexpr std::string_view kBandOpacity = "c8";               // ff is invisible
constexpr double kBarsOfGroup = 0.8;                          // of the distance of groups

template <class Choices>
auto choose(const Choices& choices, std::optional<int> wanted, std::size_t place) {
  const auto index = wanted ? static_cast<std::size_t>(std::max(0, *wanted)) : place;
  return choices[index % choices.size()];
}

std::string number(double value) { return std::isfinite(value) ? fmt::format("{:.9g}", value) : "NaN"; }

// What all values of a plot must be, and what they span.
struct Span {
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();
  void add(const std::vector<double>& values) {
    for (const double value : values) {
      if (!std::isfinite(value)) continue;
      least = std::min(least, value);
      most = std::max(most, value);
    }
  }
  [[nodiscard]] bool empty() const { return most < least; }
};

std::string plot_name(const PlotFrame& frame) {
  return fmt::format("plot \"{}\"", frame.title.empty() ? frame.y_label : frame.title);
}

Status check_length(const PlotFrame& frame, const std::string& series, std::string_view what,
                    std::size_t found, std::size_t expected) {
  if (found == expected) return {};
  return Error{fmt::format("{}: series \"{}\": found {} values of {}, expected {}", plot_name(frame), series,
                           found, what, expected)};
}

Status check_band(const PlotFrame& frame, const std::string& series, const std::vector<double>& low,
                  const std::vector<double>& high, std::size_t expected) {
  if (low.empty() && high.empty()) return {};
  if (Status status = check_length(frame, series, "low", low.size(), expected); !status) return status;
  return check_length(frame, series, "high", high.size(), expected);
}

Status check_axis(const PlotFrame& frame, const Span& span, std::string_view axis, bool is_log) {
  if (span.empty())
    return Error{fmt::format("{}: found no finite {}, expected at least one", plot_name(frame), axis)};
  if (is_log && !(span.least > 0)) {
    return Error{fmt::format("{}: found {} = {:g}, expected positive values on a logarithmic axis",
                             plot_name(frame), axis, span.least)};
  }
  return {};
}

// Terminal, labels and the y axis. Grid and frame are light, so that the data stands out.
std::string head(const PlotFrame& frame, const Span& y) {
  std::string script = fmt::format(
      "set encoding utf8\n"
      "set terminal svg size {},{} dynamic noenhanced font 'sans-serif,13' dashlength 0.6\n"
      "set border 3 linecolor rgb '#5b6875'\n"
      "set tics nomirror out scale 0.7\n"
      "set grid linecolor rgb '#d5dbe1' linewidth 1 dashtype 1\n"
      "set key bmargin center horizontal Left reverse samplen 4 height 1\n"
      "set title {}\nset xlabel {} offset 0,0.6\nset ylabel {}\n",
      frame.width, frame.height, gnuplot_string(frame.title), gnuplot_string(frame.x_label),
      gnuplot_string(frame.y_label));
  if (frame.log_y)
    script += "set logscale y\n";
  else if (y.least < 0)
    script += "set xzeroaxis linetype 1 linecolor rgb '#1b2530' linewidth 1\n";
  else if (frame.y_from_zero)
    script += fmt::format("set yrange [0:{}]\n", y.most > 0 ? "*" : "1");
  return script;
}

std::string ticks(const std::vector<std::pair<double, std::string>>& at) {
  std::string list;
  for (const auto& [x, label] : at)
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", gnuplot_string(label), number(x));
  return fmt::format("set xtics ({})\n", list);
}

// A data block of gnuplot: one row per value of the first column.
std::string block(std::size_t index, const std::vector<const std::vector<double>*>& columns) {
  std::string text = fmt::format("$d{} << END_OF_DATA\n", index);
  for (std::size_t row = 0; row < columns.front()->size(); ++row) {
    for (const auto* column : columns) text += number((*column)[row]) + ' ';
    text += '\n';
  }
  return text + "END_OF_DATA\n";
}

std::string joined(const std::vector<std::string>& parts) {
  std::string line = "plot ";
  for (std::size_t i = 0; i < parts.size(); ++i) line += (i == 0 ? "" : ", ") + parts[i];
  return line + "\n";
}

Result<std::string> draw(const PlotFrame& frame, const std::string& script) {
  Result<std::string> svg = run_gnuplot(script);
  if (!svg) return Error{fmt::format("{}: {}", plot_name(frame), svg.error().message)};
  return inline_svg(*svg, id_of(frame.id, script), frame.title.empty() ? frame.y_label : frame.title);
}

Status check(const LinePlot& plot, const Span& x, const Span& y) {
  for (const LineSeries& series : plot.series) {
    const std::size_t count = series.x.size();
    if (Status status = check_length(plot.frame, series.name, "y", series.y.size(), count); !status)
      return status;
    if (Status status = check_band(plot.frame, series.name, series.low, series.high, count); !status)
      return status;
  }
  if (Status status = check_axis(plot.frame, x, "x", plot.log_x); !status) return status;
  return check_axis(plot.frame, y, "y", plot.frame.log_y);
}

std::string line_command(const LineSeries& series, std::size_t index) {
  const std::string_view with = series.style.line && series.style.marks ? "linespoints"
                                : series.style.line                     ? "lines"
                                                                        : "points";
  std::string command = fmt::format("$d{} using 1:2 with {} linecolor rgb '#{}'", index, with,
                                    choose(kColours, series.style.colour, index));
  if (series.style.line)
    command += fmt::format(" linewidth 2 dashtype {}", choose(kDashes, series.style.dash, index));
  if (with != "lines")
    command += fmt::format(" pointtype {} pointsize 0.8", choose(kMarks, series.style.mark, index));
  return command + fmt::format(" title {}", gnuplot_string(series.name));
}

}  // namespace

Result<std::string> line_plot(const LinePlot& plot) {
  Span x, y;
  for (const LineSeries& series : plot.series) {
    x.add(series.x);
    for (const auto* values : {&series.y, &series.low, &series.high}) y.add(*values);
  }
  if (Status status = check(plot, x, y); !status) return status.error();
  std::string script = head(plot.frame, y);
  if (plot.log_x)  // by itself gnuplot would go on to the next decade
    script += fmt::format("set logscale x\nset xrange [{}:{}]\n", x.least / 1.1, x.most * 1.1);
  if (!plot.x_ticks.empty()) script += ticks(plot.x_ticks);
  std::vector<std::string> bands, lines;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const LineSeries& series = plot.series[i];
    if (series.low.empty()) {
      script += block(i, {&series.x, &series.y});
    } else {
      script += block(i, {&series.x, &series.y, &series.low, &series.high});
      bands.push_back(fmt::format("$d{} using 1:3:4 with filledcurves fillcolor rgb '#{}{}' notitle", i,
                                  kBandOpacity, choose(kColours, series.style.colour, i)));
    }
    lines.push_back(line_command(series, i));
  }
  bands.insert(bands.end(), lines.begin(), lines.end());  // lines over all bands
  return draw(plot.frame, script + joined(bands));
}

Result<std::string> bar_plot(const BarPlot& plot) {
  Span y;
  for (const BarSeries& series : plot.series) {
    const std::size_t count = plot.groups.size();
    if (Status status = check_length(plot.frame, series.name, "groups", series.values.size(), count); !status)
      return status.error();
    if (Status status = check_band(plot.frame, series.name, series.low, series.high, count); !status)
      return status.error();
    for (const auto* values : {&series.values, &series.low, &series.high}) y.add(*values);
  }
  if (Status status = check_axis(plot.frame, y, "value", plot.frame.log_y); !status) return status.error();
  std::string script = head(plot.frame, y);
  std::vector<std::pair<double, std::string>> names;
  for (const std::string& group : plot.groups) names.emplace_back(names.size(), group);
  script += ticks(names);
  script +=
      fmt::format("set xrange [-0.6:{}]\nset grid noxtics\n", static_cast<double>(plot.groups.size()) - 0.4);
  const double width = kBarsOfGroup / static_cast<double>(plot.series.size());
  std::vector<std::string> bars, whiskers;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const BarSeries& series = plot.series[i];
    std::vector<double> at;
    for (std::size_t group = 0; group < plot.groups.size(); ++group)
      at.push_back(static_cast<double>(group) + (static_cast<double>(i) + 0.5) * width - 0.5 * kBarsOfGroup);
    bars.push_back(
        fmt::format("$d{} using 1:2:({}) with boxes fillstyle pattern {} linecolor rgb '#{}' title {}", i,
                    number(0.92 * width), choose(kPatterns, std::nullopt, i),
                    choose(kColours, series.colour, i), gnuplot_string(series.name)));
    if (series.low.empty()) {
      script += block(i, {&at, &series.values});
    } else {
      script += block(i, {&at, &series.values, &series.low, &series.high});
      whiskers.push_back(
          fmt::format("$d{} using 1:($3+0*$2):(0):($4-$3) with vectors heads size graph 0.008,90 linewidth "
                      "1.5 linecolor rgb "
                      "'#1b2530' notitle",
                      i));
    }
  }
  bars.insert(bars.end(), whiskers.begin(), whiskers.end());
  return draw(plot.frame, script + joined(bars));
}

}  // namespace pade::evaluation
