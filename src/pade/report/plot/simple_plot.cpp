#include "pade/report/plot/simple_plot.hpp"

#include <algorithm>
#include <iterator>
#include <limits>

#include <fmt/format.h>

namespace pade::evaluation {
namespace {

/// Tick distance: 1, 2 or 5 times a power of ten, about five of them in the range.
double tick_step(double range) {
  const double rough = range / 5;
  const double power = std::pow(10, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough) return factor * power;
  }
  return 10 * power;
}

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  void pad() {
    if (!(high > low)) {
      const double middle = std::isfinite(low) ? low : 0;
      low = middle - 0.5;
      high = middle + 0.5;
    }
    const double margin = 0.04 * (high - low);
    low -= margin;
    high += margin;
  }
};

/// Ticks of a horizontal axis at height `y`, with their numbers.
template <class ToPixels>
std::string ticks_below(const Range& x, const ToPixels& px, double y) {
  std::string svg;
  const double step = tick_step(x.high - x.low);
  for (double v = std::ceil(x.low / step) * step; v <= x.high; v += step) {
    fmt::format_to(std::back_inserter(svg),
                   "<path d=\"M{:.1f} {:.1f}v4\" stroke=\"#8893a0\"/><text x=\"{:.1f}\" y=\"{:.1f}\" "
                   "text-anchor=\"middle\">{:.6g}</text>\n",
                   px(v), y, px(v), y + 17, std::abs(v) < 1e-9 * step ? 0 : v);
  }
  return svg;
}

/// A frame with a title around what is drawn.
std::string figure(const std::string& title, double width, double height, const std::string& drawn) {
  return fmt::format(
      "<figure><figcaption>{}</figcaption><svg class=\"plot\" viewBox=\"0 0 {} {}\" role=\"img\" "
      "aria-label=\"{}\">\n{}</svg></figure>\n",
      title, width, height, title, drawn);
}

}  // namespace

