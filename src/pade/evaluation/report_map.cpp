#include "pade/evaluation/report_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "pade/evaluation/report_pictures.hpp"

namespace pade::evaluation {
namespace {

constexpr double kAligned = 0.9998;  // cosine of about a degree

// Three axes of the views: two horizontal ones and up, right-handed, with their names.
struct Axes {
  std::array<Eigen::Vector3d, 3> direction;
  std::array<std::string, 3> name;
};

std::string axis_name(const Eigen::Vector3d& direction) {
  int largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  const bool aligned = std::abs(direction[largest]) > kAligned;
  return fmt::format("{}{}{}", direction[largest] < 0 ? "−" : "", "xyz"[largest], aligned ? "" : "′");
}

Axes axes_of(const Eigen::Vector3d& up) {
  // The world axis after the vertical one (x after z, z after y) is least surprising as the first horizontal
  // one.
  int vertical = 0;
  up.cwiseAbs().maxCoeff(&vertical);
  const int first = vertical == 2 ? 0 : vertical == 1 ? 0 : 1;
  Eigen::Vector3d right = Eigen::Vector3d::Unit(first);
  right = (right - right.dot(up) * up).normalized();
  Axes axes{{right, up.cross(right), up}, {}};
  for (std::size_t i = 0; i < 3; ++i) axes.name[i] = axis_name(axes.direction[i]);
  return axes;
}

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

using Points = std::vector<std::array<double, 3>>;  // along Axes

template <class Vectors>
Points along(const Vectors& vectors, const Axes& axes) {
  Points points;
  points.reserve(vectors.size());
  for (const auto& vector : vectors) {
    const Eigen::Vector3d& v = vector.template cast<double>();
    points.push_back({axes.direction[0].dot(v), axes.direction[1].dot(v), axes.direction[2].dot(v)});
  }
  return points;
}

Interval bounds(const Points& voxels, const Points& path, std::size_t axis, double margin) {
  std::vector<double> values;
  values.reserve(voxels.size());
  for (const auto& point : voxels) values.push_back(point[axis]);
  const auto last = static_cast<double>(values.size() - 1);
  Interval interval;
  for (const double share : {0.002, 0.998}) {
    const auto rank = static_cast<std::ptrdiff_t>(std::lround(share * last));
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    interval.include(values[static_cast<std::size_t>(rank)]);
  }
  for (const auto& point : path) interval.include(point[axis]);
  return {interval.from - margin, interval.to + margin};
}

// On the grid of the map's voxels, so that each row of voxels fills one row of pixels.
Interval snapped(const Interval& interval, double voxel) {
  return {std::floor(interval.from / voxel) * voxel, std::ceil(interval.to / voxel) * voxel};
}

// Voxels between the lowest and the highest point of the path, and half a metre around it.
Points at_flight_height(const Points& voxels, const Points& path) {
  constexpr double kAround = 0.5;
  Interval height;
  for (const auto& point : path) height.include(point[2]);
  Points slice;
  std::copy_if(voxels.begin(), voxels.end(), std::back_inserter(slice), [&](const auto& point) {
    return point[2] >= height.from - kAround && point[2] <= height.to + kAround;
  });
  return slice;
}

// What the views share.
struct Scene {
  const Points& voxels;
  const Points& path;
  const Axes& axes;
  std::array<Interval, 3> box;
  double voxel = 0;
};

// One voxel per pixel; of several along the line of sight the one nearest to the viewer, who looks against
// `toward`.
cv::Mat heights_of(const Scene& scene, std::size_t across, std::size_t upward, std::size_t toward,
                   double sign) {
  const auto cells = [&](std::size_t axis) {
    return std::max(1, static_cast<int>(std::ceil(scene.box[axis].length() / scene.voxel)));
  };
  const cv::Size size(cells(across), cells(upward));
  cv::Mat heights(size, CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  cv::Mat nearest(size, CV_64FC1, cv::Scalar(-std::numeric_limits<double>::infinity()));
  for (const auto& point : scene.voxels) {
    if (!scene.box[0].has(point[0]) || !scene.box[1].has(point[1]) || !scene.box[2].has(point[2])) continue;
    const int x = std::clamp(static_cast<int>((point[across] - scene.box[across].from) / scene.voxel), 0,
                             size.width - 1);
    const int y = std::clamp(static_cast<int>((scene.box[upward].to - point[upward]) / scene.voxel), 0,
                             size.height - 1);
    if (sign * point[toward] <= nearest.at<double>(y, x)) continue;
    nearest.at<double>(y, x) = sign * point[toward];
    heights.at<float>(y, x) = static_cast<float>(point[2]);
  }
  return heights;
}

// Draws one view. Coordinates of the SVG are pixels of a drawing `kWidth` wide.
class View {
 public:
  View(const Scene& scene, std::size_t across, std::size_t upward)
      : scene_(scene), across_(across), upward_(upward) {
    constexpr double kWidth = 640, kLargestHeight = 560;
    scale_ = std::min(kWidth / scene.box[across].length(), kLargestHeight / scene.box[upward].length());
    width_ = scale_ * scene.box[across].length();
    height_ = scale_ * scene.box[upward].length();
  }

  std::string draw(std::string_view title, std::size_t toward, double sign) const {
    const Interval& vertical = scene_.box[2];
    cv::Mat picture = colourise(heights_of(scene_, across_, upward_, toward, sign), vertical.from,
                                vertical.to, Palette::cividis);
    // Room around for the numbers at the axes.
    std::string svg = fmt::format(
        R"(<svg class="map" viewBox="-58 -8 {:.0f} {:.0f}" role="img" aria-label="{}" style="max-width:{:.0f}px">)",
        width_ + 78, height_ + 62, title, width_ + 78);
    svg += fmt::format(
        R"(<image href="{}" width="{:.1f}" height="{:.1f}" preserveAspectRatio="none" style="image-rendering:pixelated"/>)",
        png_uri(picture, 4096, false), width_, height_);
    svg += fmt::format(R"(<rect class="frame" width="{:.1f}" height="{:.1f}"/>)", width_, height_);
    return svg + axes() + path() + scale_bar() + "</svg>";
  }

 private:
  [[nodiscard]] double x(double value) const { return (value - scene_.box[across_].from) * scale_; }
  [[nodiscard]] double y(double value) const { return (scene_.box[upward_].to - value) * scale_; }

  [[nodiscard]] std::string axes() const {
    std::string svg;
    const double step = round_up_125(60 / scale_);
    const auto first = [step](const Interval& interval) { return std::ceil(interval.from / step) * step; };
    const auto number = [](double value) { return fmt::format("{:g}", std::abs(value) < 1e-9 ? 0 : value); };
    for (double v = first(scene_.box[across_]); v <= scene_.box[across_].to; v += step) {
      svg += fmt::format(
          R"(<path class="tick" d="M{0:.1f} {1:.1f}v5"/><text x="{0:.1f}" y="{2:.1f}" text-anchor="middle">{3}</text>)",
          x(v), height_, height_ + 19, number(v));
    }
    for (double v = first(scene_.box[upward_]); v <= scene_.box[upward_].to; v += step) {
      svg += fmt::format(
          R"(<path class="tick" d="M-5 {0:.1f}h5"/><text x="-9" y="{1:.1f}" text-anchor="end">{2}</text>)",
          y(v), y(v) + 4, number(v));
    }
    svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{} [m]</text>)", width_ / 2,
                       height_ + 38, scene_.axes.name[across_]);
    svg += fmt::format(
        R"svg(<text transform="translate(-44 {:.1f}) rotate(-90)" text-anchor="middle">{} [m]</text>)svg",
        height_ / 2, scene_.axes.name[upward_]);
    return svg;
  }

