#include "route_files.hpp"

#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "pade/io/sequence/trajectory.hpp"

namespace pade::cli {
namespace {

constexpr double kSlowest = 0.01;  // horizontally, that says where to look, m/s

}  // namespace

std::vector<double> yaws_of(const planning::Route& route) {
  std::vector<double> yaws(route.points.size(), 0);
  bool known = false;
  for (std::size_t i = 0; i < yaws.size(); ++i) {
    const Eigen::Vector3d& v = route.points[i].velocity;
    if (i > 0) yaws[i] = yaws[i - 1];
    if (std::hypot(v.x(), v.y()) < kSlowest) continue;
    yaws[i] = std::atan2(v.y(), v.x());
    for (std::size_t k = 0; k < i && !known; ++k) yaws[k] = yaws[i];
    known = true;
  }
  return yaws;
}

std::string route_tum(const planning::Route& route) {
  const std::vector<double> yaws = yaws_of(route);
  std::vector<io::StampedPose> rows;
  for (std::size_t i = 0; i < route.points.size(); ++i) {
    Pose pose;
    pose.rotation = Eigen::AngleAxisd(yaws[i], Eigen::Vector3d::UnitZ());
    pose.translation = route.points[i].position;
    rows.push_back({Time{std::llround(route.points[i].time * 1e9)}, pose});
  }
  return io::format_trajectory(rows);
}

std::string route_csv(const planning::Route& route) {
  const std::vector<double> yaws = yaws_of(route);
  std::string text = "time,x,y,z,vx,vy,vz,yaw\n";
  for (std::size_t i = 0; i < route.points.size(); ++i) {
    const auto& [time, p, v] = route.points[i];
    text += fmt::format("{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f}\n", time, p.x(), p.y(),
                        p.z(), v.x(), v.y(), v.z(), yaws[i]);
  }
  return text;
}

nlohmann::ordered_json route_json(const planning::Route& route) {
  nlohmann::ordered_json corners = nlohmann::ordered_json::array();
  for (const Eigen::Vector3d& corner : route.corners) corners.push_back({corner.x(), corner.y(), corner.z()});
  return {{"length_m", route.length},
          {"duration_s", route.points.back().time},
          {"straight_m", (route.corners.back() - route.corners.front()).norm()},
          {"corners", std::move(corners)},
          {"notes", route.notes}};
}

}  // namespace pade::cli
