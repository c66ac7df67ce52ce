#include "pade/report/report_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "pade/evaluation/map/corridor.hpp"
#include "pade/report/map_axes.hpp"
#include "pade/report/report_drawing.hpp"
#include "pade/report/report_pictures.hpp"

namespace pade::evaluation {
namespace {

struct Interval {
  double from = std::numeric_limits<double>::infinity();
  double to = -std::numeric_limits<double>::infinity();
  void include(double value) {
    from = std::min(from, value);
    to = std::max(to, value);
  }
  [[nodiscard]] bool has(double value) const { return value >= from && value <= to; }
  [[nodiscard]] double length() const { return to - from; }
};

using Points = std::vector<std::array<double, 3>>;  // along MapAxes

/// Centres of all occupied voxels; of a cube those of all its voxels.
Points occupied_voxels(const mapping::OccupancyMap& map, const MapAxes& axes) {
  Points points;
  const double voxel = map.options().voxel;
  for (const mapping::MapCell& cell : map.occupied()) {
    const int side = 1 << (mapping::kTreeDepth - cell.depth);
    const Eigen::Vector3d first = cell.centre.cast<double>().array() - 0.5 * (side - 1) * voxel;
    for (int i = 0; i < side * side * side; ++i) {
      const Eigen::Vector3d step(i % side, i / side % side, i / (side * side));
      points.push_back(axes.along(first + voxel * step));
    }
  }
  return points;
}

Points along(const std::vector<Eigen::Vector3d>& vectors, const MapAxes& axes) {
  Points points;
  for (const Eigen::Vector3d& vector : vectors) points.push_back(axes.along(vector));
  return points;
}

/// Of a long path as many points as a picture can show, the first and the last among them.
Points thinned(Points path) {
  constexpr std::size_t kMost = 2000;
  if (path.size() <= kMost) return path;
  for (std::size_t i = 0; i < kMost; ++i) path[i] = path[i * (path.size() - 1) / (kMost - 1)];
  path.resize(kMost);
  return path;
}

/// What the views show of an axis: all voxels but the outermost few, and the path.
Interval bounds(const Points& voxels, const Points& path, std::size_t axis) {
  std::vector<double> values;
  values.reserve(voxels.size());
  for (const auto& point : voxels) values.push_back(point[axis]);
  Interval interval;
  for (const double share : {0.002, 0.998}) {
    if (values.empty()) break;
    const auto last = static_cast<double>(values.size() - 1);
    const auto rank = static_cast<std::ptrdiff_t>(std::lround(share * last));
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    interval.include(values[static_cast<std::size_t>(rank)]);
  }
  for (const auto& point : path) interval.include(point[axis]);
  return interval;
}

// On the grid of the voxels, so that each row of them fills one row of pixels.
Interval snapped(const Interval& interval, double voxel, double margin) {
  return {std::floor((interval.from - margin) / voxel) * voxel,
          std::ceil((interval.to + margin) / voxel) * voxel};
}

struct Scene {  // what the views share
  const MapScene& map;
  const MapAxes& axes;
  const Points& voxels;
  const Points& path;
  std::array<Interval, 3> box;
  double voxel = 0;
};

/// An axis of a drawing: one of the three, which may run backward.
struct Across {
  std::size_t axis = 0;
  bool backward = false;
};

DrawingAxis drawing_axis(const Scene& scene, const Across& across) {
  const Interval& interval = scene.box[across.axis];
  const std::string& name = scene.axes.name[across.axis];
  return across.backward ? DrawingAxis{interval.to, interval.from, name}
                         : DrawingAxis{interval.from, interval.to, name};
}

/// Pixel of a value on an axis of `cells` pixels of `step` metres each.
int pixel_on(const DrawingAxis& axis, double value, double step, int cells) {
  const double from_start = std::abs(value - axis.from) / step;
  return std::clamp(static_cast<int>(from_start), 0, cells - 1);
}

int cells_of(const DrawingAxis& axis, double step) {
  return std::max(1, static_cast<int>(std::lround(axis.length() / step)));
}

/// Metres per pixel of a picture of `length` metres: a voxel, or several where there would be too many
/// pixels.
double pixel_size(double length, double voxel) {
  constexpr double kLargest = 1400;
  return voxel * std::max(1.0, std::ceil(length / voxel / kLargest));
}

// Of several voxels in a pixel the one nearest to the viewer, who looks against `sign` times the axis
// `toward`.
cv::Mat heights_of(const Scene& scene, const DrawingAxis& across, std::size_t across_axis,
                   const DrawingAxis& upward, std::size_t upward_axis, double sign) {
  const std::size_t toward = 3 - across_axis - upward_axis;
  const double step = pixel_size(std::max(across.length(), upward.length()), scene.voxel);
  const cv::Size size(cells_of(across, step), cells_of(upward, step));
  cv::Mat heights(size, CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  cv::Mat nearest(size, CV_64FC1, cv::Scalar(-std::numeric_limits<double>::infinity()));
  for (const auto& point : scene.voxels) {
    if (!scene.box[0].has(point[0]) || !scene.box[1].has(point[1]) || !scene.box[2].has(point[2])) continue;
    const int x = pixel_on(across, point[across_axis], step, size.width);
    const int y = size.height - 1 - pixel_on(upward, point[upward_axis], step, size.height);
    if (sign * point[toward] <= nearest.at<double>(y, x)) continue;
    nearest.at<double>(y, x) = sign * point[toward];
    heights.at<float>(y, x) = static_cast<float>(point[2]);
  }
  return heights;
}

DrawingLine line_of(const Points& path, std::size_t across, std::size_t upward) {
  DrawingLine line;
  for (const auto& point : path) line.push_back({point[across], point[upward]});
  return line;
}

/// All obstacles along one direction, in the colours of their heights.
Drawing projection(const Scene& scene, const Across& across, const Across& upward, double sign,
                   const char* title) {
  Drawing drawing{title, {}, drawing_axis(scene, across), drawing_axis(scene, upward), {}, {}};
  drawing.picture =
      colourise(heights_of(scene, drawing.across, across.axis, drawing.upward, upward.axis, sign),
                scene.box[2].from, scene.box[2].to, Palette::cividis);
  drawing.path = line_of(scene.path, across.axis, upward.axis);
  return drawing;
}

/// Height of the path where it comes nearest to a place on the ground.
double height_near(const Points& path, const std::array<double, 2>& place) {
  const auto squared = [&](const std::array<double, 3>& p) {
    const double a = p[0] - place[0], b = p[1] - place[1];
    return a * a + b * b;
  };
  const auto nearest = std::min_element(
      path.begin(), path.end(), [&](const auto& p, const auto& q) { return squared(p) < squared(q); });
  return (*nearest)[2];
}

/// Free, occupied and unknown at the height of the flight, seen from above. Pixels of a block share the
/// height.
Drawing level_slice(const Scene& scene, const Across& across, const Across& upward) {
  constexpr int kBlock = 8;
  Drawing drawing{"Free, occupied and unknown space at flight height, from above",
                  {},
                  drawing_axis(scene, across),
                  drawing_axis(scene, upward),
                  line_of(scene.path, across.axis, upward.axis),
                  {}};
  const double step = pixel_size(std::max(drawing.across.length(), drawing.upward.length()), scene.voxel);
  const double right = across.backward ? -step : step;
  const double down = upward.backward ? step : -step;
  const auto& direction = scene.axes.direction;
  cv::Mat states(cells_of(drawing.upward, step), cells_of(drawing.across, step), CV_8UC1);
  for (int y = 0; y < states.rows; y += kBlock) {
    for (int x = 0; x < states.cols; x += kBlock) {
      const cv::Rect block(x, y, std::min(kBlock, states.cols - x), std::min(kBlock, states.rows - y));
      std::array<double, 2> first{}, middle{};
      first[across.axis] = drawing.across.from + (x + 0.5) * right;
      first[upward.axis] = drawing.upward.to + (y + 0.5) * down;
      middle[across.axis] = first[across.axis] + 0.5 * (block.width - 1) * right;
      middle[upward.axis] = first[upward.axis] + 0.5 * (block.height - 1) * down;
      const Eigen::Vector3d corner =
          first[0] * direction[0] + first[1] * direction[1] + height_near(scene.path, middle) * direction[2];
      slice_of(scene.map.map, corner, right * direction[across.axis], down * direction[upward.axis],
               block.size())
          .copyTo(states(block));
    }
  }
  drawing.picture = colourise_occupancy(states);
  return drawing;
}

/// The path stretched out, and straight on from its end: distance over ground, and the place there.
struct Stretched {
  std::vector<double> distance;  // rising
  const Points& path;
  std::array<double, 3> ahead;  // direction of flight at the end, along the axes

  Stretched(const Points& points, const std::array<double, 3>& direction) : path(points), ahead(direction) {
    for (std::size_t i = 0; i < path.size(); ++i) {
      distance.push_back(i == 0 ? 0
                                : distance.back() +
                                      std::hypot(path[i][0] - path[i - 1][0], path[i][1] - path[i - 1][1]));
    }
  }
  [[nodiscard]] double length() const { return distance.back(); }
  /// Along the two level axes.
  [[nodiscard]] std::array<double, 2> at(double flown) const {
    const auto after = std::upper_bound(distance.begin(), distance.end(), flown);
    if (after == distance.begin()) return {path[0][0], path[0][1]};
    if (after == distance.end()) {
      const double level = std::hypot(ahead[0], ahead[1]);
      const double beyond = level > 0 ? (flown - distance.back()) / level : 0;
      return {path.back()[0] + beyond * ahead[0], path.back()[1] + beyond * ahead[1]};
    }
    const auto i = static_cast<std::size_t>(after - distance.begin());
    const double share = (flown - distance[i - 1]) / (distance[i] - distance[i - 1]);
    return {std::lerp(path[i - 1][0], path[i][0], share), std::lerp(path[i - 1][1], path[i][1], share)};
  }
};

/// Free, occupied and unknown on the upright surface through the path and the way ahead, stretched flat.
Drawing upright_section(const Scene& scene) {
  const FlightEnd end = end_of_flight(scene.map.trajectory, scene.map.look);
  const Stretched stretched(scene.path, scene.axes.along(end.direction));
  Drawing drawing{"Free, occupied and unknown space along the path, from the side",
                  {},
                  {0, stretched.length() + corridor_length, "distance flown, then straight ahead"},
                  {scene.box[2].from, scene.box[2].to, scene.axes.name[2]},
                  {},
                  {}};
  const double step = pixel_size(drawing.across.length(), scene.voxel);
  const auto& direction = scene.axes.direction;
  cv::Mat states(cells_of(drawing.upward, step), cells_of(drawing.across, step), CV_8UC1);
  for (int x = 0; x < states.cols; ++x) {
    const std::array<double, 2> at = stretched.at((x + 0.5) * step);
    const Eigen::Vector3d top =
        at[0] * direction[0] + at[1] * direction[1] + (drawing.upward.to - 0.5 * step) * direction[2];
    slice_of(scene.map.map, top, Eigen::Vector3d::Zero(), -step * direction[2], {1, states.rows})
        .copyTo(states.col(x));
  }
  drawing.picture = colourise_occupancy(states);
  for (std::size_t i = 0; i < scene.path.size(); ++i)
    drawing.path.push_back({stretched.distance[i], scene.path[i][2]});
  return drawing;
}

std::size_t count_outside(const Scene& scene) {
  return static_cast<std::size_t>(
      std::count_if(scene.voxels.begin(), scene.voxels.end(), [&](const auto& point) {
        return !scene.box[0].has(point[0]) || !scene.box[1].has(point[1]) || !scene.box[2].has(point[2]);
      }));
}

/// The whole map where nothing is occupied, but something is free.
Points corners_of_known(const mapping::OccupancyMap& map, const MapAxes& axes) {
  const Eigen::AlignedBox3d box = map.bounds();
  if (box.isEmpty()) return {};
  Points corners;
  for (const auto corner : {Eigen::AlignedBox3d::BottomLeftFloor, Eigen::AlignedBox3d::TopRightCeil})
    corners.push_back(axes.along(box.corner(corner)));
  return corners;
}

/// What a sphere sweeps on its way, in a plane through it: its sides and its front.
DrawingLine way_of_sphere(double reach) {
  constexpr int kSteps = 16;
  DrawingLine line = {{0, corridor_radius}};
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = std::numbers::pi * (0.5 - static_cast<double>(i) / kSteps);
    line.push_back({std::min(corridor_length, reach + corridor_radius * std::cos(angle)),
                    corridor_radius * std::sin(angle)});
  }
  line.push_back({0, -corridor_radius});
  return line;
}

/// Draws a section ahead: `upward` is the unit vector that points up on the page.
std::string section_ahead(const MapScene& map, const FlightEnd& end, const Eigen::Vector3d& upward,
                          const char* title, const char* upward_name, double reach) {
  const double step = 0.5 * map.map.options().voxel;
  Drawing drawing{title,
                  {},
                  {0, corridor_length, "ahead of the last pose"},
                  {-corridor_half_width, corridor_half_width, upward_name},
                  {},
                  {}};
  const cv::Size size(cells_of(drawing.across, step), cells_of(drawing.upward, step));
  const Eigen::Vector3d corner =
      end.position + 0.5 * step * end.direction + (corridor_half_width - 0.5 * step) * upward;
  drawing.picture =
      colourise_occupancy(slice_of(map.map, corner, step * end.direction, -step * upward, size));
  drawing.corridor.push_back(way_of_sphere(reach));
  return to_svg(drawing, map.layout.half, 300);
}

}  // namespace

MapViews draw_map(const MapScene& map) {
  MapViews views;
  const MapAxes axes = map_axes(map.up);
  const Points voxels = occupied_voxels(map.map, axes);
  const Points path = thinned(along(map.trajectory, axes));
  const Points shown = voxels.empty() ? corners_of_known(map.map, axes) : voxels;
  if (shown.empty() || path.empty()) return views;
  const double voxel = map.map.options().voxel;
  Scene scene{map, axes, voxels, path, {}, voxel};
  for (std::size_t axis = 0; axis < 3; ++axis)
    scene.box[axis] = snapped(bounds(shown, path, axis), voxel, 3 * voxel);
  views.cut_off = count_outside(scene);

  // From above the longer extent may run across; the page is wider than high.
  const bool first_is_longer = scene.box[0].length() >= scene.box[1].length();
  const bool turned = map.layout.turn && scene.box[1].length() > 1.2 * scene.box[0].length();
  const Across across = turned ? Across{1, true} : Across{0, false};
  const Across away = turned ? Across{0, false} : Across{1, false};
  constexpr double kWide = 1.5;
  views.wide = scene.box[across.axis].length() > kWide * scene.box[away.axis].length();
  const double width = views.wide ? map.layout.width : map.layout.half;
  const double height = std::max(560.0, 0.7 * width);
  views.top = to_svg(projection(scene, across, away, 1, "The map from above"), width, height);
  views.level = to_svg(level_slice(scene, across, away), width, height);
  // From the side the longer horizontal extent runs across; the viewer stands where the axes stay
  // right-handed.
  const Drawing side = first_is_longer ? projection(scene, {0}, {2}, -1, "The map from the side")
                                       : projection(scene, {1}, {2}, 1, "The map from the side");
  constexpr double kLowest = 120;
  views.side = to_svg(side, map.layout.width, 560, kLowest);
  views.side_stretch = stretch_of(side, map.layout.width, 560, kLowest);
  const Drawing section = upright_section(scene);
  views.section = to_svg(section, map.layout.width, 560, kLowest);
  views.section_stretch = stretch_of(section, map.layout.width, 560, kLowest);
  views.height_bar = colour_bar(scene.box[2].from, scene.box[2].to, Palette::cividis, "m");
  return views;
}

CorridorViews draw_corridor(const MapScene& map) {
  CorridorViews views;
  if (map.trajectory.empty()) return views;
  const FlightEnd end = end_of_flight(map.trajectory, map.look);
  if (end.direction.isZero()) return views;
  const FreeReach reach = known_free_reach(map.map, end, corridor_radius, corridor_length);
  views.reach = reach.distance;
  views.stopped_by = reach.stopped_by;
  Eigen::Vector3d left = map.up.cross(end.direction);
  if (left.norm() < 0.1) left = end.direction.unitOrthogonal();  // straight up or down
  left.normalize();
  views.level = section_ahead(map, end, left, "The way ahead, from above", "to the left", views.reach);
  views.upright = section_ahead(map, end, end.direction.cross(left), "The way ahead, from the side", "upward",
                                views.reach);
  return views;
}

}  // namespace pade::evaluation
