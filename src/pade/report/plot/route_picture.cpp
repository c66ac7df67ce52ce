#include "pade/report/plot/route_picture.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

namespace pade::evaluation {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using mapping::Occupancy;

constexpr double kAround = 4;       // of the map beside the route, m
constexpr double kMostCells = 600;  // per axis
constexpr double kPixelsPerSide = 900;

/// Of a column of the map between two heights.
Occupancy column(const mapping::MapView& view, double x, double y, double low, double high) {
  Occupancy state = Occupancy::unknown;
  for (double z = low; z <= high; z += view.voxel()) {
    const Occupancy at = view.at({x, y, z});
    if (at == Occupancy::occupied) return at;
    if (at == Occupancy::free) state = at;
  }
  return state;
}

std::string points_of(std::span<const Vector3d> line, const AlignedBox3d& box, char separator = ' ') {
  std::string text;
  for (const Vector3d& p : line)
    text += fmt::format("{:.3f},{:.3f}{}", p.x() - box.min().x(), box.max().y() - p.y(), separator);
  if (!text.empty()) text.pop_back();
  return text;
}

/// The ball, on its way.
std::string moving_ball(std::span<const Vector3d> line, const AlignedBox3d& box, double radius,
                        double seconds) {
  return fmt::format(
      "<circle r='{:.3f}' fill='#1b6ac9' fill-opacity='0.7'><animateMotion dur='{:.1f}s' calcMode='linear' "
      "repeatCount='indefinite' values='{}'/></circle>\n",
      radius, seconds, points_of(line, box, ';'));
}

/// One rectangle for each run of cells of a state in a row.
std::string cells(const mapping::MapView& view, const AlignedBox3d& box, double side) {
  std::string text;
  const double low = box.min().z() + 0.5 * view.voxel();
  for (double y = box.min().y(); y < box.max().y(); y += side) {
    Occupancy run = Occupancy::unknown;
    double begin = box.min().x();
    const auto end_run = [&](double x) {
      if (run == Occupancy::unknown) return;
      text += fmt::format("<rect class='{}' x='{:.3f}' y='{:.3f}' width='{:.3f}' height='{:.3f}'/>\n",
                          run == Occupancy::occupied ? 'o' : 'f', begin - box.min().x(),
                          box.max().y() - y - side, x - begin, side);
    };
    for (double x = box.min().x(); x < box.max().x(); x += side) {
      const Occupancy state = column(view, x + side / 2, y + side / 2, low, box.max().z());
      if (state == run) continue;
      end_run(x);
      run = state;
      begin = x;
    }
    end_run(box.max().x());
  }
  return text;
}

}  // namespace

std::string route_picture(const mapping::MapView& view, std::span<const Vector3d> points,
                          std::span<const Vector3d> corners, double radius, double seconds) {
  AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  const Vector3d around(kAround, kAround, radius);
  box = AlignedBox3d(box.min() - around, box.max() + around);
  // Cells begin where voxels do.
  const double voxel = view.voxel();
  const double side = voxel * std::max(1.0, std::ceil(box.sizes().head<2>().maxCoeff() / voxel / kMostCells));
  for (int axis = 0; axis < 2; ++axis) box.min()[axis] = side * std::floor(box.min()[axis] / side);
  const Vector3d size = box.sizes();
  const double scale = kPixelsPerSide / size.head<2>().maxCoeff();
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{:.0f}' height='{:.0f}' viewBox='0 0 {:.3f} {:.3f}'>\n"
      "<title>Route from above: black occupied, white free, grey unknown</title>\n"
      "<style>rect{{shape-rendering:crispEdges}}.o{{fill:#222}}.f{{fill:#fff}}polyline{{fill:none;stroke-"
      "linecap:round}}</style>\n"
      "<rect width='100%' height='100%' fill='#bbb'/>\n",
      scale * size.x(), scale * size.y(), size.x(), size.y());
  svg += cells(view, box, side);
  svg += fmt::format("<polyline points='{}' stroke='#1b6ac9' stroke-opacity='0.2' stroke-width='{:.3f}'/>\n",
                     points_of(points, box), 2 * radius);
  svg +=
      fmt::format("<polyline points='{}' stroke='#c96a1b' stroke-dasharray='0.3' stroke-width='{:.3f}'/>\n",
                  points_of(corners, box), 2 / scale);
  svg += fmt::format("<polyline points='{}' stroke='#1b6ac9' stroke-width='{:.3f}'/>\n",
                     points_of(points, box), 3 / scale);
  if (seconds > 0) svg += moving_ball(points, box, radius, seconds);
  return svg + "</svg>\n";
}

}  // namespace pade::evaluation
