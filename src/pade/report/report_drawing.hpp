// A picture in metres as SVG: axes with numbers, a scale bar, the flight's path over it.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace pade::evaluation {

struct DrawingAxis {
  double from = 0, to = 1;  ///< metres at the left (lower) and at the right (upper) edge; may fall
  std::string name;
  [[nodiscard]] double length() const { return std::abs(to - from); }
};

/// Points (across, upward), metres.
using DrawingLine = std::vector<std::array<double, 2>>;

struct Drawing {
  std::string title;  ///< for who does not see it
  cv::Mat picture;    ///< BGR; fills the axes
  DrawingAxis across, upward;
  DrawingLine path;                   ///< from a circle to a diamond; may be empty
  std::vector<DrawingLine> corridor;  ///< thin lines
};

/// The <svg>, as large as fits `width` x `height` (pixels of the drawing, without its numbers) with one scale
/// for both axes; a drawing lower than `lowest` is stretched upward to it.
std::string to_svg(const Drawing& drawing, double width, double height, double lowest = 0);
/// How much to_svg() stretches heights; 1 = not at all.
double stretch_of(const Drawing& drawing, double width, double height, double lowest);

}  // namespace pade::evaluation
