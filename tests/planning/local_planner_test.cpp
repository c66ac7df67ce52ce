#include "pade/planning/local_planner.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace pade::planning {
namespace {

using Eigen::Vector3d;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Balls in free space, of which everything is known.
class Balls : public FreeSpace {
 public:
  struct Ball {
    Vector3d centre;
    double radius;
  };
  std::vector<Ball> balls;

  [[nodiscard]] double clearance(const Vector3d& p) const {
    double nearest = kInfinity;
    for (const Ball& ball : balls) nearest = std::min(nearest, (p - ball.centre).norm() - ball.radius);
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
    EXPECT_DOUBLE_EQ(plan.radius, 0.4);
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

TEST(LocalPlanner, FliesTheCommittedStopWhenNothingIsValid) {
  Balls space;
  LocalPlanner planner = planner_of();
  MotionState from = at_rest({0, 0, 1.6});
  from.velocity = {2, 0, 0};
  const LocalPlan first = planner.plan(from, {30, 0, 1.6}, space, unseen_window(from.position));
  ASSERT_EQ(first.kind, PlanKind::flying);
  const MotionState next = state_at(first.motion, 0.1);
  space.balls.push_back({{0.2, 0, 1.6}, 5});  // everything is occupied now
  const LocalPlan second = planner.plan(next, {30, 0, 1.6}, space, unseen_window(next.position));
  EXPECT_EQ(second.kind, PlanKind::committed);
  EXPECT_EQ(second.valid, 0);
  for (double t = 0.1; t < first.motion.back().time; t += 0.05)
    EXPECT_LT((state_at(second.motion, t).position - state_at(first.motion, t).position).norm(), 1e-6);
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

/// A bigger ball is planned for when the pose is uncertain, and more slowly.
TEST(LocalPlanner, TheMarginGrowsWithSigma) {
  Balls space;
  space.balls.push_back({{5, 0, 1.6}, 0.5});
  LocalPlanner sure = planner_of();
  LocalPlanner unsure = planner_of();
  const MotionState from = at_rest({0, 0, 1.6});
  const LocalPlan a = sure.plan(from, {30, 0, 1.6}, space, unseen_window(from.position), 0);
  const LocalPlan b = unsure.plan(from, {30, 0, 1.6}, space, unseen_window(from.position), 0.2);
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

}  // namespace
}  // namespace pade::planning
