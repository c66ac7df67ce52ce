#include "pade/io/sequence/pose_world.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pade/core/compute/median.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

constexpr double kFarFromOrigin = 1000;  // metres; floats resolve 0.06 mm there
constexpr double kNoCommon = 0.1;        // length of the mean of unit vectors below which there is no mean
constexpr double kSame = 0.98;           // and above which they are all but the same: within 11 degrees
constexpr double kAlong = 0.7;           // cosine of 45 degrees

/// The mean of what `direction` gives of each camera.
template <class Direction>
Eigen::Vector3d mean_of(std::span<const Pose> cameras, Direction direction) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Pose& camera : cameras) sum += direction(camera.matrix3());
  return sum / static_cast<double>(std::max<std::size_t>(cameras.size(), 1));
}

Eigen::Vector3d mean_up(std::span<const Pose> cameras) {
  return mean_of(cameras, [](const Eigen::Matrix3d& R) -> Eigen::Vector3d { return -R.col(1); });
}
Eigen::Vector3d mean_look(std::span<const Pose> cameras) {
  return mean_of(cameras, [](const Eigen::Matrix3d& R) -> Eigen::Vector3d { return R.col(2); });
}

/// Share of the path that lies along the camera's own vertical axis.
double vertical_share(std::span<const Pose> cameras) {
  double along = 0;
  double path = 0;
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    const Eigen::Vector3d step = cameras[i].translation - cameras[i - 1].translation;
    along += std::abs(step.dot(cameras[i].matrix3().col(1)));
    path += step.norm();
  }
  return path > 0 ? along / path : 0;
}

/// Down-looking in straight flight, or ahead-looking on the way up.
bool ambiguous(std::span<const Pose> cameras) {
  return mean_look(cameras).norm() > kSame && mean_up(cameras).norm() > kSame &&
         vertical_share(cameras) > kAlong;
}

Eigen::Vector3d nearest_axis(const Eigen::Vector3d& direction) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return std::copysign(1.0, direction[axis]) * Eigen::Vector3d::Unit(axis);
}

bool on_the_ellipsoid(const Eigen::Vector3d& point) {
  constexpr double kLeast = 6.33e6;  // metres from the Earth's centre: the polar radius less 27 km
  constexpr double kMost = 6.42e6;   // the equatorial radius and 42 km
  return point.norm() > kLeast && point.norm() < kMost;
}

}  // namespace

std::optional<WorldUp> guess_up(std::span<const Pose> cameras) {
  const Eigen::Vector3d near = near_flight(cameras);
  if (on_the_ellipsoid(near)) return WorldUp{near.normalized(), false, "earth-centred positions"};
  const Eigen::Vector3d up = mean_up(cameras);
  const Eigen::Vector3d look = mean_look(cameras);
  if (look.norm() > kSame && up.norm() < look.norm() - 0.05) {
    return WorldUp{nearest_axis(-look), false, "cameras that look down"};
  }
  if (up.norm() < kNoCommon || ambiguous(cameras)) return std::nullopt;
  return WorldUp{nearest_axis(up), false, "mean camera-down axis"};
}

bool may_point_up(const Eigen::Vector3d& direction, std::span<const Pose> cameras) {
  return mean_up(cameras).dot(direction) > kAlong || -mean_look(cameras).dot(direction) > kAlong;
}

std::string why_no_up(std::span<const Pose> cameras) {
  return ambiguous(cameras)
             ? "the camera moves along its own vertical axis and never turns: it looks down, or it climbs"
             : "the cameras have no common up axis";
}

Eigen::Vector3d near_flight(std::span<const Pose> cameras) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  if (cameras.empty()) return point;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Pose& camera : cameras) values.push_back(camera.translation[axis]);
    point[axis] = std::round(median(values));
  }
  return point;
}

Eigen::Vector3d chosen_origin(const std::string& origin, std::span<const Pose> cameras) {
  if (origin == "none") return Eigen::Vector3d::Zero();
  if (const auto point = parse_point(origin)) return *point;
  const Eigen::Vector3d near = near_flight(cameras);
  return origin == "flight" || near.cwiseAbs().maxCoeff() > kFarFromOrigin ? near : Eigen::Vector3d::Zero();
}

std::optional<GeographicOrigin> gnss_origin(const std::filesystem::path& folder) {
  const auto text = read_file(folder / "gnss.csv");
  if (!text) return std::nullopt;
  const std::string_view head = std::string_view(*text).substr(0, text->find('\n'));
  constexpr std::string_view kKey = "origin=";
  const std::size_t at = head.find(kKey);
  if (!head.starts_with('#') || at == std::string_view::npos) return std::nullopt;
  const auto fields = split_fields(head.substr(at + kKey.size()));
  if (fields.size() < 3) return std::nullopt;
  const auto latitude = parse_number(fields[0]);
  const auto longitude = parse_number(fields[1]);
  const auto height = parse_number(fields[2]);
  if (!latitude || !longitude || !height || !(std::abs(*latitude) <= 90) || !(std::abs(*longitude) <= 360) ||
      !std::isfinite(*height)) {
    return std::nullopt;
  }
  return GeographicOrigin{*latitude, *longitude, *height};
}

}  // namespace pade::io