std::string simple_plot(const std::string& title, const std::string& x_label, const std::string& y_label,
                        const std::vector<Series>& series, bool equal) {
  constexpr double kWidth = 760;
  constexpr double kLeft = 62;
  constexpr double kTop = 12;
  const double height = equal ? 520 : 250;
  const double inner_width = kWidth - kLeft - 12;
  const double inner_height = height - kTop - 42;
  Range x;
  Range y;
  for (const Series& s : series) {
    for (const double value : s.x) x.include(value);
    for (const double value : s.y) y.include(value);
  }
  x.pad();
  y.pad();
  if (equal) {
    const double scale = std::max((x.high - x.low) / inner_width, (y.high - y.low) / inner_height);
    const auto widen = [&](Range& r, double pixels) {
      const double middle = 0.5 * (r.low + r.high);
      r = {middle - 0.5 * scale * pixels, middle + 0.5 * scale * pixels};
    };
    widen(x, inner_width);
    widen(y, inner_height);
  }
  const auto px = [&](double v) { return kLeft + (v - x.low) / (x.high - x.low) * inner_width; };
  const auto py = [&](double v) { return kTop + (y.high - v) / (y.high - y.low) * inner_height; };

  std::string svg;
  const auto out = std::back_inserter(svg);
  fmt::format_to(out,
                 "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#8893a0\"/>\n",
                 kLeft, kTop, inner_width, inner_height);
  svg += ticks_below(x, px, kTop + inner_height);
  const double dy = tick_step(y.high - y.low);
  for (double v = std::ceil(y.low / dy) * dy; v <= y.high; v += dy) {
    fmt::format_to(out,
                   "<path d=\"M{:.1f} {:.1f}h{:.1f}\" stroke=\"#8893a033\"/><text x=\"{:.1f}\" y=\"{:.1f}\" "
                   "text-anchor=\"end\">{:.6g}</text>\n",
                   kLeft, py(v), inner_width, kLeft - 6, py(v) + 4, std::abs(v) < 1e-9 * dy ? 0 : v);
  }
  fmt::format_to(out, "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                 kLeft + 0.5 * inner_width, height - 6, x_label);
  fmt::format_to(out,
                 "<text transform=\"translate(13 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                 kTop + 0.5 * inner_height, y_label);
  for (const Series& s : series) {
    if (s.dots) {
      fmt::format_to(out, "<g fill=\"{}\" fill-opacity=\"0.6\">", s.colour);
      for (std::size_t i = 0; i < s.x.size(); ++i)
        fmt::format_to(out, "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"1.3\"/>", px(s.x[i]), py(s.y[i]));
      svg += "</g>\n";
    } else if (!s.x.empty()) {
      fmt::format_to(out, "<path fill=\"none\" stroke=\"{}\" stroke-width=\"1.4\" d=\"", s.colour);
      for (std::size_t i = 0; i < s.x.size(); ++i)
        fmt::format_to(out, "{}{:.1f} {:.1f}", i == 0 ? 'M' : 'L', px(s.x[i]), py(s.y[i]));
      svg += "\"/>\n";
    }
  }
  double legend = kLeft + 10;
  for (const Series& s : series) {
    fmt::format_to(out,
                   "<rect x=\"{:.1f}\" y=\"{}\" width=\"12\" height=\"4\" fill=\"{}\"/><text x=\"{:.1f}\" "
                   "y=\"{}\">{}</text>\n",
                   legend, kTop + 11, s.colour, legend + 17, kTop + 17, s.name);
    legend += 30 + 7.0 * static_cast<double>(s.name.size());
  }
  return figure(title, kWidth, height, svg);
}

std::string rows_plot(const std::string& title, const std::string& x_label,
                      const std::vector<std::string>& names, const std::vector<Series>& series) {
  constexpr double kWidth = 760;
  constexpr double kLeft = 62;
  constexpr double kTop = 30;
  constexpr double kRow = 13;
  const double inner_width = kWidth - kLeft - 12;
  const double inner_height = kRow * static_cast<double>(names.size());
  const double height = kTop + inner_height + 42;
  Range x;
  for (const Series& s : series) {
    for (const double value : s.x) x.include(value);
  }
  x.pad();
  const auto px = [&](double v) { return kLeft + (v - x.low) / (x.high - x.low) * inner_width; };
  std::string svg;
  const auto out = std::back_inserter(svg);
  fmt::format_to(out,
                 "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#8893a0\"/>\n",
                 kLeft, kTop, inner_width, inner_height);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double y = kTop + kRow * (static_cast<double>(i) + 0.5);
    fmt::format_to(out,
                   "<path d=\"M{:.1f} {:.1f}h{:.1f}\" stroke=\"#8893a033\"/><text x=\"{:.1f}\" y=\"{:.1f}\" "
                   "text-anchor=\"end\">{}</text>\n",
                   kLeft, y, inner_width, kLeft - 6, y + 4, names[i]);
  }
  svg += ticks_below(x, px, kTop + inner_height);
  fmt::format_to(out, "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                 kLeft + 0.5 * inner_width, height - 6, x_label);
  double legend = kLeft;
  for (const Series& s : series) {
    fmt::format_to(out, "<g stroke=\"{}\" stroke-width=\"1.6\" stroke-opacity=\"0.8\">", s.colour);
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      fmt::format_to(out, "<path d=\"M{:.1f} {:.1f}v{}\"/>", px(s.x[i]), kTop + kRow * s.y[i] + 2, kRow - 4);
    }
    const std::string name = fmt::format("{}: {}", s.name, s.x.size());
    fmt::format_to(
        out,
        "</g>\n<rect x=\"{:.1f}\" y=\"12\" width=\"12\" height=\"4\" fill=\"{}\"/><text x=\"{:.1f}\" "
        "y=\"18\">{}</text>\n",
        legend, s.colour, legend + 17, name);
    legend += 30 + 7.0 * static_cast<double>(name.size());
  }
  return figure(title, kWidth, height, svg);
}

}  // namespace pade::evaluation
