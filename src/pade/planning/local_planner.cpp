#include "pade/planning/local_planner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace pade::planning {
namespace {

using Eigen::Vector3d;
constexpr std::array kSpeeds = {1.0, 0.5, 0.2};  // shares of what the governor allows
constexpr std::array kYawRates = {0.0, 0.4, -0.4, 0.8, -0.8, 1.4, -1.4};
constexpr std::array kClimbs = {0.0, 0.5, -0.5};  // m/s
constexpr double kSwing = 0.13;                   // m
constexpr double kSwingRoom = 0.2;                // to each side, m
constexpr double kPatience = 0.6;                 // s of standing before a hop
constexpr double kPatienceInFlight = 1.5;         // s without progress
constexpr double kProgress = 0.3;                 // m
constexpr double kHopSpeed = 0.4;                 // m/s
constexpr double kStanding = 0.05;                // m/s
constexpr double kCrawl = 0.25;                   // slower motion may have any direction, m/s
constexpr double kAhead = 1;                      // a second look at the way, this far before the nose, m
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Vector3d nose(double yaw) { return {std::cos(yaw), std::sin(yaw), 0}; }

bool follows_the_nose(const MotionState& state, double most) {
  const double speed = state.velocity.norm();
  return speed < kCrawl || state.velocity.dot(nose(state.yaw)) >= speed * std::cos(most);
}

}  // namespace

Result<LocalPlanner> LocalPlanner::create(const LocalPlannerOptions& options) {
  if (const Status s = check(options); !s) return s.error();
  return LocalPlanner(options);
}

/// Straight on: along the velocity, or the nose where it stands.
double LocalPlanner::free_reach(const Task& task) {
  const double speed = task.from.velocity.norm();
  const Vector3d along = speed > kCrawl ? Vector3d(task.from.velocity / speed) : nose(task.from.yaw);
  path_ = {task.from.position, task.from.position + options_.reach * along};
  return std::min(task.space.clear_length(path_, plan_.radius, options_.unknown_is_free), options_.reach);
}

/// Something straight ahead has not been seen, nothing stands before it, and there is room to the sides.
bool LocalPlanner::is_blind_ahead(const Task& task) const {
  const Vector3d ahead = nose(task.from.yaw);
  const Vector3d left(-ahead.y(), ahead.x(), 0);
  for (const double side : {-kSwingRoom, kSwingRoom}) {
    if (!task.window.is_free(task.from.position + side * left)) return false;
  }
  for (double at = 1; at < 0.6 * options_.reach; at += task.window.voxel()) {
    const mapping::Occupancy state = task.window.at(task.from.position + at * ahead);
    if (state == mapping::Occupancy::occupied) return false;
    if (state == mapping::Occupancy::unknown) return true;
  }
  return false;
}

bool LocalPlanner::is_valid(const Task& task, const std::vector<MotionState>& motion, bool any_way) {
  const VehicleLimits& limits = options_.vehicle;
  const double low = std::min(limits.lowest, task.from.position.z() - 1e-6);
  const double high = std::max(limits.highest, task.from.position.z() + 1e-6);
  path_.clear();
  for (const MotionState& state : motion) {
    if (state.position.z() < low || state.position.z() > high) return false;
    if (!any_way && !follows_the_nose(state, limits.nose_angle)) return false;
    path_.push_back(state.position);
  }
  return task.space.clear_length(path_, plan_.radius, options_.unknown_is_free) == kInfinity;
}

/// Length of the way that is left after the horizon, looked at twice so that the nose counts.
double LocalPlanner::score(const std::vector<MotionState>& motion) const {
  const MotionState end = state_at(motion, motion.front().time + options_.horizon);
  const double here = guide_.to_go(end.position);
  const double there = guide_.to_go(end.position + kAhead * nose(end.yaw));
  return here + 0.5 * std::min(there, here + 2 * kAhead);
}

void LocalPlanner::choose_primitive(const Task& task) {
  const VehicleLimits& limits = options_.vehicle;
  const double hold = options_.horizon + limits.latency;
  double best = kInfinity;
  const double swing = plan_.peering ? kSwing : 0;
  for (const double share : kSpeeds) {
    const double speed = share * plan_.speed_limit;
    for (const double yaw_rate : kYawRates) {
      for (const double climb : kClimbs) {
        const double most = speed * std::tan(limits.nose_angle);  // the velocity stays near the nose
        const MotionCommand command{speed, 0, std::clamp(climb, -most, most), yaw_rate, swing};
        foretell(task.from, command, hold, options_.step, limits, candidate_);
        if (!is_valid(task, candidate_, plan_.peering)) continue;
        ++plan_.valid;
        const double value = score(candidate_) + 0.02 * std::abs(yaw_rate) + 0.1 * std::abs(climb);
        if (value < best) {
          best = value;
          plan_.kind = PlanKind::flying;
          plan_.command = command;
          plan_.motion.swap(candidate_);
        }
      }
    }
  }
}

/// What is left of the last plan, which was free when it was made; or braking at once, if that is free now
/// and the rest of the plan is not.
void LocalPlanner::commit(const Task& task) {
  plan_.kind = PlanKind::committed;
  plan_.command = {};
  foretell(task.from, {}, 0, options_.step, options_.vehicle, candidate_);
  plan_.motion.assign(1, task.from);
  for (const MotionState& state : committed_) {
    if (state.time > task.from.time + 1e-6) plan_.motion.push_back(state);
  }
  if (!is_valid(task, plan_.motion, true) && is_valid(task, candidate_, true)) plan_.motion = candidate_;
}

