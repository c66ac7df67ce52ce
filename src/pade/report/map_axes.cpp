#include "pade/report/map_axes.hpp"

#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

namespace pade::evaluation {
namespace {

constexpr double kAligned = 0.9998;  // cosine of about a degree

std::string axis_name(const Eigen::Vector3d& direction) {
  int largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  const bool aligned = std::abs(direction[largest]) > kAligned;
  return fmt::format("{}{}{}", direction[largest] < 0 ? "−" : "", "xyz"[largest], aligned ? "" : "′");
}

}  // namespace

MapAxes map_axes(const Eigen::Vector3d& up) {
  // The world axis after the vertical one (x after z, z after y) is least surprising as the first horizontal
  // one.
  int vertical = 0;
  up.cwiseAbs().maxCoeff(&vertical);
  const int first = vertical == 2 ? 0 : vertical == 1 ? 0 : 1;
  Eigen::Vector3d right = Eigen::Vector3d::Unit(first);
  right = (right - right.dot(up) * up).normalized();
  MapAxes axes{{right, up.cross(right), up}, {}};
  for (std::size_t i = 0; i < 3; ++i) axes.name[i] = axis_name(axes.direction[i]);
  return axes;
}

}  // namespace pade::evaluation
