#include "pade/closed_loop/chain_flight.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <deque>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "pade/closed_loop/passer_by.hpp"
#include "pade/core/option_check.hpp"
#include "pade/planning/local_window.hpp"
#include "pade/planning/map_space.hpp"
#include "pade/simulation/flight/frame_maker.hpp"

namespace pade::closed_loop {
namespace {

using Eigen::Vector3d;
using planning::MotionState;
using simulation::KinematicState;
constexpr double kLookAhead = 0.02;  // s, over which a plan's acceleration is read
constexpr double kClimbSpeed = 0.6;  // m/s
constexpr double kAtTheGoal = 5;     // m from the true goal: what single-point GNSS can promise
constexpr double kLost = 0.4;        // m from the plan: then it is made anew from where the vehicle is
constexpr double kRecent = 3;        // s of the own track that are known to be free
constexpr double kUnheld = 0.5;      // m/s, 1 sigma: with less known of its velocity it cannot even stand

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Pose body_pose(const KinematicState& state) { return {state.R_world_body, state.position}; }

MotionState level(const KinematicState& state, double time) {
  return {time, state.position, state.velocity, yaw_of(state.R_world_body)};
}

/// Straight on at constant velocity and turn.
KinematicState moved(const KinematicState& state, double seconds) {
  KinematicState out = state;
  out.position += seconds * state.velocity;
  out.R_world_body = state.R_world_body * rotation_exp(seconds * state.angular_velocity);
  return out;
}

simulation::FrameOptions frame_options(const ChainFlightOptions& options, std::uint64_t seed) {
  constexpr double kBlur = 0.01;  // s
  simulation::FrameOptions frame;
  frame.image = options.image;
  frame.render = options.render;
  frame.exposure_time = options.fault.kind == Fault::motion_blur ? kBlur : options.exposure_time;
  frame.seed = seed;
  return frame;
}

planning::LocalPlannerOptions with_heights_about(planning::LocalPlannerOptions options, double start,
                                                 double map) {
  options.vehicle.lowest += map - start;
  options.vehicle.highest += map - start;
  return options;
}

/// One flight while it goes on.
class ChainLoop {
 public:
  ChainLoop(const FlightTask& task, const ChainFlightOptions& options, ObstacleMapper mapper, double yaw)
      : task_(task),
        options_(options),
        camera_(forward_camera(options.width)),
        T_body_camera_{Eigen::Quaterniond(forward_camera_rotation()), Vector3d::Zero()},
        vehicle_(options.vehicle, options.fault, task.start - options.climb * Vector3d::UnitZ(), yaw,
                 task.seed),
        mapper_(std::move(mapper)),
        view_(mapping::MapView::of(mapper_.map())),
        maker_(task.scene, camera_, frame_options(options, task.seed)),
        watch_(task, options.planner.vehicle.radius) {}

  /// Somebody will cross the way.
  void await(PasserBy passer_by) { passer_by_ = std::move(passer_by); }
  Result<ChainRecord> run(const std::function<bool(const ChainMoment&)>& observer);

 private:
  [[nodiscard]] double now() const { return vehicle_.truth().time.seconds() - take_off_; }
  bool get_ready();
  bool take_off();
  void frame();
  [[nodiscard]] cv::Mat picture(Time& stamp);
  void look(const cv::Mat& image, Time stamp);
  bool place(Time stamp, Pose& pose, Matrix6d& covariance);
  [[nodiscard]] std::optional<Vector3d> rate(Time stamp);
  void correct_stamps();
  void look_at_navigation();
  void anchor(Time stamp, const Pose& T_map_camera);
  [[nodiscard]] MotionState start_of_plan(double effect) const;
  [[nodiscard]] std::shared_ptr<const mapping::MapView> known_about(const Vector3d& place);
  [[nodiscard]] planning::PlaceDoubt doubt();
  std::vector<MotionState> decide(double effect);
  [[nodiscard]] bool believes_itself_there() const;
  bool fly_until(int tick);
  void look_at_passer_by();
  void say(const std::string& what) { record_.events.push_back(fmt::format("{:.1f} s: {}", now(), what)); }

