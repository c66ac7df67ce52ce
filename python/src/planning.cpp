// The local planner: the motion of the next seconds through a map.
#include <array>
#include <cmath>
#include <mutex>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "pade/planning/local_planner.hpp"
#include "pade/planning/local_window.hpp"
#include "pade/planning/map_space.hpp"

#include "convert.hpp"
#include "handles.hpp"

namespace pade::python {
namespace {

using planning::LocalPlan;
using planning::MotionState;

std::string name_of(planning::PlanKind kind) {
  constexpr std::array<const char*, 4> names = {"flying", "committed", "recovering", "arrived"};
  return names[static_cast<std::size_t>(kind)];
}

/// A planner with its window of the map; calls from several threads wait for each other.
class Planner {
 public:
  explicit Planner(const py::object& options)
      : planner_(
            value_of(planning::LocalPlanner::create(options_of(options, planning::LocalPlannerOptions())))) {}

  LocalPlan plan(const ViewHandle& handle, double time, const py::object& position,
                 const py::object& velocity, double yaw, const py::object& goal, double sigma,
                 double offset) {
    const MotionState from{time, vector_of(position, "position"), vector_of(velocity, "velocity"), yaw};
    const Eigen::Vector3d there = vector_of(goal, "goal");
    if (!std::isfinite(time) || !std::isfinite(yaw) || !from.position.allFinite() ||
        !from.velocity.allFinite() || !there.allFinite()) {
      throw Refused("time, position, velocity, yaw, goal: found NaN or infinity, expected finite numbers");
    }
    constexpr double kFastest = 50;   // m/s; what is looked at grows with both
    constexpr double kLeastSure = 5;  // m
    if (from.velocity.norm() > kFastest) {
      throw Refused(
          fmt::format("velocity: found {:.3g} m/s, expected at most {}", from.velocity.norm(), kFastest));
    }
    if (!(sigma >= 0 && sigma <= kLeastSure) || !(offset >= 0 && offset <= kLeastSure)) {
      throw Refused(
          fmt::format("sigma, offset: found {} and {}, expected 0 to {} m", sigma, offset, kLeastSure));
    }
    return without_gil(mutex_, [&] {
      const planning::PlaceDoubt doubt{sigma, offset};
      window_.set(*handle.view, from.position, planner_.radius(doubt));
      return planner_.plan(from, there, planning::MapSpace(handle.view), window_, doubt);
    });
  }
  [[nodiscard]] py::dict options() const { return dict_of(planner_.options()); }

 private:
  std::mutex mutex_;
  planning::LocalPlanner planner_;
  planning::LocalWindow window_;
};

/// A number of each state of the motion.
template <class Value>
py::array_t<double> along(const LocalPlan& plan, Value&& value) {
  py::array_t<double> array(static_cast<py::ssize_t>(plan.motion.size()));
  double* out = array.mutable_data();
  for (const MotionState& state : plan.motion) *out++ = value(state);
  return array;
}
py::array_t<double> vectors(const LocalPlan& plan, Eigen::Vector3d MotionState::*member) {
  std::vector<Eigen::Vector3d> list;
  for (const MotionState& state : plan.motion) list.push_back(state.*member);
  return array_of(list);
}

void add_plan(py::module_& module) {
  py::class_<LocalPlan>(module, "LocalPlan", "The motion of the next seconds. It ends in a standstill.")
      .def_property_readonly(
          "kind", [](const LocalPlan& plan) { return name_of(plan.kind); },
          "flying; committed: the stop that was found free before is flown to its end; recovering: it turns "
          "or hops to "
          "see more; arrived.")
      .def_property_readonly(
          "times", [](const LocalPlan& plan) { return along(plan, [](const auto& s) { return s.time; }); },
          "float64 (n,), s.")
      .def_property_readonly(
          "positions", [](const LocalPlan& plan) { return vectors(plan, &MotionState::position); },
          "float64 (n, 3), world, m.")
      .def_property_readonly(
          "velocities", [](const LocalPlan& plan) { return vectors(plan, &MotionState::velocity); },
          "float64 (n, 3), world, m/s.")
      .def_property_readonly(
          "yaws", [](const LocalPlan& plan) { return along(plan, [](const auto& s) { return s.yaw; }); },
          "float64 (n,), of the nose from east towards north, rad.")
      .def_property_readonly(
          "command",
          [](const LocalPlan& plan) {
            return py::dict(py::arg("forward") = plan.command.forward, py::arg("left") = plan.command.left,
                            py::arg("climb") = plan.command.climb,
                            py::arg("yaw_rate") = plan.command.yaw_rate,
                            py::arg("swing") = plan.command.swing);
          },
          "What the motion begins with: forward, left, climb (m/s, along the nose), yaw_rate (rad/s), swing "
          "(m); zero where it brakes.")
      .def_readonly("speed_limit", &LocalPlan::speed_limit, "What the way that is seen ahead allows, m/s.")
      .def_readonly("free_reach", &LocalPlan::free_reach,
                    "That the ball gets straight ahead in known-free space, m.")
      .def_readonly("radius", &LocalPlan::radius,
                    "Of the ball that was looked for: vehicle, margin and doubt, m.")
      .def_readonly("choices", &LocalPlan::valid, "How many of the motions that it tried were valid.")
      .def("__repr__", [](const LocalPlan& plan) {
        return fmt::format("<pade.LocalPlan: {}, {} states>", name_of(plan.kind), plan.motion.size());
      });
}

}  // namespace

void add_planning(py::module_& module) {
  add_plan(module);
  py::class_<Planner>(module, "LocalPlanner",
                      "The way through the next seconds: of the motions that a quadrotor can fly, the one "
                      "that brings it nearest to the goal "
                      "among those that it can fly, and stop after, in space that is known to be free. Calls "
                      "from several threads wait for "
                      "each other.")
      .def(py::init<const py::object&>(), py::arg("options") = py::none(),
           "options: dict, YAML text or pathlib.Path, the names below planner of a file for `pade fly`.")
      .def("plan", &Planner::plan, py::arg("view"), py::arg("time"), py::arg("position"), py::arg("velocity"),
           py::arg("yaw"), py::arg("goal"), py::kw_only(), py::arg("sigma") = 0.0, py::arg("offset") = 0.0,
           "A LocalPlan from the state in which the vehicle will be when it takes effect: time in s, "
           "position and velocity (3,) in m and "
           "m/s, world, yaw in rad, to goal (3,), m. sigma: of its place in the map, m; offset: from its "
           "plan, m.")
      .def_property_readonly("options", &Planner::options, "All options, with their defaults.")
      .def("__repr__", [](const Planner&) { return "<pade.LocalPlanner>"; });
}

}  // namespace pade::python
