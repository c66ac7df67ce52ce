#include "pade/planning/local_planner.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "pade/planning/map_space.hpp"

namespace pade::planning {
namespace {

using Eigen::Vector3d;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Balls and walls in free space, of which everything is known.
class Balls : public FreeSpace {
 public:
  struct Ball {
    Vector3d centre;
    double radius;
  };
  struct Wall {
    Vector3d normal;  // into the free space
    double at;        // along it, m
  };
  std::vector<Ball> balls;
  std::vector<Wall> walls;

  [[nodiscard]] double clearance(const Vector3d& p) const {
    double nearest = kInfinity;
    for (const Ball& ball : balls) nearest = std::min(nearest, (p - ball.centre).norm() - ball.radius);
    for (const Wall& wall : walls) nearest = std::min(nearest, wall.normal.dot(p) - wall.at);
    return nearest;
  }
  [[nodiscard]] double clear_length(std::span<const Vector3d> path, double radius, bool) const override {
    double length = 0;
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const Vector3d way = path[i + 1] - path[i];
      const int steps = 1 + static_cast<int>(way.norm() / 0.02);
      for (int k = 0; k < steps; ++k) {
        if (clearance(path[i] + way * (static_cast<double>(k) / steps)) < radius)
          return length + way.norm() * k / steps;
      }
      length += way.norm();
    }
    return clearance(path.back()) < radius ? length : kInfinity;
  }
};

LocalPlanner planner_of(const LocalPlannerOptions& options = {}) {
  auto planner = LocalPlanner::create(options);
  EXPECT_TRUE(planner.ok());
  return std::move(planner).value();
}

/// The window of a map of which nothing is known.
LocalWindow unseen_window(const Vector3d& centre) {
  LocalWindow window({4, 4, 1});
  const auto map = mapping::OccupancyMap::create();
  window.set(*mapping::MapView::of(*map), centre, 0.4);
  return window;
}

MotionState at_rest(const Vector3d& position, double yaw = 0) {
  MotionState state;
  state.position = position;
  state.yaw = yaw;
  return state;
}

TEST(LocalMotion, TheGovernedSpeedStopsWithinTheFreeReach) {
  const VehicleLimits limits;
  for (const double reach : {0.0, 0.1, 0.5, 2.0, 10.0}) {
    const double v = governed_speed(reach, limits);
    EXPECT_NEAR(v * limits.latency + v * v / (2 * limits.acceleration), reach, 1e-12);
  }
  EXPECT_EQ(governed_speed(-1, limits), 0);
}

TEST(LocalMotion, EndsAtRestWithinTheAcceleration) {
  const VehicleLimits limits;
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> number(-1, 1);
  std::vector<MotionState> motion;
  for (int i = 0; i < 200; ++i) {
    MotionState from = at_rest({number(engine), number(engine), 2}, 3 * number(engine));
    from.velocity = {2 * number(engine), 2 * number(engine), 0.5 * number(engine)};
    const MotionCommand command{2 * number(engine), number(engine), 0.5 * number(engine),
                                1.4 * number(engine), 0};
    foretell(from, command, 1, 0.1, limits, motion);
    EXPECT_LT(motion.back().velocity.norm(), 1e-3);
    for (std::size_t k = 0; k + 1 < motion.size(); ++k) {
      const double dt = motion[k + 1].time - motion[k].time;
      const Vector3d change = motion[k + 1].velocity - motion[k].velocity;
      EXPECT_LE(change.norm(), limits.acceleration * dt + 1e-9);
      const Vector3d mean = 0.5 * (motion[k + 1].velocity + motion[k].velocity);
      EXPECT_LT((motion[k + 1].position - motion[k].position - dt * mean).norm(), 1e-12);
    }
    const MotionState middle = state_at(motion, from.time + 0.25);
    const MotionState before = state_at(motion, from.time + 0.2499);
    EXPECT_LT((middle.position - before.position).norm(), 1e-3);
  }
}

/// Whatever stands around: what is flown is free, up to the standstill, with the nose near the velocity.
TEST(LocalPlanner, FliesOnlyWhereItMayStop) {
  std::mt19937 engine(17);
  std::uniform_real_distribution<double> number(-1, 1);
  int flying = 0;
  int blocked = 0;
  for (int i = 0; i < 60; ++i) {
    Balls space;
    for (int k = 0; k < 14; ++k)
      space.balls.push_back({{4 * number(engine), 4 * number(engine), 1.6 + number(engine)},
                             0.1 + 0.3 * std::abs(number(engine))});
    MotionState from = at_rest({0, 0, 1.6}, 3.1 * number(engine));
    const double speed = 1 + number(engine);
    from.velocity = speed * Vector3d(std::cos(from.yaw), std::sin(from.yaw), 0);
    LocalPlanner planner = planner_of();
    const LocalPlan& plan = planner.plan(from, {30, 5, 1.6}, space, unseen_window(from.position));
    EXPECT_LE(plan.radius, 0.4 + 1e-12);
    EXPECT_GE(plan.radius, 0.3);
    if (plan.kind != PlanKind::flying) {
      ++blocked;
      continue;
    }
    ++flying;
    EXPECT_LT(plan.motion.back().velocity.norm(), 1e-3);
    EXPECT_LE(plan.command.forward, plan.speed_limit + 1e-12);
    for (const MotionState& state : plan.motion) {
      EXPECT_GE(space.clearance(state.position), plan.radius - 1e-9);
      EXPECT_GE(state.position.z(), 0.7);
      EXPECT_LE(state.position.z(), 2.8);
    }
  }
  EXPECT_GT(flying, 10);
  EXPECT_GT(blocked, 2);
}

/// At full speed, one frame into a plan that holds its speed for a second.
struct InFlight {
  LocalPlanner planner = planner_of();
  LocalPlan first;
  MotionState next;

