// Plots for reports and documents, drawn by gnuplot as SVG that can stand inside an HTML page. Colours are
// those of Okabe and Ito, which the colour-blind can tell apart; lines differ in dash and mark and bars in
// pattern as well, so that they can be read in grey print.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pade/core/result.hpp"

namespace pade::evaluation {

/// How a series is drawn; if empty, by its place in the plot. Series that belong together share a number.
struct SeriesStyle {
  std::optional<int>
      colour;               ///< 0 blue, 1 vermilion, 2 green, 3 purple, 4 sky, 5 orange, 6 black; then again
  std::optional<int> dash;  ///< 0 solid, 1 dashed, 2 dotted, 3 dash-dotted; then again
  std::optional<int>
      mark;           ///< 0 disc, 1 square, 2 triangle, 3 inverted triangle, 4 diamond, 5 circle; then again
  bool line = true;   ///< joins the points
  bool marks = true;  ///< marks the points
};

/// A function of x, with a band if `low` and `high` are given.
struct LineSeries {
  std::string name;
  std::vector<double> x, y;                 ///< of one length; NaN leaves a gap
  std::vector<double> low = {}, high = {};  ///< both empty, or of that length
  SeriesStyle style = {};
};

/// Where to find things, common to all plots.
struct PlotFrame {
  std::string title;              ///< may be empty
  std::string x_label;            ///< with unit: "noise [%]"
  std::string y_label;            ///< with unit
  bool log_y = false;             ///< all y must be positive
  bool y_from_zero = true;        ///< if linear, the axis starts at 0
  int width = 640, height = 400;  ///< px; the picture scales with the page
  std::string id = {};  ///< begins all ids of the SVG, unique in the page; made from the content if empty
};

struct LinePlot {
  PlotFrame frame;
  bool log_x = false;
  std::vector<LineSeries> series;
  std::vector<std::pair<double, std::string>> x_ticks;  ///< in place of round numbers; empty = round numbers
};

/// One bar per group, with whiskers if `low` and `high` are given.
struct BarSeries {
  std::string name;
  std::vector<double> values;               ///< per group; NaN = no bar
  std::vector<double> low = {}, high = {};  ///< both empty, or per group
  std::optional<int> colour = {};           ///< as in SeriesStyle
};

struct BarPlot {
  PlotFrame frame;
  std::vector<std::string> groups;
  std::vector<BarSeries> series;
};

/// The <svg> element: no XML declaration, no fixed size, nothing from outside, its ids begin with frame.id.
/// The same plot gives the same bytes with the same version of gnuplot.
/// Errors: gnuplot missing or failing; lengths of a series that do not fit; nothing finite to plot.
Result<std::string> line_plot(const LinePlot& plot);
Result<std::string> bar_plot(const BarPlot& plot);

}  // namespace pade::evaluation
