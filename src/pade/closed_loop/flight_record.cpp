#include "pade/closed_loop/flight_record.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pade::closed_loop {
namespace {

constexpr double kFarthest = 2;     // clearances are measured up to here, m
constexpr double kStanding = 0.05;  // m/s
constexpr double kMoving = 0.3;     // m/s
constexpr double kAtRest = 0.2;     // m/s: no more than the sway of one that holds its place

}  // namespace

Camera forward_camera(int width) {
  Camera camera;
  camera.width = width;
  camera.height = width * 3 / 4;
  camera.fx = camera.fy = 554.26 * width / 640;
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  return camera;
}

double yaw_of(const Eigen::Quaterniond& R_world_body) {
  const Eigen::Vector3d nose = R_world_body * Eigen::Vector3d::UnitX();
  return std::atan2(nose.y(), nose.x());
}

bool FlightWatch::look(const planning::MotionState& truth) {
  const double clearance =
      task_.surface.inside(truth.position) ? 0 : task_.surface.to(truth.position, kFarthest);
  record_.samples.push_back({truth, clearance});
  collided_ = collided_ || clearance < radius_;
  return !collided_;
}

Eigen::Vector3d FlightWatch::from_goal() const {
  const Eigen::Vector3d& at = record_.samples.empty() ? task_.start : record_.samples.back().state.position;
  return at - task_.goal;
}

/// Length and stops; the end of the climb is none.
void FlightWatch::measure_way(double from) {
  bool moving = false;
  const FlightSample* before = nullptr;
  for (const FlightSample& sample : record_.samples) {
    if (sample.state.time < from) continue;
    if (before != nullptr) record_.length += (sample.state.position - before->state.position).norm();
    const double speed = sample.state.velocity.norm();
    if (moving && speed < kStanding) ++record_.stops;
    moving = speed > kMoving || (moving && speed >= kStanding);
    before = &sample;
  }
}

FlightRecord FlightWatch::finished(Outcome outcome, double from) {
  record_.outcome = collided_ ? Outcome::collided : outcome;
  record_.goal_distance = goal_distance();
  record_.goal_height = from_goal().z();
  record_.least_clearance = kFarthest;
  for (const FlightSample& sample : record_.samples) {
    if (sample.state.time >= from || collided_)
      record_.least_clearance = std::min(record_.least_clearance, sample.clearance);
  }
  if (record_.samples.empty()) return std::move(record_);
  const planning::MotionState& end = record_.samples.back().state;
  record_.duration = end.time;
  record_.stands = end.velocity.norm() < kAtRest;
  measure_way(from);
  const double made_good = (task_.goal - task_.start).norm() - (task_.goal - end.position).norm();
  if (record_.duration > from) record_.goal_velocity = made_good / (record_.duration - from);
  return std::move(record_);
}

}  // namespace pade::closed_loop