  [[nodiscard]] std::string path() const {
    if (scene_.path.empty()) return {};
    std::string points;
    for (const auto& point : scene_.path)
      points += fmt::format("{:.1f},{:.1f} ", x(point[across_]), y(point[upward_]));
    const auto& start = scene_.path.front();
    const auto& end = scene_.path.back();
    std::string svg =
        fmt::format(R"(<polyline class="halo" points="{0}"/><polyline class="path" points="{0}"/>)", points);
    svg += fmt::format(R"(<circle class="start" cx="{:.1f}" cy="{:.1f}" r="5"/>)", x(start[across_]),
                       y(start[upward_]));
    svg += fmt::format(R"(<path class="end" d="M{:.1f} {:.1f}l6 6 -6 6 -6 -6z"/>)", x(end[across_]),
                       y(end[upward_]) - 6);
    return svg;
  }

  [[nodiscard]] std::string scale_bar() const {
    const double length = round_up_125(0.08 * width_ / scale_);
    const double right = width_ - 12, left = right - length * scale_, at = height_ - 14;
    return fmt::format(
        R"(<rect class="plate" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="30"/><path class="scale" d="M{:.1f} {:.1f}v6h{:.1f}v-6"/><text x="{:.1f}" y="{:.1f}" text-anchor="middle">{:g} m</text>)",
        std::min(left, right - 34) - 6, at - 20, std::max(right - left, 34.0) + 12, left, at - 2,
        right - left, 0.5 * (left + right), at - 6, length);
  }

  const Scene& scene_;
  std::size_t across_, upward_;
  double scale_ = 1, width_ = 0, height_ = 0;
};

}  // namespace

MapViews draw_map(const MapScene& map) {
  MapViews views;
  if (map.occupied.empty()) return views;
  const Axes axes = axes_of(map.up);
  const Points voxels = along(map.occupied, axes);
  const Points path = along(map.trajectory, axes);
  Scene scene{voxels, path, axes, {}, map.voxel};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scene.box[axis] = snapped(bounds(voxels, path, axis, 3 * map.voxel), map.voxel);
  }
  views.cut_off =
      static_cast<std::size_t>(std::count_if(voxels.begin(), voxels.end(), [&](const auto& point) {
        return !scene.box[0].has(point[0]) || !scene.box[1].has(point[1]) || !scene.box[2].has(point[2]);
      }));
  views.top = View(scene, 0, 1).draw("The map from above", 2, 1);
  const Points slice = at_flight_height(voxels, path);
  const Scene level{slice, path, axes, scene.box, map.voxel};
  views.slice = View(level, 0, 1).draw("The map at flight height, from above", 2, 1);
  // From the side the longer horizontal extent runs across; the viewer stands where the axes stay
  // right-handed.
  const bool first_is_longer = scene.box[0].length() >= scene.box[1].length();
  views.side = first_is_longer ? View(scene, 0, 2).draw("The map from the side", 1, -1)
                               : View(scene, 1, 2).draw("The map from the side", 0, 1);
  views.height_bar = colour_bar(scene.box[2].from, scene.box[2].to, Palette::cividis, "m");
  return views;
}

}  // namespace pade::evaluation
