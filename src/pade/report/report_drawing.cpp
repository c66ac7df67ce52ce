#include "pade/report/report_drawing.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pade/report/report_pictures.hpp"

namespace pade::evaluation {
namespace {

struct Scale {
  double across = 1, upward = 1;  // pixels per metre
};

Scale scale_of(const Drawing& drawing, double width, double height, double lowest) {
  const double scale = std::min(width / drawing.across.length(), height / drawing.upward.length());
  return {scale, std::max(scale, lowest / drawing.upward.length())};
}

class Svg {
 public:
  Svg(const Drawing& drawing, const Scale& scale)
      : drawing_(drawing),
        scale_(scale),
        width_(scale.across * drawing.across.length()),
        height_(scale.upward * drawing.upward.length()) {}

  [[nodiscard]] std::string draw() const {
    // Room around for the numbers at the axes.
    std::string svg = fmt::format(
        R"(<svg class="map" viewBox="-58 -8 {:.0f} {:.0f}" role="img" aria-label="{}" style="max-width:{:.0f}px">)",
        width_ + 78, height_ + 62, drawing_.title, width_ + 78);
    svg += fmt::format(
        R"(<image href="{}" width="{:.1f}" height="{:.1f}" preserveAspectRatio="none" style="image-rendering:pixelated"/>)",
        png_uri(drawing_.picture, 4096, false), width_, height_);
    svg += fmt::format(R"(<rect class="frame" width="{:.1f}" height="{:.1f}"/>)", width_, height_);
    return svg + axes() + path() + corridor() + scale_bar() + "</svg>";
  }

 private:
  [[nodiscard]] double x(double value) const {
    const DrawingAxis& axis = drawing_.across;
    return (value - axis.from) / (axis.to - axis.from) * width_;
  }
  [[nodiscard]] double y(double value) const {
    const DrawingAxis& axis = drawing_.upward;
    return (axis.to - value) / (axis.to - axis.from) * height_;
  }

  /// Round values on an axis, with their text.
  static std::vector<double> ticks(const DrawingAxis& axis, double pixels_per_metre) {
    const double step = round_up_125(60 / pixels_per_metre);
    const auto [low, high] = std::minmax(axis.from, axis.to);
    std::vector<double> values;
    for (double value = std::ceil(low / step) * step; value <= high; value += step) values.push_back(value);
    return values;
  }
  static std::string number(double value) { return fmt::format("{:g}", std::abs(value) < 1e-9 ? 0 : value); }

  [[nodiscard]] std::string axes() const {
    std::string svg;
    for (const double v : ticks(drawing_.across, scale_.across)) {
      svg += fmt::format(
          R"(<path class="tick" d="M{0:.1f} {1:.1f}v5"/><text x="{0:.1f}" y="{2:.1f}" text-anchor="middle">{3}</text>)",
          x(v), height_, height_ + 19, number(v));
    }
    for (const double v : ticks(drawing_.upward, scale_.upward)) {
      svg += fmt::format(
          R"(<path class="tick" d="M-5 {0:.1f}h5"/><text x="-9" y="{1:.1f}" text-anchor="end">{2}</text>)",
          y(v), y(v) + 4, number(v));
    }
    svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{} [m]</text>)", width_ / 2,
                       height_ + 38, drawing_.across.name);
    svg += fmt::format(
        R"svg(<text transform="translate(-44 {:.1f}) rotate(-90)" text-anchor="middle">{} [m]</text>)svg",
        height_ / 2, drawing_.upward.name);
    return svg;
  }

  [[nodiscard]] std::string points(const DrawingLine& line) const {
    std::string text;
    for (const auto& point : line) text += fmt::format("{:.1f},{:.1f} ", x(point[0]), y(point[1]));
    return text;
  }

  [[nodiscard]] std::string path() const {
    const DrawingLine& line = drawing_.path;
    if (line.empty()) return {};
    std::string svg = fmt::format(
        R"(<polyline class="halo" points="{0}"/><polyline class="path" points="{0}"/>)", points(line));
    svg += fmt::format(R"(<circle class="start" cx="{:.1f}" cy="{:.1f}" r="5"/>)", x(line.front()[0]),
                       y(line.front()[1]));
    svg += fmt::format(R"(<path class="end" d="M{:.1f} {:.1f}l6 6 -6 6 -6 -6z"/>)", x(line.back()[0]),
                       y(line.back()[1]) - 6);
    return svg;
  }

  [[nodiscard]] std::string corridor() const {
    std::string svg;
    for (const DrawingLine& line : drawing_.corridor)
      svg += fmt::format(R"(<polyline class="corridor" points="{}"/>)", points(line));
    return svg;
  }

  [[nodiscard]] std::string scale_bar() const {
    const double length = round_up_125(0.08 * width_ / scale_.across);
    const double right = width_ - 12, left = right - length * scale_.across, at = height_ - 14;
    return fmt::format(
        R"(<rect class="plate" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="30"/><path class="scale" d="M{:.1f} {:.1f}v6h{:.1f}v-6"/><text x="{:.1f}" y="{:.1f}" text-anchor="middle">{:g} m</text>)",
        std::min(left, right - 34) - 6, at - 20, std::max(right - left, 34.0) + 12, left, at - 2,
        right - left, 0.5 * (left + right), at - 6, length);
  }

  const Drawing& drawing_;
  Scale scale_;
  double width_, height_;
};

}  // namespace

std::string to_svg(const Drawing& drawing, double width, double height, double lowest) {
  return Svg(drawing, scale_of(drawing, width, height, lowest)).draw();
}

double stretch_of(const Drawing& drawing, double width, double height, double lowest) {
  const Scale scale = scale_of(drawing, width, height, lowest);
  return scale.upward / scale.across;
}

}  // namespace pade::evaluation
