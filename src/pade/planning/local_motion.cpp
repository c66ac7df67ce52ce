#include "pade/planning/local_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pade::planning {
namespace {

using Eigen::Vector3d;
constexpr double kSwingRate = std::numbers::pi;  // rad/s: once in 2 s
constexpr double kStill = 1e-3;                  // m/s

Vector3d asked_velocity(const MotionCommand& command, double yaw, double time) {
  const double left = command.left + command.swing * kSwingRate * std::cos(kSwingRate * time);
  const double c = std::cos(yaw);
  const double s = std::sin(yaw);
  return {c * command.forward - s * left, s * command.forward + c * left, command.climb};
}

/// One step: yaw first, then the velocity, then the place with the mean of the two velocities.
MotionState stepped(const MotionState& from, const MotionCommand& command, bool braking, double step,
                    const VehicleLimits& limits) {
  MotionState to = from;
  to.time += step;
  if (!braking) to.yaw = wrapped(from.yaw + step * command.yaw_rate);
  const Vector3d asked = braking ? Vector3d(Vector3d::Zero()) : asked_velocity(command, to.yaw, to.time);
  const Vector3d change = asked - from.velocity;
  const double most = (braking ? limits.acceleration : limits.pick_up) * step;
  const double size = change.norm();
  to.velocity = size <= most ? asked : Vector3d(from.velocity + most / size * change);
  to.position += 0.5 * step * (from.velocity + to.velocity);
  return to;
}

}  // namespace

void foretell(const MotionState& from, const MotionCommand& command, double hold, double step,
              const VehicleLimits& limits, std::vector<MotionState>& out) {
  out.clear();
  out.push_back(from);
  const int held = static_cast<int>(std::lround(hold / step));
  for (int i = 0; i < held; ++i) out.push_back(stepped(out.back(), command, false, step, limits));
  while (out.back().velocity.norm() > kStill) out.push_back(stepped(out.back(), command, true, step, limits));
}

MotionState state_at(std::span<const MotionState> motion, double time) {
  const auto after = std::upper_bound(motion.begin(), motion.end(), time,
                                      [](double t, const MotionState& state) { return t < state.time; });
  if (after == motion.begin()) return motion.front();
  if (after == motion.end()) {
    MotionState rest = motion.back();
    rest.velocity.setZero();
    rest.time = std::max(time, rest.time);
    return rest;
  }
  const MotionState& a = *(after - 1);
  const MotionState& b = *after;
  const double share = (time - a.time) / (b.time - a.time);
  MotionState state;
  state.time = time;
  state.velocity = a.velocity + share * (b.velocity - a.velocity);
  // The exact place under constant acceleration.
  state.position = a.position + 0.5 * (time - a.time) * (a.velocity + state.velocity);
  state.yaw = wrapped(a.yaw + share * wrapped(b.yaw - a.yaw));
  return state;
}

double governed_speed(double free_reach, const VehicleLimits& limits) {
  const double at = limits.acceleration * limits.latency;
  return -at + std::sqrt(at * at + 2 * limits.acceleration * std::max(free_reach, 0.0));
}

double wrapped(double angle) {
  const double turns = std::round(angle / (2 * std::numbers::pi));
  return angle - 2 * std::numbers::pi * turns;
}

}  // namespace pade::planning
