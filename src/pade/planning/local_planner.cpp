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
constexpr double kSetback = 1;                    // m: the way is longer than it seemed
constexpr int kMostSetbacks = 3;                  // that are no circling
constexpr double kLongestTurn = 4;                // s on the spot
constexpr double kYield = 0.05;                   // m less than the vehicle, where something is as near
constexpr double kJoint = 0.05;                   // m; what begins farther off is no rest of a plan
constexpr double kHopSpeed = 0.4;                 // m/s
constexpr double kStuckPlace = 1.5;               // m: hops nearer to each other than this are at one place
constexpr int kHopsBeforeRetreat = 4;             // that have opened nothing
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

/// Where the vehicle stands nearer to something than its ball is large, nothing that starts there would be
/// free: then the ball is what is clear there, down to a little less than the vehicle.
void LocalPlanner::begin(const Place& place, const PlaceDoubt& doubt) {
  committed_.swap(plan_.motion);
  plan_.valid = 0;
  plan_.peering = false;
  plan_.kind = PlanKind::committed;
  plan_.command = {};
  wanted_ = radius(doubt);
  near_ = clear_radius(place);
  plan_.radius = std::max(near_, std::min(wanted_, options_.vehicle.radius - kYield));
}

/// Of the largest ball up to the wanted one that touches nothing where the plan begins, to some millimetres.
double LocalPlanner::clear_radius(const Place& place) {
  path_.assign(1, place.from.position);
  const auto is_clear = [&](double radius) {
    return place.space.clear_length(path_, radius, options_.unknown_is_free) == kInfinity;
  };
  constexpr double kLeast = 0.02;  // less is within something
  if (is_clear(wanted_)) return wanted_;
  double low = kLeast;
  double high = wanted_;
  for (int i = 0; i < 7; ++i) {
    const double middle = 0.5 * (low + high);
    (is_clear(middle) ? low : high) = middle;
  }
  return low;
}

