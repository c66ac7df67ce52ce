#include "pade/planning/global/path_search.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>
#include <utility>

#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/base/terminationconditions/IterationTerminationCondition.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/PathSimplifier.h>
#include <ompl/geometric/planners/rrt/InformedRRTstar.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

namespace pade::planning {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using Eigen::Vector3d;
using mapping::MapView;
using mapping::UnknownSpace;

constexpr double kLongestStep = 2;   // of a tree, m
constexpr double kAroundTheMap = 2;  // where unknown space is free, m
constexpr unsigned kShortenRounds = 4;
constexpr unsigned kShortcuts = 200;  // tries per round

/// OMPL seeds its generators from one that all share, so one search at a time.
std::mutex& ompl_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// Keeps OMPL from the terminal and what it calls errors for us.
class Listener : public ompl::msg::OutputHandler {
 public:
  explicit Listener(std::vector<std::string>& complaints)
      : complaints_(complaints), before_(ompl::msg::getOutputHandler()) {
    ompl::msg::useOutputHandler(this);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() override { ompl::msg::useOutputHandler(before_); }
  void log(const std::string& text, ompl::msg::LogLevel level, const char* /*file*/, int /*line*/) override {
    if (level >= ompl::msg::LOG_ERROR && listening_) complaints_.push_back(text);
  }
  void listen() { listening_ = true; }

 private:
  std::vector<std::string>& complaints_;
  ompl::msg::OutputHandler* before_;
  bool listening_ = false;
};

Vector3d point_of(const ob::State* state) {
  const double* v = state->as<ob::RealVectorStateSpace::StateType>()->values;
  return {v[0], v[1], v[2]};
}

/// Asks the map.
class Corridor : public ob::MotionValidator {
 public:
  Corridor(const ob::SpaceInformationPtr& space, const MapView& view, double radius, UnknownSpace unknown,
           const std::function<bool()>& stop)
      : ob::MotionValidator(space), view_(view), radius_(radius), unknown_(unknown), stop_(stop) {}
  /// False too once it is to stop: one iteration of RRT-Connect may go on for any number of motions.
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    return !is_to_stop() && !view_.sweep(std::array{point_of(from), point_of(to)}, radius_, unknown_);
  }
  bool checkMotion(const ob::State* from, const ob::State* to,
                   std::pair<ob::State*, double>& last) const override {
    if (is_to_stop()) {
      last.second = 0;
      if (last.first != nullptr) si_->copyState(last.first, from);
      return false;
    }
    const auto hit = view_.sweep(std::array{point_of(from), point_of(to)}, radius_, unknown_);
    if (!hit) return true;
    last.second = hit->share;
    if (last.first != nullptr) si_->getStateSpace()->interpolate(from, to, hit->share, last.first);
    return false;
  }

 private:
  const MapView& view_;
  [[nodiscard]] bool is_to_stop() const { return stop_ && stop_(); }

  double radius_;
  UnknownSpace unknown_;
  const std::function<bool()>& stop_;
};

class Search {
 public:
  Search(const MapView& view, const Vector3d& start, const Vector3d& goal, const RouteOptions& options,
         double margin, std::function<bool()> stop)
      : options_(options), stop_(std::move(stop)), space_(std::make_shared<ob::RealVectorStateSpace>(3)) {
    Eigen::AlignedBox3d box = view.bounds();
    if (options.unknown == UnknownSpace::free) {
      box.extend(start).extend(goal);
      box = {box.min().array() - kAroundTheMap, box.max().array() + kAroundTheMap};
    }
    ob::RealVectorBounds bounds(3);
    for (unsigned axis = 0; axis < 3; ++axis) {
      bounds.setLow(axis, box.min()[axis]);
      bounds.setHigh(axis, box.max()[axis]);
    }
    space_->setBounds(bounds);
    info_ = std::make_shared<ob::SpaceInformation>(space_);
    const double radius = options.radius + margin;
    info_->setStateValidityChecker([&view, radius, unknown = options.unknown](const ob::State* state) {
      return !view.sweep(std::array{point_of(state)}, radius, unknown);
    });
    info_->setMotionValidator(std::make_shared<Corridor>(info_, view, radius, options.unknown, stop_));
    info_->setup();
    problem_ = std::make_shared<ob::ProblemDefinition>(info_);
    problem_->setStartAndGoalStates(state_of(start), state_of(goal));
    problem_->setOptimizationObjective(std::make_shared<ob::PathLengthOptimizationObjective>(info_));
  }

  std::vector<Vector3d> run() {
    auto connect = std::make_shared<og::RRTConnect>(info_);
    connect->setRange(kLongestStep);
    std::vector<Vector3d> best = solve(connect, options_.iterations);
    if (best.empty() || options_.improvements == 0) return best;
    auto informed = std::make_shared<og::InformedRRTstar>(info_);
    informed->setRange(kLongestStep);
    const std::vector<Vector3d> other = solve(informed, options_.improvements);
    if (!other.empty() && length_of(other) < length_of(best)) best = other;
    return best;
  }

 private:
  ob::ScopedState<> state_of(const Vector3d& point) const {
    ob::ScopedState<> state(space_);
    for (unsigned axis = 0; axis < 3; ++axis) state[axis] = point[axis];
    return state;
  }
  static double length_of(const std::vector<Vector3d>& path) {
    double length = 0;
    for (std::size_t i = 0; i + 1 < path.size(); ++i) length += (path[i + 1] - path[i]).norm();
    return length;
  }

  std::vector<Vector3d> solve(const ob::PlannerPtr& planner, int iterations) {
    problem_->clearSolutionPaths();
    planner->setProblemDefinition(problem_);
    planner->setup();
    ob::IterationTerminationCondition end(static_cast<unsigned>(iterations));
    if (stop_) {
      planner->solve(ob::plannerOrTerminationCondition(end, ob::PlannerTerminationCondition(stop_)));
    } else {
      planner->solve(end);
    }
    if (!problem_->hasExactSolution()) return {};
    auto* path = problem_->getSolutionPath()->as<og::PathGeometric>();
    og::PathSimplifier shorten(info_);
    for (unsigned i = 0; i < kShortenRounds; ++i) {
      shorten.reduceVertices(*path);
      shorten.shortcutPath(*path, kShortcuts, kShortcuts);
    }
    shorten.reduceVertices(*path);
    std::vector<Vector3d> corners;
    for (const ob::State* state : path->getStates()) {
      const Vector3d point = point_of(state);
      if (corners.empty() || (point - corners.back()).norm() > 1e-9) corners.push_back(point);
    }
    return corners;
  }

  RouteOptions options_;
  std::function<bool()> stop_;
  std::shared_ptr<ob::RealVectorStateSpace> space_;
  ob::SpaceInformationPtr info_;
  ob::ProblemDefinitionPtr problem_;
};

}  // namespace

FoundPath search_path(const MapView& view, const Vector3d& start, const Vector3d& goal,
                      const RouteOptions& options, double margin, const std::function<bool()>& stop) {
  const std::lock_guard lock(ompl_mutex());
  FoundPath found;
  Listener listener(found.complaints);
  ompl::RNG::setSeed(static_cast<std::uint_fast32_t>(options.seed));
  listener.listen();
  found.corners = Search(view, start, goal, options, margin, stop).run();
  return found;
}

}  // namespace pade::planning