  const FlightTask& task_;
  const ChainFlightOptions& options_;
  Camera camera_;
  Pose T_body_camera_;
  NavigatedVehicle vehicle_;
  ObstacleMapper mapper_;
  std::shared_ptr<const mapping::MapView> view_;
  simulation::FrameMaker maker_;
  std::optional<PasserBy> passer_by_;
  bool touched_ = false;  // by it
  FlightWatch watch_;
  std::optional<planning::LocalPlanner> planner_;
  planning::LocalWindow window_;

  double take_off_ = 0;    // s of the simulation
  std::int64_t tick_ = 0;  // steps since take-off
  Pose T_map_smooth_, T_map_world_;
  double climbed_ = 0;  // s
  Vector3d ground_ = Vector3d::Zero(), map_start_ = Vector3d::Zero(),
           goal_ = Vector3d::Zero();           // goal: as navigation has the world
  std::optional<std::pair<Time, Pose>> last_;  // frame, as navigation has it
  Time taken_;                                 // of the last one that the mapper took
  Matrix6d since_taken_ = Matrix6d::Zero();    // of the motion from that one
  std::string skipped_;                        // why the last one was
  double stamp_correction_ = 0;                // s, of what the camera says
  Vector3d placed_ = Vector3d::Zero();         // by the mapper, the same frame
  double last_depth_ = 0;
  bool alone_ = false;                           // no satellites: dead reckoning
  bool unheld_ = false;                          // and too little is known of its velocity
  double offset_ = 0;                            // from the plan, the greatest of late, m
  std::deque<std::pair<double, Vector3d>> own_;  // believed places of the last seconds, map
  cv::Mat frozen_, image_;
  const MapperUpdate* update_ = nullptr;
  std::vector<MotionState> motion_;
  ChainRecord record_;
};

/// Stands until the filter knows where it looks.
bool ChainLoop::get_ready() {
  while (vehicle_.truth().time.seconds() < ChainFlightOptions::longest_stand) {
    vehicle_.stand();
    if (vehicle_.truth().time.seconds() < options_.stand - 1e-9) continue;
    const auto known = vehicle_.navigator().absolute_pose(vehicle_.truth().time);
    if (known.answer == navigation::Answer::valid) return true;
  }
  return false;
}

bool ChainLoop::take_off() {
  if (!get_ready()) return false;
  take_off_ = vehicle_.truth().time.seconds();
  const auto known = vehicle_.navigator().absolute_pose(vehicle_.truth().time);
  T_map_world_ = {};
  T_map_smooth_ = known.T_world_body * known.T_smooth_body.inverse();
  ground_ = known.T_world_body.translation;
  map_start_ = ground_ + options_.climb * Vector3d::UnitZ();
  goal_ = map_start_ + task_.goal - task_.start;
  record_.T_world_map = body_pose(vehicle_.truth()) * known.T_world_body.inverse();
  planner_ =
      planning::LocalPlanner::create(with_heights_about(options_.planner, task_.start.z(), map_start_.z()))
          .value();
  MotionState rest;
  rest.position = ground_;
  rest.yaw = yaw_of(known.T_world_body.rotation);
  planning::foretell(rest, {0, 0, kClimbSpeed, 0, 0}, options_.climb / kClimbSpeed, options_.planner.step,
                     options_.planner.vehicle, motion_);
  climbed_ = motion_.back().time;
  return true;
}

/// What the camera delivers now, and the stamp that it gives it.
cv::Mat ChainLoop::picture(Time& stamp) {
  const FaultOptions& fault = options_.fault;
  const bool late = fault.kind == Fault::late_stamps;
  const KinematicState at = vehicle_.truth_before(late ? fault.stamp_error : 0);
  if (fault.kind == Fault::early_stamps) stamp.nanoseconds -= std::llround(fault.stamp_error * 1e9);
  if (fault.is_on(Fault::frozen_camera, now()) && !frozen_.empty()) return frozen_;
  const auto pose_at = [&](double offset) { return body_pose(moved(at, offset)) * T_body_camera_; };
  simulation::Rendering light = maker_.expose(pose_at(0), pose_at);
  if (passer_by_) passer_by_->draw(light, pose_at(0), at.time.seconds() - take_off_);
  if (fault.kind == Fault::exposure_jump) {
    const bool bright = static_cast<int>(std::floor(now())) % 2 == 0;
    light.radiance *= bright ? 1.4 : 0.7;
  }
  frozen_ = maker_.picture(light, at.time);
  return frozen_;
}

/// Pose and covariance of a frame, from the last one that the mapper took. False if navigation cannot say.
bool ChainLoop::place(Time stamp, Pose& pose, Matrix6d& covariance) {
  if (!last_) {
    const auto known = vehicle_.navigator().absolute_pose(stamp);
    pose = T_map_smooth_ * known.T_smooth_body * T_body_camera_;
    covariance.setZero();
    return known.answer == navigation::Answer::valid;
  }
  const auto step = vehicle_.navigator().relative_pose(last_->first, stamp, T_body_camera_);
  if (step.answer != navigation::Answer::valid) return false;
  pose =
      last_->second * Pose{Eigen::Quaterniond(step.motion.R_reference_other), step.motion.t_reference_other};
  covariance = since_taken_ + step.motion.covariance;
  if (since_taken_.isZero(0)) return true;
  // What is wrong with one step, a velocity or a yaw, is wrong with the next: as long as navigation
  // remembers.
  const auto whole = vehicle_.navigator().relative_pose(taken_, stamp, T_body_camera_);
  if (whole.answer == navigation::Answer::valid) covariance = whole.motion.covariance;
  return true;
}

/// Of turn, camera axes, rad/s, over the last gyroscope sample before the stamp.
std::optional<Vector3d> ChainLoop::rate(Time stamp) {
  Time before = stamp;
  before.nanoseconds -= std::llround(NavigatedVehicle::step * 1e9);
  const auto then = vehicle_.navigator().absolute_pose(before);
  const auto now = vehicle_.navigator().absolute_pose(stamp);
  if (then.answer != navigation::Answer::valid || now.answer != navigation::Answer::valid)
    return std::nullopt;
  const Vector3d turned = rotation_log(then.T_smooth_body.rotation.conjugate() * now.T_smooth_body.rotation);
  return T_body_camera_.rotation.conjugate() * turned / NavigatedVehicle::step;
}

/// Where the filter's worlds lie in the map's, by a frame's pose there.
void ChainLoop::anchor(Time stamp, const Pose& T_map_camera) {
  const auto known = vehicle_.navigator().absolute_pose(stamp);
  if (known.answer != navigation::Answer::valid) return;
  const Pose T_map_body = T_map_camera * T_body_camera_.inverse();
  T_map_smooth_ = T_map_body * known.T_smooth_body.inverse();
  T_map_world_ = T_map_body * known.T_world_body.inverse();
}

void ChainLoop::look(const cv::Mat& image, Time stamp) {
  ChainFrame& out = record_.frames.back();
  stamp.nanoseconds += std::llround(stamp_correction_ * 1e9);
  stamp = std::min(stamp, vehicle_.truth().time);  // an image is not from the future
  Pose pose;
  Matrix6d covariance;
  if (!place(stamp, pose, covariance)) {
    out.outcome = MapperUpdate::Outcome::skipped;
    say("navigation has no pose for the frame");
    return;
  }
  const MapperUpdate& update = mapper_.add(image, stamp, pose, covariance, rate(stamp));
  out.outcome = update.outcome;
  if (update.outcome == MapperUpdate::Outcome::skipped) {
    if (skipped_.empty() || skipped_ != update.reason) say("frame skipped: " + update.reason);
    skipped_ = update.reason;
    view_ = view_->after(mapper_.map(), update.change);  // free space may be forgotten
    last_ = {stamp, pose};                               // the chain goes on
    since_taken_ = covariance;
    // It holds its place by the motions since, which do not follow the wander of the satellites' positions.
    anchor(stamp, pose);
    return;
  }
  if (last_) {
    out.given_step = (pose.translation - last_->second.translation).norm();
    out.step = (mapper_.T_world_camera().translation - placed_).norm();
  }
  placed_ = mapper_.T_world_camera().translation;
  since_taken_.setZero();
  taken_ = stamp;
  skipped_.clear();
  last_ = {stamp, pose};
  update_ = &update;
  anchor(stamp, mapper_.T_world_camera());
  if (update.outcome != MapperUpdate::Outcome::mapped) return;
  last_depth_ = now();
  out.views = update.views;
  out.refined = update.refinement.outcome == depth::RefinementOutcome::refined;
  view_ = view_->after(mapper_.map(), update.change);
  correct_stamps();
}

/// Images and poses tell different times: from now on the camera's stamps are corrected, that of the last
/// frame included.
void ChainLoop::correct_stamps() {
  const std::optional<StampOffset>& offset = mapper_.health().stamp_offset;
  if (!offset || !offset->is_certain()) return;
  stamp_correction_ += offset->seconds;
  for (Time* const time : {&last_->first, &taken_}) time->nanoseconds += std::llround(offset->seconds * 1e9);
  say(fmt::format(
      "the images show that their stamps are {:.1f} ms {} ({:.1f} ms, 1 sigma): corrected by {:.1f} ms",
      1e3 * std::abs(offset->seconds), offset->seconds < 0 ? "late" : "early", 1e3 * offset->sigma,
      1e3 * stamp_correction_));
  mapper_.forget_stamp_offset();
}

/// Where the vehicle will be when the plan that is made now takes effect.
MotionState ChainLoop::start_of_plan(double effect) const {
  MotionState planned = planning::state_at(motion_, effect);
  if (record_.frames.back().tracking < kLost) return planned;
  planned.velocity = vehicle_.believed_velocity();
  planned.position = vehicle_.believed().translation + (effect - now()) * planned.velocity;
  planned.yaw = yaw_of(vehicle_.believed().rotation);
  return planned;
}

/// The map, and what no camera has seen and is free: the climb, and where the vehicle itself has been.
std::shared_ptr<const mapping::MapView> ChainLoop::known_about(const Vector3d& place) {
  auto known = view_;
  const std::array start = {ground_, map_start_};
  const bool near_start = (place - map_start_).norm() < options_.known_start + kStartInSight;
  if (near_start && options_.known_start > 0) known = known->flown(start, options_.known_start);
  own_.emplace_back(now(), vehicle_.believed().translation);
  while (now() - own_.front().first > kRecent) own_.pop_front();
  std::vector<Vector3d> track;
  for (const auto& [time, at] : own_) track.push_back(at);
  return known->flown(track, options_.planner.vehicle.radius);
}

/// Without satellites the velocity drifts, and with it all that is planned and held by it.
void ChainLoop::look_at_navigation() {
  const double sigma = vehicle_.velocity_sigma();
  const navigation::NavigationStatus status = vehicle_.navigator().health().status;
  const bool alone =
      status == navigation::NavigationStatus::dead_reckoning || status == navigation::NavigationStatus::lost;
  if (alone != alone_)
    say(fmt::format("navigation {} (velocity: {:.2f} m/s, 1 sigma)",
                    !alone ? "knows its motion again"
                    : status == navigation::NavigationStatus::lost
                        ? "is lost: its measurements contradict each other"
                        : "has no satellites any more: dead reckoning",
                    sigma));
  alone_ = alone;
  const bool unheld = alone && sigma > kUnheld;
  if (unheld != unheld_)
    say(unheld ? fmt::format("its velocity is known to {:.2f} m/s (1 sigma), too little to fly by: it brakes",
                             sigma)
               : "its velocity is known again");
  unheld_ = unheld;
}

/// The whole way that it is beside its plan, for a while; and how sure the motion since the last image is,
/// and without satellites the one until it stands.
planning::PlaceDoubt ChainLoop::doubt() {
  constexpr double kFades = 0.9;  // a frame
  offset_ = std::max(kFades * offset_, record_.frames.back().tracking);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(since_taken_.topLeftCorner<3, 3>(),
                                                              Eigen::EigenvaluesOnly);
  const planning::VehicleLimits& vehicle = options_.planner.vehicle;
  const double until_rest = vehicle.latency + vehicle_.believed_velocity().norm() / vehicle.acceleration;
  const double drift = alone_ ? vehicle_.velocity_sigma() * until_rest : 0;
  return {std::sqrt(std::max(spread.eigenvalues().maxCoeff(), 0.0) + drift * drift), offset_};
}

std::vector<MotionState> ChainLoop::decide(double effect) {
  const double time = now();
  ChainFrame& frame = record_.frames.back();
  frame.tracking =
      tick_ == 0 ? 0 : (vehicle_.believed().translation - planning::state_at(motion_, time).position).norm();
  if (effect < climbed_) {
    watch_.add({time, planning::PlanKind::committed, 0, 0, 0});
    return motion_;
  }
  const MotionState from = start_of_plan(effect);
  look_at_navigation();
  const planning::PlaceDoubt doubt = this->doubt();
  const auto known = known_about(from.position);
  const planning::MapSpace space(known);
  frame.blind = time - last_depth_ > options_.blind_after;
  frame.unheld = unheld_;
  frame.alone = alone_;
  if (frame.blind || frame.unheld) {
    watch_.add({time, planning::PlanKind::committed, 0, 0, 0});
    return planner_->stop(from, space, doubt).motion;
  }
  window_.set(*known, from.position, planner_->radius(doubt));
  const Vector3d goal = T_map_world_ * goal_;
  const planning::LocalPlan& plan = planner_->plan(from, goal, space, window_, doubt);
  watch_.add({time, plan.kind, plan.speed_limit, plan.free_reach, plan.valid});
  return plan.motion;
}

/// Whoever walks into a vehicle that stands is no mistake of the vehicle: it is said, and the flight goes on.
void ChainLoop::look_at_passer_by() {
  if (!passer_by_) return;
  const double distance = passer_by_->distance(vehicle_.truth().position, now());
  record_.passer_by_clearance = std::min(record_.passer_by_clearance.value_or(distance), distance);
  if (distance >= options_.planner.vehicle.radius || touched_) return;
  touched_ = true;
  say(fmt::format("the passer-by touches the vehicle, which flies at {:.1f} m/s",
                  vehicle_.truth().velocity.norm()));
}

bool ChainLoop::believes_itself_there() const {
  return planning::is_at(planner_->attainable(T_map_world_ * goal_), vehicle_.believed().translation,
                         options_.planner.arrival);
}

/// False if it touches something or believes itself at the goal.
bool ChainLoop::fly_until(int tick) {
  constexpr int kLookEvery = 2;  // steps: 100 Hz
  for (; tick_ < tick; ++tick_) {
    const double time = now();
    const MotionState asked = planning::state_at(motion_, time);
    const MotionState next = planning::state_at(motion_, time + kLookAhead);
    vehicle_.fly({asked.position, asked.velocity, (next.velocity - asked.velocity) / kLookAhead, asked.yaw},
                 T_map_smooth_, time);
    if (tick_ % kLookEvery != 0) continue;
    if (!watch_.look(level(vehicle_.truth(), now()))) return false;
    look_at_passer_by();
    if (believes_itself_there()) return false;
  }
  return true;
}

void ChainLoop::frame() {
  const double time = now();
  ChainFrame frame;
  frame.time = time;
  const auto number = static_cast<int>(record_.frames.size());
  const bool arrives = options_.fault.kind != Fault::dropped_frames || !is_dropped(task_.seed, number);
  Time stamp = vehicle_.truth().time;
  image_ = arrives ? picture(stamp) : cv::Mat();
  update_ = nullptr;
  record_.frames.push_back(frame);
  const double began = processor_seconds();
  if (arrives) {
    look(image_, stamp);
  } else {
    view_ = view_->after(mapper_.map(), mapper_.forget(stamp));
  }
  const Eigen::Vector3d& truth = vehicle_.truth().position;
  record_.frames.back().believed =
      tick_ == 0 ? truth : (record_.T_world_map * vehicle_.believed()).translation;
  record_.frames.back().drift = (record_.frames.back().believed - truth).norm();
  record_.frames.back().seconds = processor_seconds() - began;
}

Result<ChainRecord> ChainLoop::run(const std::function<bool(const ChainMoment&)>& observer) {
  const int ticks =
      std::max(1, static_cast<int>(std::lround(1 / (options_.frame_rate * NavigatedVehicle::step))));
  const double period = ticks * NavigatedVehicle::step;
  const auto finish = [&](Outcome outcome) -> Result<ChainRecord> {
    record_.flight = watch_.finished(outcome, climbed_);
    record_.view = view_;
    record_.climbed = climbed_;
    record_.stamp_correction = stamp_correction_;
    record_.mapper = std::make_shared<ObstacleMapper>(std::move(mapper_));
    for (const ChainFrame& f : record_.frames) {
      record_.seconds_blind += f.blind ? period : 0;
      record_.seconds_unheld += f.unheld ? period : 0;
      record_.seconds_alone += f.alone ? period : 0;
    }
    return std::move(record_);
  };
  if (!take_off()) return finish(Outcome::never_ready);
  if (std::abs(period * options_.frame_rate - 1) > 1e-9)
    say(fmt::format("frame_rate {} is flown as {:.2f} Hz: whole steps of {} s", options_.frame_rate,
                    1 / period, NavigatedVehicle::step));
  const double way = (task_.goal - task_.start).norm();
  while (now() < climbed_ + options_.time_limit) {
    frame();
    const double began = processor_seconds();
    std::vector<MotionState> next = decide(now() + period);
    record_.frames.back().seconds += processor_seconds() - began;
    if (observer && !observer({std::clamp(1 - watch_.goal_distance() / way, 0.0, 1.0), image_, update_,
                               record_.frames.back()}))
      return Error{"the flight was interrupted"};
    const auto until = static_cast<int>(tick_) + ticks;
    if (!fly_until(until)) {
      if (!believes_itself_there()) return finish(Outcome::timed_out);
      return finish(watch_.from_goal().norm() < kAtTheGoal ? Outcome::arrived : Outcome::astray);
    }
    motion_ = std::move(next);
  }
  return finish(Outcome::timed_out);
}

}  // namespace

Result<ChainRecord> fly_chain(const FlightTask& task, const ChainFlightOptions& options,
                              const std::function<bool(const ChainMoment&)>& observer) {
  if (const Status s = check(options); !s) return s.error();
  auto mapper = ObstacleMapper::create(forward_camera(options.width), options.mapper);
  if (!mapper) return mapper.error();
  const Vector3d way = task.goal - task.start;
  ChainLoop loop(task, options, std::move(mapper).value(), std::atan2(way.y(), way.x()));
  if (options.fault.kind == Fault::crossing) {
    auto passer_by = PasserBy::create(task, forward_camera(options.width), frame_options(options, task.seed),
                                      options.fault.crossing_ahead, options.fault.crossing_at);
    if (!passer_by) return passer_by.error();
    loop.await(std::move(passer_by).value());
  }
  return loop.run(observer);
}

}  // namespace pade::closed_loop
