// The way through the next seconds: of 63 motions that the vehicle can fly, the one that brings it nearest to
// the goal among those that it can fly, and stop after, in space that is known to be free.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "pade/core/result.hpp"
#include "pade/planning/free_space.hpp"
#include "pade/planning/local_guide.hpp"
#include "pade/planning/local_motion.hpp"
#include "pade/planning/local_options.hpp"
#include "pade/planning/local_window.hpp"

namespace pade::planning {

/// What the planner does.
enum class PlanKind {
  flying,      ///< one of the primitives is valid
  committed,   ///< none is: the stop that was found free before is flown to its end
  recovering,  ///< it stands or gets nowhere, and turns or hops to see more
  arrived,     ///< it is at the goal, and stops
};

/// The motion of the next seconds. It ends in a standstill.
struct LocalPlan {
  PlanKind kind = PlanKind::committed;
  MotionCommand command;            ///< zero where it brakes
  std::vector<MotionState> motion;  ///< from the state that was given to the standstill
  double speed_limit = 0;           ///< what the governor allows, m/s
  double free_reach = 0;            ///< that the ball gets straight ahead in known-free space, m
  double radius = 0;                ///< of the ball that was looked for: vehicle, margin and sigma, m
  int valid = 0;                    ///< primitives that were valid
  bool peering = false;             ///< it swings to see what lies straight ahead
};

/// Deterministic: the same calls, the same bits. Not thread-safe.
class LocalPlanner {
 public:
  /// Refuses options that make no sense.
  static Result<LocalPlanner> create(const LocalPlannerOptions& options = {});

  /// @param from    the state in which the vehicle will be when the plan takes effect
  /// @param goal    world, m
  /// @param space   what is free
  /// @param window  the same map about the vehicle: where obstacles are, to find a way around
  /// @param sigma   of the position, m: the margin grows with it
  /// @return valid until the next call
  const LocalPlan& plan(const MotionState& from, const Eigen::Vector3d& goal, const FreeSpace& space,
                        const LocalWindow& window, double sigma = 0);

  /// What a ball that the planner flies is grown to, m.
  [[nodiscard]] double radius(double sigma) const {
    return options_.vehicle.radius + options_.margin + options_.margin_sigmas * sigma;
  }
  [[nodiscard]] const LocalPlannerOptions& options() const { return options_; }

 private:
  explicit LocalPlanner(const LocalPlannerOptions& options) : options_(options) {}
  struct Task {
    const MotionState& from;
    const Eigen::Vector3d& goal;
    const FreeSpace& space;
    const LocalWindow& window;
  };
  [[nodiscard]] double free_reach(const Task& task);
  [[nodiscard]] bool is_blind_ahead(const Task& task) const;
  [[nodiscard]] bool is_valid(const Task& task, const std::vector<MotionState>& motion, bool any_way);
  [[nodiscard]] double score(const std::vector<MotionState>& motion) const;
  void choose_primitive(const Task& task);
  void commit(const Task& task);
  void recover(const Task& task);
  [[nodiscard]] double best_heading(const Task& task) const;
  bool try_hop(const Task& task, const MotionCommand& command);
  bool hop(const Task& task);
  bool goes_on_hopping(const Task& task);
  [[nodiscard]] bool gets_nowhere(const Task& task);

  LocalPlannerOptions options_;
  LocalGuide guide_;
  LocalPlan plan_;
  std::vector<MotionState> candidate_, committed_;
  std::vector<Eigen::Vector3d> path_;
  double standing_since_ = -1;  // s; negative = it moves
  int hops_ = 0;
  double hop_ends_ = -1;     // s; of the hop that is being flown
  double least_to_go_ = -1;  // the shortest way that was left so far, m; negative = not known
  double since_ = 0;         // when that was, s
};

}  // namespace pade::planning