/// The direction in which the way to the goal is shortest.
double LocalPlanner::best_heading(const Task& task) const {
  constexpr int kDirections = 32;
  constexpr double kLook = 0.9;  // m
  const Vector3d toward = task.goal - task.from.position;
  double heading = std::atan2(toward.y(), toward.x());
  double best = kInfinity;
  for (int i = 0; i < kDirections; ++i) {
    const double yaw = wrapped(2 * std::numbers::pi * i / kDirections);
    const double value =
        guide_.to_go(task.from.position + kLook * nose(yaw)) + 0.1 * std::abs(wrapped(yaw - task.from.yaw));
    if (value < best) {
      best = value;
      heading = yaw;
    }
  }
  return heading;
}

bool LocalPlanner::try_hop(const Task& task, const MotionCommand& command) {
  foretell(task.from, command, options_.horizon, options_.step, options_.vehicle, candidate_);
  if (!is_valid(task, candidate_, true)) return false;
  plan_.kind = PlanKind::recovering;
  plan_.command = command;
  plan_.motion.swap(candidate_);
  hop_ends_ = plan_.motion.back().time;
  standing_since_ = -1;
  return true;
}

/// To the sides, back, up or down, wherever it is known to be free, to see past what hides the way: a mono
/// camera that stands, or only turns, sees no depth, and ahead of one that creeps straight on lies its
/// epipole.
bool LocalPlanner::hop(const Task& task) {
  constexpr std::array<std::array<double, 3>, 5> kWays = {
      {{0, 1, 0}, {0, -1, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}}};
  for (std::size_t i = 0; i < kWays.size(); ++i) {
    const auto& way = kWays[(static_cast<std::size_t>(hops_) + i) % kWays.size()];
    if (try_hop(task, {kHopSpeed * way[0], kHopSpeed * way[1], kHopSpeed * way[2], 0, 0})) {
      hops_ += static_cast<int>(i) + 1;
      return true;
    }
  }
  return false;
}

/// A hop is flown to its end, as long as it is free.
bool LocalPlanner::goes_on_hopping(const Task& task) {
  if (task.from.time >= hop_ends_ - 1e-6) return false;
  commit(task);
  plan_.kind = PlanKind::recovering;
  since_ = task.from.time;
  return true;
}

/// For a while neither motion nor what was seen has brought the goal nearer.
bool LocalPlanner::gets_nowhere(const Task& task) {
  const double to_go = guide_.to_go(task.from.position);
  if (least_to_go_ < 0 || to_go < least_to_go_ - kProgress) {
    least_to_go_ = to_go;
    since_ = task.from.time;
  }
  if (task.from.time - since_ < kPatienceInFlight) return false;
  least_to_go_ = to_go;
  since_ = task.from.time;
  return true;
}

/// Standing: first the nose turns to where the way goes on, then the vehicle hops to the sides, back, up and
/// down, wherever it is known to be free, to see past what hides the way.
void LocalPlanner::recover(const Task& task) {
  const double turn = wrapped(best_heading(task) - task.from.yaw);
  constexpr double kAligned = 0.15;
  constexpr double kTurnRate = 1;  // rad/s
  if (std::abs(turn) > kAligned) {
    plan_.kind = PlanKind::recovering;
    plan_.command = {0, 0, 0, std::clamp(2 * turn, -kTurnRate, kTurnRate), 0};
    foretell(task.from, plan_.command, std::min(std::abs(turn) / kTurnRate, options_.horizon), options_.step,
             options_.vehicle, plan_.motion);
    standing_since_ = task.from.time;
    return;
  }
  if (standing_since_ < 0) standing_since_ = task.from.time;
  if (task.from.time - standing_since_ < kPatience) return;
  hop(task);
}

const LocalPlan& LocalPlanner::plan(const MotionState& from, const Vector3d& goal, const FreeSpace& space,
                                    const LocalWindow& window, double sigma) {
  const Task task{from, goal, space, window};
  committed_.swap(plan_.motion);
  plan_.valid = 0;
  plan_.peering = false;
  plan_.radius = radius(sigma);
  plan_.free_reach = free_reach(task);
  const double sure = plan_.free_reach - 3 * sigma;
  plan_.speed_limit =
      std::clamp(governed_speed(sure, options_.vehicle), options_.slowest, options_.vehicle.speed);
  if ((goal - from.position).head<2>().norm() < options_.arrival) {
    plan_.kind = PlanKind::arrived;
    plan_.command = {};
    foretell(from, {}, 0, options_.step, options_.vehicle, plan_.motion);
    return plan_;
  }
  guide_.set(window, goal, {options_.vehicle.lowest, options_.vehicle.highest});
  const bool stuck = gets_nowhere(task);
  if (goes_on_hopping(task)) return plan_;
  plan_.kind = PlanKind::committed;
  plan_.peering = options_.peering && is_blind_ahead(task);
  choose_primitive(task);
  if (plan_.kind != PlanKind::flying) {
    plan_.peering = false;
    commit(task);
    if (from.velocity.norm() < kStanding) recover(task);
    return plan_;
  }
  standing_since_ = -1;
  if (stuck) hop(task);
  return plan_;
}

}  // namespace pade::planning
