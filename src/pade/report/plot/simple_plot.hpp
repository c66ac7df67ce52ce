// Curves and points as SVG within an HTML page, drawn without another program.
#pragma once

#include <cmath>
#include <string>
#include <vector>

namespace pade::evaluation {

/// Points, joined or not.
struct Series {
  std::string name;
  std::string colour;
  std::vector<double> x;
  std::vector<double> y;
  bool dots = false;  ///< not joined

  /// Appends a point; one that is not finite is left out.
  void add(double at, double value) {
    if (!std::isfinite(at) || !std::isfinite(value)) return;
    x.push_back(at);
    y.push_back(value);
  }
};

/// A figure with a title, axes and a legend. `equal`: same scale on both axes.
std::string simple_plot(const std::string& title, const std::string& x_label, const std::string& y_label,
                        const std::vector<Series>& series, bool equal);

/// Events in rows: y = 0 is the first name's, at the top. The legend counts them.
std::string rows_plot(const std::string& title, const std::string& x_label,
                      const std::vector<std::string>& names, const std::vector<Series>& series);

}  // namespace pade::evaluation
