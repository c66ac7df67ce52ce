#include "pade/planning/global/route.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "pade/core/option_check.hpp"
#include "pade/planning/global/path_search.hpp"

namespace pade::planning {
namespace {

using Eigen::Vector3d;
using mapping::Hit;
using mapping::MapView;
using mapping::Occupancy;

constexpr double kMargin = 0.002;          // that the search keeps and a smoothed motion may use, m
constexpr double kFarthestFromMap = 1000;  // m: beyond that a place is one of other coordinates
constexpr double kLeastRounding = 1e-3;    // less is a stop

std::string text_of(const Vector3d& p) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", p.x(), p.y(), p.z());
}

Status check_end(const MapView& view, std::string_view name, const Vector3d& point,
                 const RouteOptions& options) {
  if (!point.allFinite()) return Error{fmt::format("{} {} is no point", name, text_of(point))};
  const Eigen::AlignedBox3d bounds = view.bounds();
  if (bounds.isEmpty()) return Error{"nothing is known in the map"};
  if (options.unknown == mapping::UnknownSpace::blocked && !bounds.contains(point)) {
    return Error{fmt::format("{} {} is outside the map, which reaches from {} to {}", name, text_of(point),
                             text_of(bounds.min()), text_of(bounds.max()))};
  }
  if (const double away = bounds.exteriorDistance(point); away > kFarthestFromMap) {
    return Error{fmt::format(
        "{} {} is {:.0f} m from the map, which reaches from {} to {}; expected it within {} m", name,
        text_of(point), away, text_of(bounds.min()), text_of(bounds.max()), kFarthestFromMap)};
  }
  if (const std::optional<Hit> hit =
          view.sweep(std::array{point}, options.radius + kMargin, options.unknown)) {
    const std::string_view state = hit->state == Occupancy::occupied ? "occupied" : "unknown";
    if (view.at(point) == hit->state) return Error{fmt::format("{} {} is {}", name, text_of(point), state)};
    return Error{fmt::format("{} {} is nearer than {:.2f} m to {} space at {}", name, text_of(point),
                             options.radius + kMargin, state, text_of(hit->voxel))};
  }
  return {};
}

std::vector<Vector3d> positions_of(const std::vector<MotionPoint>& points) {
  std::vector<Vector3d> positions;
  positions.reserve(points.size());
  for (const MotionPoint& point : points) positions.push_back(point.position);
  return positions;
}

/// Rounds the corners as much as the map lets it.
Result<std::vector<MotionPoint>> smoothed(const MapView& view, const std::vector<Vector3d>& corners,
                                          const RouteOptions& options) {
  std::vector<double> rounding(corners.size(), 1.0);
  const std::size_t tries = 12 * corners.size();
  for (std::size_t i = 0; i < tries; ++i) {
    std::vector<MotionPoint> points = motion_along(corners, rounding, options.motion);
    const auto hit = view.sweep(positions_of(points), options.radius, options.unknown);
    if (!hit) return points;
    const auto nearest = std::min_element(corners.begin(), corners.end(), [&](const auto& a, const auto& b) {
      return (a - hit->place).squaredNorm() < (b - hit->place).squaredNorm();
    });
    double& share = rounding[static_cast<std::size_t>(nearest - corners.begin())];
    share = share > kLeastRounding ? share / 2 : 0;
  }
  return Error{"the path that was found could not be flown clear of the map"};
}

}  // namespace

Status check(const RouteOptions& o) {
  const Status status =
      check_ranges(std::array{OptionRange{"radius", o.radius, 0.01, 10},
                              OptionRange{"iterations", static_cast<double>(o.iterations), 1, 1e9},
                              OptionRange{"improvements", static_cast<double>(o.improvements), 0, 1e9},
                              OptionRange{"seed", static_cast<double>(o.seed), 1, 2147483647}});
  return status ? within("motion", check(o.motion)) : status;
}

Result<Route> plan_route(const MapView& view, const Vector3d& start, const Vector3d& goal,
                         const RouteOptions& options, const std::function<bool()>& stop) {
  if (const Status status = check(options); !status) return status.error();
  if (const Status status = check_end(view, "start", start, options); !status) return status.error();
  if (const Status status = check_end(view, "goal", goal, options); !status) return status.error();
  Route route;
  if (start == goal) {
    route.corners = {start};
  } else {
    FoundPath found = search_path(view, start, goal, options, kMargin, stop);
    route.notes = std::move(found.complaints);
    route.corners = std::move(found.corners);
  }
  if (route.corners.empty()) {
    return Error{fmt::format("found no way from {} to {} in {} iterations, for a ball of {:.2f} m",
                             text_of(start), text_of(goal), options.iterations, options.radius)};
  }
  auto points = smoothed(view, route.corners, options);
  if (!points) return points.error();
  route.points = std::move(points).value();
  for (std::size_t i = 0; i + 1 < route.points.size(); ++i)
    route.length += (route.points[i + 1].position - route.points[i].position).norm();
  return route;
}

}  // namespace pade::planning
