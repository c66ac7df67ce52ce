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
  double radius = 0;                ///< of the ball that was looked for: vehicle, margin and doubt, m
  int valid = 0;                    ///< primitives that were valid
  bool peering = false;             ///< it swings to see what lies straight ahead
};

/// How far the vehicle may be from where the plan has it. Both make the ball larger that has to fit.
struct PlaceDoubt {
  double sigma = 0;   ///< of its place in the map, m; makes it slower as well
  double offset = 0;  ///< from its plan, m
};

/// Deterministic: the same calls, the same bits. Not thread-safe.
class LocalPlanner {
 public:
  /// Refuses options that make no sense.
  static Result<LocalPlanner> create(const LocalPlannerOptions& options = {});

  /// The goal, or the place above or below it that is nearest to it in height where the vehicle may fly: as
  /// far as a goal is only as high as the satellites say, it may be believed anywhere. World, m.
  [[nodiscard]] Eigen::Vector3d attainable(const Eigen::Vector3d& goal) const;

  /// @param from    the state in which the vehicle will be when the plan takes effect
  /// @param wanted  the goal, world, m; attainable() of it is flown to
  /// @param space   what is free
  /// @param window  the same map about the vehicle: where obstacles are, to find a way around
  /// @return valid until the next call
  const LocalPlan& plan(const MotionState& from, const Eigen::Vector3d& wanted, const FreeSpace& space,
                        const LocalWindow& window, const PlaceDoubt& doubt = {});

  /// A standstill, for who sees nothing any more: braking at once, or what is left of the last plan where
  /// only that is free. Arguments and result as for plan().
  const LocalPlan& stop(const MotionState& from, const FreeSpace& space, const PlaceDoubt& doubt = {});

  /// What a ball that the planner flies is grown to, m.
  [[nodiscard]] double radius(const PlaceDoubt& doubt = {}) const {
    return options_.vehicle.radius + options_.margin + options_.margin_sigmas * doubt.sigma + doubt.offset;
  }
  [[nodiscard]] const LocalPlannerOptions& options() const { return options_; }

 private:
  explicit LocalPlanner(const LocalPlannerOptions& options) : options_(options) {}
  struct Place {
    const MotionState& from;
    const FreeSpace& space;
  };
  struct Task : Place {
    const Eigen::Vector3d& goal;
    const LocalWindow& window;
  };
  void begin(const Place& place, const PlaceDoubt& doubt);
  [[nodiscard]] double clear_radius(const Place& place);
  [[nodiscard]] double free_reach(const Place& place);
  [[nodiscard]] bool is_blind_ahead(const Task& task) const;
  [[nodiscard]] bool is_in_bounds(const Place& place, const std::vector<MotionState>& motion,
                                  bool any_way) const;
  [[nodiscard]] double clear_length(const Place& place, const std::vector<MotionState>& motion,
                                    double radius);
  [[nodiscard]] double clear_time(const Place& place, const std::vector<MotionState>& motion);
  [[nodiscard]] bool gets_clear(const Place& place, const std::vector<MotionState>& motion);
  [[nodiscard]] double score(const std::vector<MotionState>& motion) const;
  void choose_primitive(const Task& task);
  bool take_rest(const MotionState& from);
  void commit(const Place& place, bool prefers_rest);
  void recover(const Task& task);
  bool turn(const Task& task);
  [[nodiscard]] double best_heading(const Task& task) const;
  bool try_hop(const Task& task, const MotionCommand& command, double clear, double hold);
  bool hop(const Task& task);
  bool is_stuck_here(const Task& task);
  void give_up_what_is_ahead(const Task& task);
  bool back_off(const Task& task);
  bool step_aside(const Task& task);
  bool goes_on_retreating(const Task& task);
  bool goes_on_hopping(const Task& task);
  [[nodiscard]] bool gets_nowhere(const Task& task);

  LocalPlannerOptions options_;
  LocalGuide guide_;
  LocalPlan plan_;
  std::vector<MotionState> candidate_, committed_;
  std::vector<Eigen::Vector3d> path_;
  double wanted_ = 0;           // radius that is looked for, m
  double near_ = 0;             // what of it is clear where the plan begins, m
  double standing_since_ = -1;  // s; negative = it moves
  double turning_since_ = -1;   // s; negative = it does not turn on the spot
  int hops_ = 0;
  double hop_ends_ = -1;     // s; of the hop that is being flown
  double least_to_go_ = -1;  // the shortest way that was left so far, m; negative = not known
  double nearest_ = 0;       // the shortest of all since it last got nowhere, m
  int setbacks_ = 0;         // since then: how often the way turned out to be longer
  double since_ = 0;         // when least_to_go_ was, s

  enum class Retreat { none, turning, looking };  // before and after it backs off
  Retreat retreat_ = Retreat::none;
  Eigen::Vector3d stuck_at_ = Eigen::Vector3d::Zero();  // where it last began to hop
  int hops_here_ = 0;
  std::vector<HiddenSpace> hidden_;  // that it has given up to see
};

}  // namespace pade::planning
