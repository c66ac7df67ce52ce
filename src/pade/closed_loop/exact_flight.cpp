#include "pade/closed_loop/exact_flight.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "pade/core/option_check.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/planning/local_window.hpp"
#include "pade/planning/map_space.hpp"
#include "pade/simulation/render/truth.hpp"

namespace pade::closed_loop {
namespace {

using Eigen::Vector3d;
using planning::MotionState;
constexpr double kSampleRate = 100;  // Hz, of the look at the true surface

Pose camera_at(const MotionState& state) {
  const Pose body{Eigen::Quaterniond(Eigen::AngleAxisd(state.yaw, Vector3d::UnitZ())), state.position};
  return body * Pose{Eigen::Quaterniond(forward_camera_rotation()), Vector3d::Zero()};
}

/// What a perfect depth camera says: depth where there is a surface, and that nothing is nearer than it.
DepthImage depth_image(const cv::Mat& exact, double time) {
  constexpr float kSky = 1000;
  DepthImage image;
  image.time = Time::from_seconds(time);
  image.depth = exact;
  image.state.create(exact.size(), CV_8UC1);
  image.bound.create(exact.size(), CV_32FC1);
  for (int v = 0; v < exact.rows; ++v) {
    for (int u = 0; u < exact.cols; ++u) {
      const float depth = exact.at<float>(v, u);
      const bool seen = std::isfinite(depth);
      image.state.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(seen ? DepthState::measured : DepthState::far);
      image.bound.at<float>(v, u) = seen ? depth : kSky;
    }
  }
  return image;
}

/// One flight while it goes on.
class ExactLoop {
 public:
  ExactLoop(const FlightTask& task, const ExactFlightOptions& options, planning::LocalPlanner planner,
            mapping::OccupancyMap map)
      : task_(task),
        options_(options),
        planner_(std::move(planner)),
        map_(std::move(map)),
        view_(mapping::MapView::of(map_)),
        camera_(forward_camera(options.width)),
        grid_(camera_),
        watch_(task, options.planner.vehicle.radius) {
    const Vector3d way = task.goal - task.start;
    MotionState rest;
    rest.position = task.start;
    rest.yaw = std::atan2(way.y(), way.x());
    motion_ = {rest};
  }

  FlightRecord run();

 private:
  void see(double time);
  std::vector<MotionState> decide(double time, double effect);
  bool advance(double from, double to);
  [[nodiscard]] bool is_there() const {
    return planning::is_at(Vector3d::Zero(), watch_.from_goal(), options_.planner.arrival);
  }

  const FlightTask& task_;
  const ExactFlightOptions& options_;
  planning::LocalPlanner planner_;
  mapping::OccupancyMap map_;
  std::shared_ptr<const mapping::MapView> view_;
  planning::LocalWindow window_;
  Camera camera_;
  simulation::RayGrid grid_;
  std::vector<MotionState> motion_;
  FlightWatch watch_;
};

void ExactLoop::see(double time) {
  const Pose pose = camera_at(planning::state_at(motion_, time));
  const mapping::MapChange change =
      map_.integrate(depth_image(simulation::exact_depth(task_.scene, grid_, pose), time), camera_, pose);
  view_ = view_->after(map_, change);
}

std::vector<MotionState> ExactLoop::decide(double time, double effect) {
  const MotionState then = planning::state_at(motion_, effect);
  const std::array start = {task_.start};
  const bool near_start = (then.position - task_.start).norm() < options_.known_start + kStartInSight;
  const auto known =
      near_start && options_.known_start > 0 ? view_->flown(start, options_.known_start) : view_;
  window_.set(*known, then.position, planner_.radius());
  const planning::MapSpace space(known);
  const planning::LocalPlan& plan = planner_.plan(then, task_.goal, space, window_);
  watch_.add({time, plan.kind, plan.speed_limit, plan.free_reach, plan.valid});
  return plan.motion;
}

/// False if it ends here.
bool ExactLoop::advance(double from, double to) {
  const int samples = static_cast<int>(std::lround((to - from) * kSampleRate));
  for (int i = 1; i <= samples; ++i) {
    if (!watch_.look(planning::state_at(motion_, from + i / kSampleRate))) return false;
    if (is_there()) return false;
  }
  return true;
}

FlightRecord ExactLoop::run() {
  const double period = 1 / options_.frame_rate;
  double time = 0;
  for (int frame = 0; time < options_.time_limit; ++frame) {
    time = frame * period;
    see(time);
    std::vector<MotionState> next = decide(time, time + period);
    if (!advance(time, time + period)) break;
    motion_ = std::move(next);
  }
  return watch_.finished(is_there() ? Outcome::arrived : Outcome::timed_out);
}

}  // namespace

mapping::MapOptions ExactFlightOptions::exact_map() {
  mapping::MapOptions map;
  map.range = 8;
  map.looks_baseline = 0;
  map.hit_near = map.range;
  return map;
}

Result<FlightRecord> fly_exact(const FlightTask& task, const ExactFlightOptions& options) {
  const std::array<OptionRange, 4> ranges = {{{"frame_rate", options.frame_rate, 1, 100},
                                              {"time_limit", options.time_limit, above_zero, 1e5},
                                              {"known_start", options.known_start, 0, 100},
                                              {"width", static_cast<double>(options.width), 32, 4096}}};
  if (const Status s = check_ranges(ranges); !s) return s.error();
  auto planner = planning::LocalPlanner::create(options.planner);
  if (!planner) return Error{"planner: " + planner.error().message};
  auto map = mapping::OccupancyMap::create(options.map);
  if (!map) return map.error();
  return ExactLoop(task, options, std::move(planner).value(), std::move(map).value()).run();
}

}  // namespace pade::closed_loop