  explicit InFlight(const FreeSpace& space) {
    MotionState from = at_rest({0, 0, 1.6});
    from.velocity = {2, 0, 0};
    first = planner.plan(from, {30, 0, 1.6}, space, unseen_window(from.position));
    EXPECT_EQ(first.kind, PlanKind::flying);
    next = state_at(first.motion, 0.1);
  }
};

/// It used to go on with its plan where neither that nor braking was free: at full speed into what it had
/// just seen.
TEST(LocalPlanner, BrakesBeforeWhatItSeesTooLate) {
  for (const double ahead : {0.6, 0.8, 1.0}) {
    Balls space;
    InFlight flight(space);
    // Across the way, less than its way of braking ahead.
    space.walls.push_back({-Vector3d::UnitX(), -(flight.next.position.x() + 0.4 + ahead)});
    const LocalPlan second =
        flight.planner.plan(flight.next, {30, 0, 1.6}, space, unseen_window(flight.next.position));
    EXPECT_EQ(second.kind, PlanKind::committed);
    EXPECT_EQ(second.valid, 0);
    EXPECT_LT(second.motion.back().time - flight.next.time, 2 / 3.0 + 0.11) << ahead;
    EXPECT_LT(second.motion.back().position.x() - flight.next.position.x(), 0.7) << ahead;
  }
}

/// Neither is clear from the first point: whatever that is, it is met more gently.
TEST(LocalPlanner, BrakesWhereEverythingIsOccupied) {
  Balls space;
  InFlight flight(space);
  space.balls.push_back({{0.2, 0, 1.6}, 5});
  const LocalPlan second =
      flight.planner.plan(flight.next, {30, 0, 1.6}, space, unseen_window(flight.next.position));
  EXPECT_EQ(second.kind, PlanKind::committed);
  EXPECT_EQ(second.valid, 0);
  EXPECT_LT(second.motion.back().time - flight.next.time, 2 / 3.0 + 0.11);
}

/// The rest of a plan that is still free is flown.
TEST(LocalPlanner, FliesTheRestOfItsPlanWhileThatIsFree) {
  Balls space;
  InFlight flight(space);
  const double end = flight.first.motion.back().position.x() + 0.1;  // and what it overshoots by
  space.walls.push_back({-Vector3d::UnitX(), -(end + 0.41)});
  const LocalPlan second =
      flight.planner.plan(flight.next, {30, 0, 1.6}, space, unseen_window(flight.next.position));
  if (second.kind == PlanKind::flying) {
    EXPECT_LT(second.motion.back().position.x(), end);
    return;
  }
  for (double t = 0.1; t < flight.first.motion.back().time; t += 0.05)
    EXPECT_LT((state_at(second.motion, t).position - state_at(flight.first.motion, t).position).norm(), 1e-6);
}

/// Who sees nothing any more brakes, and the planner knows of it: the next plan begins on that stop.
TEST(LocalPlanner, AStopIsPartOfItsPlans) {
  const Balls space;
  InFlight flight(space);
  const LocalPlan stop = flight.planner.stop(flight.next, space);
  EXPECT_LT(stop.motion.back().velocity.norm(), 1e-3);
  EXPECT_LT(stop.motion.back().time - flight.next.time, 2 / 3.0 + 0.11);
  const MotionState later = state_at(stop.motion, flight.next.time + 0.2);
  const LocalPlan again = flight.planner.stop(later, space);
  EXPECT_LT((again.motion.back().position - stop.motion.back().position).norm(), 0.02);
}

/// A stop has room for what the vehicle overshoots it by: 5 cm for each metre a second.
TEST(LocalPlanner, KeepsRoomBehindItsStandstill) {
  Balls space;
  InFlight flight(space);
  const double end = flight.first.motion.back().position.x();
  space.walls.push_back({-Vector3d::UnitX(), -(end + 0.4 + 0.06)});
  MotionState from = at_rest({0, 0, 1.6});
  from.velocity = {2, 0, 0};
  LocalPlanner planner = planner_of();
  const LocalPlan plan = planner.plan(from, {30, 0, 1.6}, space, unseen_window(from.position));
  ASSERT_EQ(plan.kind, PlanKind::flying);
  EXPECT_LT(plan.motion.back().position.x(), end - 0.03);
}

/// A vehicle that something has come nearer to than its ball is large flies away from it.
TEST(LocalPlanner, GetsAwayFromWhatItNearlyTouches) {
  for (const double gap : {0.39, 0.33, 0.25}) {
    Balls space;
    space.walls.push_back({-Vector3d::UnitY(), -gap});  // to the left of the way
    LocalPlanner planner = planner_of();
    MotionState state = at_rest({0, 0, 1.6});
    double nearest = gap;
    for (int frame = 0; frame < 60; ++frame) {
      const LocalPlan& plan = planner.plan(state, {30, 0, 1.6}, space, unseen_window(state.position));
      state = state_at(plan.motion, state.time + 0.1);
      nearest = std::min(nearest, space.clearance(state.position));
    }
    EXPECT_GT(space.clearance(state.position), 0.399) << gap;
    EXPECT_GT(state.position.x(), 3) << gap;
    EXPECT_GT(nearest, gap - 0.01) << gap;
  }
}

/// Beside its plan it needs as much more room, and flies no slower for it.
TEST(LocalPlanner, TheBallGrowsWithTheOffsetFromThePlan) {
  Balls space;
  space.balls.push_back({{5, 0, 1.6}, 0.5});
  LocalPlanner on = planner_of();
  LocalPlanner beside = planner_of();
  const MotionState from = at_rest({0, 0, 1.6});
  const LocalPlan a = on.plan(from, {30, 0, 1.6}, space, unseen_window(from.position));
  const LocalPlan b = beside.plan(from, {30, 0, 1.6}, space, unseen_window(from.position), {0, 0.3});
  EXPECT_NEAR(b.radius - a.radius, 0.3, 1e-12);
  EXPECT_NEAR(a.free_reach - b.free_reach, 0.3, 0.05);
}

TEST(LocalPlanner, GoesStraightInFreeSpaceAndStopsAtTheGoal) {
  const Balls space;
  LocalPlanner planner = planner_of();
  const Vector3d goal(12, 0, 1.6);
  std::vector<MotionState> motion = {at_rest({0, 0, 1.6})};
  double time = 0;
  for (; time < 20; time += 0.1) {
    const MotionState state = state_at(motion, time + 0.1);
    const LocalPlan& plan = planner.plan(state, goal, space, unseen_window(state.position));
    EXPECT_LT(std::abs(state.position.y()), 0.3);
    motion = plan.motion;
    if (plan.kind == PlanKind::arrived) break;
  }
  EXPECT_LT(time, 9);
  EXPECT_LT((motion.back().position - goal).norm(), 1.5);
}

/// However far the velocity may be from the nose, beyond a right angle too, no plan climbs or sinks faster
/// than a motion of the planner's own.
TEST(LocalPlanner, ClimbsNoFasterThanItsMotionsWhateverTheAngleOfTheNose) {
  const Balls space;
  for (const double angle : {0.05, 0.262, 1.5, 1.6, 2.0, 2.6, 3.14}) {
    LocalPlannerOptions options;
    options.vehicle.nose_angle = angle;
    LocalPlanner planner = std::move(LocalPlanner::create(options)).value();
    const MotionState from = at_rest({0, 0, 1.6});
    const LocalPlan& plan = planner.plan(from, {30, 0, 1.6}, space, unseen_window(from.position));
    EXPECT_EQ(plan.kind, PlanKind::flying) << angle;
    EXPECT_LE(std::abs(plan.command.climb), 0.5) << angle;
  }
}

/// A goal higher or lower than it may fly, as satellites may say, is reached where it is nearest to it.
TEST(LocalPlanner, ArrivesBelowAGoalThatIsTooHighAndAboveOneThatIsTooLow) {
  const Balls space;
  for (const double height : {-3.0, 0.2, 4.5, 9.0}) {
    LocalPlanner planner = planner_of();
    const Vector3d goal(12, 0, height);
    std::vector<MotionState> motion = {at_rest({0, 0, 1.6})};
    PlanKind kind = PlanKind::committed;
    double time = 0;
    for (; time < 20 && kind != PlanKind::arrived; time += 0.1) {
      const MotionState state = state_at(motion, time + 0.1);
      const LocalPlan& plan = planner.plan(state, goal, space, unseen_window(state.position));
      motion = plan.motion;
      kind = plan.kind;
    }
    EXPECT_EQ(kind, PlanKind::arrived) << height;
    EXPECT_NEAR(motion.front().position.z(), std::clamp(height, 0.7, 2.8), 1.0) << height;
    EXPECT_LT((motion.front().position - goal).head<2>().norm(), 1.0) << height;
  }
}

/// A bigger ball is planned for when the pose is uncertain, and more slowly.
TEST(LocalPlanner, TheMarginGrowsWithSigma) {
  Balls space;
  space.balls.push_back({{5, 0, 1.6}, 0.5});
  LocalPlanner sure = planner_of();
  LocalPlanner unsure = planner_of();
  const MotionState from = at_rest({0, 0, 1.6});
  const LocalPlan a = sure.plan(from, {30, 0, 1.6}, space, unseen_window(from.position), {0, 0});
  const LocalPlan b = unsure.plan(from, {30, 0, 1.6}, space, unseen_window(from.position), {0.2, 0});
  EXPECT_NEAR(b.radius - a.radius, 0.2, 1e-12);
  EXPECT_NEAR(a.free_reach - b.free_reach, 0.2, 0.05);
}

TEST(LocalPlanner, TheSameCallsGiveTheSameBits) {
  Balls space;
  space.balls.push_back({{3, 0.2, 1.6}, 0.5});
  const auto fly = [&] {
    LocalPlanner planner = planner_of();
    std::vector<MotionState> motion = {at_rest({0, 0, 1.6})};
    for (int i = 0; i < 20; ++i) {
      const MotionState state = state_at(motion, 0.1 * (i + 1));
      motion = planner.plan(state, {20, 0, 1.6}, space, unseen_window(state.position)).motion;
    }
    return motion.back();
  };
  const MotionState a = fly();
  const MotionState b = fly();
  EXPECT_EQ(std::memcmp(a.position.data(), b.position.data(), sizeof(double) * 3), 0);
  EXPECT_EQ(a.yaw, b.yaw);
}

TEST(LocalPlanner, RefusesOptionsThatMakeNoSense) {
  LocalPlannerOptions options;
  options.vehicle.radius = -1;
  const auto planner = LocalPlanner::create(options);
  ASSERT_FALSE(planner.ok());
  EXPECT_NE(planner.error().message.find("vehicle.radius"), std::string::npos) << planner.error().message;
}

/// Free within a ball, unknown beyond.
class Bubble : public FreeSpace {
 public:
  [[nodiscard]] double clear_length(std::span<const Vector3d> path, double radius, bool) const override {
    constexpr double kRadius = 1.5;
    double length = 0;
    for (std::size_t i = 0; i < path.size(); ++i) {
      if (i > 0) length += (path[i] - path[i - 1]).norm();
      if ((path[i] - Vector3d(0, 0, 1.6)).norm() + radius > kRadius) return length;
    }
    return kInfinity;
  }
};

/// What gets no farther by flying on hops to the sides, for another look: never out of what is free.
TEST(LocalPlanner, HopsToTheSidesWhereItGetsNowhere) {
  const Bubble space;
  LocalPlanner planner = planner_of();
  MotionState state = at_rest({0, 0, 1.6});
  double farthest = 0;
  double least = 0;
  double greatest = 0;
  int hops = 0;
  for (int frame = 0; frame < 80; ++frame) {
    const LocalPlan& plan = planner.plan(state, {30, 0, 1.6}, space, unseen_window(state.position));
    hops += plan.kind == PlanKind::recovering ? 1 : 0;
    state = state_at(plan.motion, state.time + 0.1);
    farthest = std::max(farthest, state.position.x());
    least = std::min(least, state.position.y());
    greatest = std::max(greatest, state.position.y());
    EXPECT_LE((state.position - Vector3d(0, 0, 1.6)).norm() + 0.4, 1.5 + 1e-6) << frame;
  }
  EXPECT_GT(farthest, 0.7);
  EXPECT_GT(hops, 5);
  EXPECT_GT(greatest - least, 0.25);
}

/// Where hop after hop opens nothing, it looks from farther back: each time farther, as far as is free.
TEST(LocalPlanner, BacksOffWhereItsHopsOpenNothing) {
  const Bubble space;
  LocalPlanner planner = planner_of();
  MotionState state = at_rest({0, 0, 1.6});
  double rim = 0;
  double back = 0;  // the farthest that it has gone back from the rim
  double aside_there = 0;
  for (int frame = 0; frame < 600; ++frame) {
    const LocalPlan& plan = planner.plan(state, {30, 0, 1.6}, space, unseen_window(state.position));
    state = state_at(plan.motion, state.time + 0.1);
    rim = std::max(rim, state.position.x());
    back = std::max(back, rim - state.position.x());
    if (rim - state.position.x() > 1) aside_there = std::max(aside_there, std::abs(state.velocity.y()));
    EXPECT_LE((state.position - Vector3d(0, 0, 1.6)).norm() + 0.4, 1.5 + 1e-6) << frame;
  }
  EXPECT_GT(rim, 0.7);
  EXPECT_GT(back, 1.5);
  EXPECT_GT(aside_there, 0.2);  // the baseline of its look from there
}

/// A wall 6 m wide that nothing is ever seen of, as one without texture: the way straight on stays the
/// shortest, and is given up for one around it.
TEST(LocalPlanner, GoesAroundWhatItNeverSees) {
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  for (int x = -40; x < 120; ++x) {
    for (int y = -70; y < 70; ++y) {
      const bool hidden = x >= 30 && x < 60 && std::abs(y) < 30;
      for (int z = 3; z < 33 && !hidden; ++z)
        tree->updateNode(
            octomap::OcTreeKey(static_cast<std::uint16_t>(32768 + x), static_cast<std::uint16_t>(32768 + y),
                               static_cast<std::uint16_t>(32768 + z)),
            false, true);
    }
  }
  tree->updateInnerOccupancy();
  const auto map = mapping::OccupancyMap::create({}, std::move(tree));
  ASSERT_TRUE(map.ok());
  const auto view = mapping::MapView::of(*map);
  const MapSpace space(view);
  LocalPlanner planner = planner_of();
  LocalWindow window;
  MotionState state = at_rest({0, 0, 1.6});
  const Vector3d goal(10, 0, 1.6);
  double nearest = kInfinity;  // to the hidden space
  int frame = 0;
  for (; frame < 900 && !is_at(goal, state.position, 1); ++frame) {
    window.set(*view, state.position, planner.radius());
    const LocalPlan& plan = planner.plan(state, goal, space, window);
    state = state_at(plan.motion, state.time + 0.1);
    const Vector3d beside = (state.position - Vector3d(4.5, 0, 0)).cwiseAbs() - Vector3d(1.5, 3, 0);
    nearest = std::min(nearest, std::hypot(std::max(beside.x(), 0.0), std::max(beside.y(), 0.0)));
  }
  EXPECT_LT(frame, 900);
  EXPECT_GT(nearest, 0.35);
}

}  // namespace
}  // namespace pade::planning