/// Straight on: along the velocity, or the nose where it stands.
double LocalPlanner::free_reach(const Place& place) {
  const double speed = place.from.velocity.norm();
  const Vector3d along = speed > kCrawl ? Vector3d(place.from.velocity / speed) : nose(place.from.yaw);
  path_ = {place.from.position, place.from.position + options_.reach * along};
  return std::min(place.space.clear_length(path_, plan_.radius, options_.unknown_is_free), options_.reach);
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

bool LocalPlanner::is_in_bounds(const Place& place, const std::vector<MotionState>& motion,
                                bool any_way) const {
  const VehicleLimits& limits = options_.vehicle;
  const double low = std::min(limits.lowest, place.from.position.z() - 1e-6);
  const double high = std::max(limits.highest, place.from.position.z() + 1e-6);
  return std::all_of(motion.begin(), motion.end(), [&](const MotionState& state) {
    return state.position.z() >= low && state.position.z() <= high &&
           (any_way || follows_the_nose(state, limits.nose_angle));
  });
}

/// How far a ball gets along a motion and what it overshoots its standstill by; infinity: to its end.
double LocalPlanner::clear_length(const Place& place, const std::vector<MotionState>& motion, double radius) {
  double fastest = 0;
  Vector3d last = Vector3d::Zero();  // direction in which it brakes
  path_.clear();
  for (const MotionState& state : motion) {
    path_.push_back(state.position);
    const double speed = state.velocity.norm();
    fastest = std::max(fastest, speed);
    if (speed > kStanding) last = state.velocity / speed;
  }
  const Vector3d beyond = path_.back() + options_.vehicle.overshoot * fastest * last;
  path_.push_back(beyond);
  return place.space.clear_length(path_, radius, options_.unknown_is_free);
}

/// How long a motion goes on before it touches something, s from now; infinity: it never does.
double LocalPlanner::clear_time(const Place& place, const std::vector<MotionState>& motion) {
  double left = clear_length(place, motion, near_);
  if (left == kInfinity) return kInfinity;
  for (std::size_t i = 0; i + 1 < motion.size(); ++i) {
    const double piece = (motion[i + 1].position - motion[i].position).norm();
    const double time = motion[i].time - motion.front().time;
    if (left < piece) return time + left / piece * (motion[i + 1].time - motion[i].time);
    left -= piece;
  }
  return motion.back().time - motion.front().time;
}

/// Where it began too near to something, a motion has to end clear of it.
bool LocalPlanner::gets_clear(const Place& place, const std::vector<MotionState>& motion) {
  if (near_ >= wanted_) return true;
  path_.assign(1, motion.back().position);
  return place.space.clear_length(path_, wanted_, options_.unknown_is_free) == kInfinity;
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
        // The velocity stays near the nose: at a right angle and beyond, any climb does.
        const double most =
            limits.nose_angle < 0.5 * std::numbers::pi ? speed * std::tan(limits.nose_angle) : kInfinity;
        const MotionCommand command{speed, 0, std::clamp(climb, -most, most), yaw_rate, swing};
        foretell(task.from, command, hold, options_.step, limits, candidate_);
        if (!is_in_bounds(task, candidate_, plan_.peering) ||
            clear_length(task, candidate_, plan_.radius) != kInfinity || !gets_clear(task, candidate_))
          continue;
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

/// What is left of the last plan. False where that does not begin here.
bool LocalPlanner::take_rest(const MotionState& from) {
  plan_.motion.assign(1, from);
  for (const MotionState& state : committed_) {
    if (state.time > from.time + 1e-6) plan_.motion.push_back(state);
  }
  return plan_.motion.size() > 1 &&
         (state_at(committed_, from.time).position - from.position).norm() < kJoint;
}

/// A standstill that is free: what is left of the last plan, which was free when it was made, or braking at
/// once. Where neither is, whatever stays clear for longer.
void LocalPlanner::commit(const Place& place, bool prefers_rest) {
  foretell(place.from, {}, 0, options_.step, options_.vehicle, candidate_);
  if (!take_rest(place.from)) {
    plan_.motion = candidate_;
    return;
  }
  const double rest = clear_time(place, plan_.motion);
  const double brake = clear_time(place, candidate_);
  if (prefers_rest ? rest == kInfinity : rest > brake) return;
  if (brake >= rest) plan_.motion = candidate_;
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

bool LocalPlanner::try_hop(const Task& task, const MotionCommand& command, double clear, double hold) {
  foretell(task.from, command, hold, options_.step, options_.vehicle, candidate_);
  if (!is_in_bounds(task, candidate_, true) || clear_length(task, candidate_, near_) != kInfinity)
    return false;
  path_.assign(1, candidate_.back().position);
  if (task.space.clear_length(path_, clear, options_.unknown_is_free) != kInfinity) return false;
  plan_.kind = PlanKind::recovering;
  plan_.command = command;
  plan_.motion.swap(candidate_);
  hop_ends_ = plan_.motion.back().time;
  standing_since_ = turning_since_ = -1;
  return true;
}

/// To the sides, back, up or down, wherever it is known to be free, to see past what hides the way: a mono
/// camera that stands, or only turns, sees no depth, and ahead of one that creeps straight on lies its
/// epipole.
bool LocalPlanner::hop(const Task& task) {
  if (is_stuck_here(task)) {
    give_up_what_is_ahead(task);
    retreat_ = Retreat::turning;
    if (goes_on_retreating(task)) return true;
  }
  constexpr std::array<std::array<double, 3>, 5> kWays = {
      {{0, 1, 0}, {0, -1, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}}};
  // Away from what it nearly touches, but not against another thing; where that cannot be, a little away.
  constexpr double kALittle = 0.05;  // m
  for (const double clear : {plan_.radius, std::min(plan_.radius, near_ + kALittle)}) {
    for (std::size_t i = 0; i < kWays.size(); ++i) {
      const auto& way = kWays[(static_cast<std::size_t>(hops_) + i) % kWays.size()];
      if (try_hop(task, {kHopSpeed * way[0], kHopSpeed * way[1], kHopSpeed * way[2], 0, 0}, clear,
                  options_.horizon)) {
        hops_ += static_cast<int>(i) + 1;
        return true;
      }
    }
  }
  return false;
}

/// Remembers where it hops. Hops about one place that open nothing say that what blocks the way lies beside
/// the cone of the camera: it has to be looked at from farther back.
bool LocalPlanner::is_stuck_here(const Task& task) {
  if (hops_here_ == 0 || (task.from.position - stuck_at_).norm() > kStuckPlace) {
    stuck_at_ = task.from.position;
    hops_here_ = 0;
  }
  return ++hops_here_ % kHopsBeforeRetreat == 0;
}

/// What lies on the way on and has not been seen by now may never be, such as what is behind a wall without
/// texture: another way is tried before it. Where that is one that was given up before, more of it is.
void LocalPlanner::give_up_what_is_ahead(const Task& task) {
  constexpr double kRadius = 1.5;  // m, of the first
  constexpr int kGrowths = 3;      // to so many times that
  constexpr double kNextTo = 4;    // m
  constexpr std::size_t kMost = 32;
  const Vector3d ahead = nose(best_heading(task));
  const double look = kRadius + wanted_;
  for (double at = 0; at < look; at += task.window.voxel()) {
    const Vector3d place = task.from.position + at * ahead;
    if (task.window.at(place) == mapping::Occupancy::occupied) return;
    if (task.window.is_free(place)) continue;
    const auto before = std::count_if(hidden_.begin(), hidden_.end(), [&](const HiddenSpace& space) {
      return (space.centre - place).norm() < kNextTo;
    });
    if (hidden_.size() == kMost) hidden_.erase(hidden_.begin());
    hidden_.push_back({place, kRadius * std::min(1 + static_cast<int>(before), kGrowths)});
    return;
  }
}

/// Straight back from the way on, or askew, as far as that is free: each time at one place farther, until a
/// ball on that way is in view as a whole.
bool LocalPlanner::back_off(const Task& task) {
  constexpr double kShare = 1.3;                              // m, for each retreat
  constexpr double kLongest = 4;                              // m
  constexpr double kShortest = 0.5;                           // m
  constexpr double kLess = 0.3;                               // m
  constexpr std::array kAskew = {0.0, 0.5, -0.5, 1.0, -1.0};  // rad
  const int retreats = hops_here_ / kHopsBeforeRetreat;
  const double most = std::min(kShare * retreats, kLongest);
  for (double way = most; way > kShortest; way -= kLess) {
    for (const double askew : kAskew) {
      const MotionCommand command{-kHopSpeed * std::cos(askew), kHopSpeed * std::sin(askew), 0, 0, 0};
      if (try_hop(task, command, plan_.radius, way / kHopSpeed)) return true;
    }
  }
  return false;
}

/// The baseline of a look from there.
bool LocalPlanner::step_aside(const Task& task) {
  for (const double side : {1.0, -1.0}) {
    const double left = (hops_ % 2 == 0 ? 1 : -1) * side * kHopSpeed;
    if (!try_hop(task, {0, left, 0, 0, 0}, plan_.radius, options_.horizon)) continue;
    ++hops_;
    return true;
  }
  return false;
}

/// The nose turns to where the way goes on; the vehicle backs off, turns once more to where it then goes on,
/// and steps aside.
bool LocalPlanner::goes_on_retreating(const Task& task) {
  if (retreat_ == Retreat::none) return false;
  since_ = task.from.time;
  if (task.from.velocity.norm() > kStanding) {
    commit(task, true);
    plan_.kind = PlanKind::recovering;
    return true;
  }
  if (turn(task)) return true;
  turning_since_ = -1;
  const bool turned = retreat_ == Retreat::turning;
  retreat_ = turned && back_off(task) ? Retreat::looking : Retreat::none;
  return turned ? retreat_ == Retreat::looking : step_aside(task);
}

/// A hop is flown to its end, as long as it is free.
bool LocalPlanner::goes_on_hopping(const Task& task) {
  if (task.from.time >= hop_ends_ - 1e-6) return false;
  commit(task, true);
  plan_.kind = PlanKind::recovering;
  since_ = task.from.time;
  return true;
}

/// For a while neither motion nor what was seen has brought the goal nearer. A way that turns out to be
/// longer, since something has come into sight or the goal has moved, is a new beginning, some times.
bool LocalPlanner::gets_nowhere(const Task& task) {
  const double to_go = guide_.to_go(task.from.position);
  const bool first = least_to_go_ < 0;
  const bool longer = std::isfinite(to_go) && to_go > least_to_go_ + kSetback && setbacks_ < kMostSetbacks;
  if (first || to_go < nearest_) {
    nearest_ = to_go;
    setbacks_ = 0;
  }
  if (first || longer || to_go < least_to_go_ - kProgress) {
    setbacks_ += !first && longer ? 1 : 0;
    least_to_go_ = to_go;
    since_ = task.from.time;
  }
  if (task.from.time - since_ < kPatienceInFlight) return false;
  least_to_go_ = nearest_ = to_go;
  setbacks_ = 0;
  since_ = task.from.time;
  return true;
}

/// On the spot, to where the way goes on. False if it looks there, or has turned for long.
bool LocalPlanner::turn(const Task& task) {
  const double angle = wrapped(best_heading(task) - task.from.yaw);
  constexpr double kAligned = 0.15;
  constexpr double kTurnRate = 1;  // rad/s
  if (std::abs(angle) <= kAligned) return false;
  if (turning_since_ < 0) turning_since_ = task.from.time;
  if (task.from.time - turning_since_ > kLongestTurn) return false;
  plan_.kind = PlanKind::recovering;
  plan_.command = {0, 0, 0, std::clamp(2 * angle, -kTurnRate, kTurnRate), 0};
  foretell(task.from, plan_.command, std::min(std::abs(angle) / kTurnRate, options_.horizon), options_.step,
           options_.vehicle, plan_.motion);
  standing_since_ = task.from.time;
  return true;
}

/// Standing: first the nose turns to where the way goes on, then the vehicle hops to the sides, back, up and
/// down, wherever it is known to be free, to see past what hides the way.
void LocalPlanner::recover(const Task& task) {
  if (turn(task)) return;
  if (standing_since_ < 0) standing_since_ = task.from.time;
  if (task.from.time - standing_since_ < kPatience) return;
  if (!hop(task)) turning_since_ = -1;
}

const LocalPlan& LocalPlanner::stop(const MotionState& from, const FreeSpace& space,
                                    const PlaceDoubt& doubt) {
  const Place place{from, space};
  begin(place, doubt);
  plan_.speed_limit = plan_.free_reach = 0;
  commit(place, false);
  since_ = from.time;
  hop_ends_ = standing_since_ = turning_since_ = -1;
  retreat_ = Retreat::none;
  return plan_;
}

Vector3d LocalPlanner::attainable(const Vector3d& goal) const {
  const VehicleLimits& limits = options_.vehicle;
  return {goal.x(), goal.y(), std::clamp(goal.z(), limits.lowest, limits.highest)};
}

const LocalPlan& LocalPlanner::plan(const MotionState& from, const Vector3d& wanted, const FreeSpace& space,
                                    const LocalWindow& window, const PlaceDoubt& doubt) {
  const Vector3d goal = attainable(wanted);
  const Task task{{from, space}, goal, window};
  begin(task, doubt);
  plan_.free_reach = free_reach(task);
  const double sure = plan_.free_reach - 3 * doubt.sigma;
  plan_.speed_limit =
      std::clamp(governed_speed(sure, options_.vehicle), options_.slowest, options_.vehicle.speed);
  // A little nearer than whoever asks whether it has arrived, and may see it a little farther off.
  constexpr double kWellWithin = 0.8;
  if (is_at(goal, from.position, kWellWithin * options_.arrival)) {
    plan_.kind = PlanKind::arrived;
    commit(task, false);
    return plan_;
  }
  guide_.set(window, goal, {options_.vehicle.lowest, options_.vehicle.highest}, options_.arrival, hidden_);
  const bool stuck = gets_nowhere(task);
  if (goes_on_hopping(task) || goes_on_retreating(task)) return plan_;
  plan_.peering = options_.peering && is_blind_ahead(task);
  choose_primitive(task);
  if (plan_.kind != PlanKind::flying) {
    plan_.peering = false;
    commit(task, true);
    if (from.velocity.norm() < kStanding) recover(task);
    return plan_;
  }
  standing_since_ = turning_since_ = -1;
  if (stuck) hop(task);
  return plan_;
}

}  // namespace pade::planning
