#include "sensor_poses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <pade/io/navigation/geodetic_fixes.hpp>
#include <pade/navigation/navigator.hpp>

namespace pade_ros {
namespace {

using pade::Pose;
using pade::seconds_between;
using pade::Time;
using pade::navigation::Answer;
using pade::navigation::NavigationStatus;
using pade::navigation::Navigator;

constexpr double kPatience = 5;  // s, until the antenna is taken to be at the IMU

Eigen::Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

class SensorPoses : public PoseInput {
 public:
  SensorPoses(const NodeOptions& options, Topics topics, Transforms& transforms)
      : options_(options),
        navigator_options_(options.navigator),
        topics_(std::move(topics)),
        transforms_(transforms),
        mounting_(options, transforms),
        navigator_(options.navigator) {}

  void add(const ImuMessage& message) override {
    const std::lock_guard lock(mutex_);
    imu_rate_.tick(steady_seconds());
    if (!message.complete) {
      ++incomplete_;
      return;
    }
    const Time time{message.stamp};
    if (seconds_between(time, newest_imu_) > kClockWentBack) {
      begin_anew(
          fmt::format("the stamps of the IMU went back by {:.1f} s", seconds_between(time, newest_imu_)));
    }
    newest_imu_ = time;
    imu_frame_ = frame_name(message.frame.empty() ? options_.base_frame : message.frame);
    give(pade::ImuSample{time, vector(message.angular_rate), vector(message.specific_force)});
    if (const std::uint64_t restarts = navigator_.health().restarts; restarts != restarts_) {
      restarts_ = restarts;
      ++jumps_;
      last_jump_ = "the filter started anew";
    }
  }

  void add(const FixMessage& message) override {
    const std::lock_guard lock(mutex_);
    fix_rate_.tick(steady_seconds());
    const bool usable = message.status >= 0 && std::abs(message.latitude) <= 90 &&
                        std::abs(message.longitude) <= 360 && std::abs(message.height) <= 1e6;
    if (!usable) {
      ++without_fix_;
      return;
    }
    if (origin_) return take(message);
    hold({message.stamp}, message);
    ++held_fixes_;
    if (knows_lever_arm(message)) take_held();
  }

  void add(const VelocityMessage& message) override {
    const std::lock_guard lock(mutex_);
    pade::GnssVelocity velocity{{message.stamp}, vector(message.velocity), {}};
    Eigen::Vector3d variance = vector(message.variance);
    // Where the accuracy is not stated: as pade navigate has it, and what does not climb is not measured.
    constexpr double kUsual = 0.15;  // m/s
    for (int axis = 0; axis < 3; ++axis)
      if (!(variance[axis] > 0) || !std::isfinite(variance[axis])) variance[axis] = kUsual * kUsual;
    if (!std::isfinite(velocity.velocity.z()) || velocity.velocity.z() == 0) {
      velocity.velocity.z() = 0;
      variance.z() = pade::io::open_vertical_velocity * pade::io::open_vertical_velocity;
    }
    velocity.covariance = variance.asDiagonal();
    give(velocity);
    ++velocities_;
  }

  void add(const FieldMessage& message) override {
    const std::lock_guard lock(mutex_);
    constexpr double kSigma = 0.05;
    constexpr double kGaussPerTesla = 1e4;
    Eigen::Vector3d field = kGaussPerTesla * vector(message.tesla);
    if (!field.allFinite() || field.isZero(0) || imu_frame_.empty()) return;
    if (const std::string frame = frame_name(message.frame); !frame.empty() && frame != imu_frame_) {
      Placement placement;
      std::string why;
      const auto answer = transforms_.find(imu_frame_, frame, message.stamp, placement, why);
      if (answer == Transforms::Answer::valid)
        field = pose_of(placement).rotation * field;
      else
        field_remark_ =
            fmt::format("taken as if the axes of {} were those of {}: {}", frame, imu_frame_, why);
    }
    give(pade::MagneticField{{message.stamp}, field, kSigma});
    ++fields_;
  }

  void add(const PressureMessage& message) override {
    const std::lock_guard lock(mutex_);
    constexpr double kSigma = 0.3;  // m
    if (!(message.pascal > 1e4 && message.pascal < 1.2e5)) return;
    give(
        pade::BarometricHeight{{message.stamp}, pade::io::height_of_pressure(0.01 * message.pascal), kSigma});
    ++heights_;
  }

  PoseReply at(Time time, const std::string& camera) override {
    const std::lock_guard lock(mutex_);
    PoseReply reply;
    reply.jumps = jumps_;
    reply.last_jump = last_jump_;
    const auto never = [&](const char* why) {
      reply.kind = PoseReply::Kind::never;
      reply.why = why;
      return reply;
    };
    if (imu_frame_.empty()) {
      reply.why = "no message of the IMU has come";
      return reply;
    }
    if (!origin_ && held_fixes_ > 0) {
      reply.why = waits_for_;
      return reply;
    }
    const auto pose = navigator_.absolute_pose(time);
    if (navigator_.health().status == NavigationStatus::lost) return never("the filter is lost");
    switch (pose.answer) {
      case Answer::too_new:
        reply.why = "no pose in time";
        return reply;
      case Answer::not_initialised:
        return never("the filter had not started");
      case Answer::too_old:
        return never("the filter remembers nothing of that time");
      case Answer::valid:
        break;
    }
    const auto mounting = mounting_.of(imu_frame_, camera, time, reply);
    if (!mounting) return reply;
    T_body_camera_ = *mounting;
    reply.kind = PoseReply::Kind::valid;
    reply.T_world_body = pose.T_smooth_body;
    reply.T_world_camera = pose.T_smooth_body * *mounting;
    if (options_.publish_tf) place_body(time, reply);
    return reply;
  }

  std::optional<pade::Matrix6d> covariance(Time t1, Time t2) override {
    const std::lock_guard lock(mutex_);
    const auto motion = navigator_.relative_pose(t1, t2, T_body_camera_);
    if (motion.answer != Answer::valid) return std::nullopt;
    return motion.motion.covariance;
  }

  void clear_after(Time now) override {
    const std::lock_guard lock(mutex_);
    if (seconds_between(now, newest_imu_) > kClockWentBack) begin_anew("the time went back");
  }

  std::string world() override {
    return options_.world_frame.empty() ? "map" : frame_name(options_.world_frame);
  }

  Diagnosis diagnose(double now) override {
    const std::lock_guard lock(mutex_);
    const NavigationStatus status = navigator_.health().status;
    Diagnosis out{Diagnosis::ok, "poses", fmt::format("filter: {}", pade::to_name(status)), {}};
    const auto missing = [&](std::string text) {
      out.level = Diagnosis::error;
      out.message = std::move(text);
    };
    constexpr double kSlowest = 20;  // Hz
    if (imu_rate_.count() == 0) {
      missing(fmt::format("no sensor_msgs/Imu on {}", topics_.imu));
    } else if (imu_rate_.silence(now) > 1) {
      missing(fmt::format("no sensor_msgs/Imu on {} for {:.1f} s", topics_.imu, imu_rate_.silence(now)));
    } else if (incomplete_ == imu_rate_.count()) {
      missing(fmt::format("{} measures no rates or no accelerations", topics_.imu));
    } else if (const double rate = imu_rate_.hertz(now); rate > 0 && rate < kSlowest) {
      missing(fmt::format("{} comes at {:.0f} Hz, expected 20 Hz and more", topics_.imu, rate));
    } else if (fix_rate_.count() == 0) {
      missing(fmt::format("no sensor_msgs/NavSatFix on {}", topics_.fix));
    } else if (!origin_ && held_fixes_ == 0) {
      missing(fmt::format("{} has no fix", topics_.fix));
    } else if (!origin_) {
      missing(waits_for_);
    } else if (status == NavigationStatus::lost) {
      missing("the filter is lost");
    } else if (status == NavigationStatus::uninitialised) {
      missing("the filter is starting");
    } else if (status == NavigationStatus::levelled) {
      missing("the filter does not know the heading yet: it needs motion or a magnetometer");
    } else if (fix_rate_.silence(now) > 3) {
      out.level = Diagnosis::warning;
      out.message =
          fmt::format("no sensor_msgs/NavSatFix on {} for {:.0f} s", topics_.fix, fix_rate_.silence(now));
    } else if (!antenna_remark_.empty()) {
      out.level = Diagnosis::warning;
      out.message = antenna_remark_;
    } else if (!body_remark_.empty()) {
      out.level = Diagnosis::warning;
      out.message = fmt::format("transform {}", body_remark_);
    }
    const Eigen::Vector3d& arm = navigator_options_.gnss_lever_arm;
    out.values = {{"imu_topic", topics_.imu},
                  {"imu_hz", fmt::format("{:.1f}", imu_rate_.hertz(now))},
                  {"imu_received", fmt::format("{}", imu_rate_.count())},
                  {"imu_incomplete", fmt::format("{}", incomplete_)},
                  {"fix_topic", topics_.fix},
                  {"fixes", fmt::format("{}", fix_rate_.count())},
                  {"without_fix", fmt::format("{}", without_fix_)},
                  {"velocities", fmt::format("{}", velocities_)},
                  {"fields", fmt::format("{}", fields_)},
                  {"heights", fmt::format("{}", heights_)},
                  {"lever_arm", fmt::format("{:.3f} {:.3f} {:.3f}", arm.x(), arm.y(), arm.z())},
                  {"status", std::string(pade::to_name(status))},
                  {"jumps", fmt::format("{}", jumps_)},
                  {"last_jump", last_jump_}};
    if (!field_remark_.empty()) out.values.emplace_back("magnetic_field", field_remark_);
    if (!body_remark_.empty()) out.values.emplace_back("transform", body_remark_);
    if (!antenna_remark_.empty()) out.values.emplace_back("antenna", antenna_remark_);
    for (const std::string& remark : remarks_) out.values.emplace_back("remark", remark);
    return out;
  }

 private:
  void begin_anew(std::string why) {
    navigator_ = Navigator(navigator_options_);
    origin_.reset();
    held_.clear();
    held_fixes_ = 0;
    antenna_remark_.clear();
    asked_since_.reset();
    newest_imu_ = {};
    restarts_ = 0;
    ++jumps_;
    last_jump_ = std::move(why);
  }

  using Held = std::variant<pade::ImuSample, FixMessage, pade::GnssVelocity, pade::MagneticField,
                            pade::BarometricHeight>;

  /// Whether it is known where the antenna sits, or will not be: nothing is measured before, since what was
  /// measured with another place of it cannot be taken back.
  bool knows_lever_arm(const FixMessage& message) {
    if (!options_.navigator.gnss_lever_arm.isZero(0)) return true;  // the parameters say so
    if (imu_frame_.empty()) {
      waits_for_ = "no message of the IMU has come";
      return false;
    }
    const std::string frame = frame_name(message.frame);
    std::string why = "the fixes name no frame";
    if (frame == imu_frame_) return true;
    if (!frame.empty()) {
      Placement placement;
      if (transforms_.find(imu_frame_, frame, message.stamp, placement, why) == Transforms::Answer::valid) {
        const Eigen::Vector3d arm = vector(placement.position);
        navigator_options_.gnss_lever_arm = arm;
        return true;
      }
      if (!asked_since_) asked_since_ = Time{message.stamp};
      if (seconds_between(*asked_since_, {message.stamp}) < kPatience) {
        waits_for_ = fmt::format("where the antenna sits on {} is not known yet: {}", imu_frame_, why);
        return false;
      }
    }
    antenna_remark_ = fmt::format("the antenna is taken to be at the IMU: {}", why);
    return true;
  }

  /// Until there is an origin, what is measured is kept: a filter that began without one would be moved.
  template <class Measurement>
  void give(const Measurement& measurement) {
    if (origin_)
      navigator_.add(measurement);
    else
      hold(measurement.time, measurement);
  }

  void hold(Time time, const Held& measurement) {
    held_.emplace_back(time, measurement);
    while (seconds_between(held_.front().first, time) > 2 * kPatience) {
      if (std::holds_alternative<FixMessage>(held_.front().second)) --held_fixes_;
      held_.pop_front();
    }
  }

  /// What came meanwhile, in the order of its times: topics come in any.
  void take_held() {
    waits_for_.clear();
    asked_since_.reset();
    auto held = std::exchange(held_, {});
    held_fixes_ = 0;
    const auto rank = [](const auto& entry) {
      return std::pair(entry.first, !std::holds_alternative<pade::ImuSample>(entry.second));
    };
    std::stable_sort(held.begin(), held.end(),
                     [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
    navigator_ = Navigator(navigator_options_);
    restarts_ = 0;
    for (const auto& [time, measurement] : held) {
      if (const auto* const fix = std::get_if<FixMessage>(&measurement)) {
        take(*fix);
      } else if (const auto* const imu = std::get_if<pade::ImuSample>(&measurement)) {
        navigator_.add(*imu);
      } else if (const auto* const velocity = std::get_if<pade::GnssVelocity>(&measurement)) {
        navigator_.add(*velocity);
      } else if (const auto* const field = std::get_if<pade::MagneticField>(&measurement)) {
        navigator_.add(*field);
      } else if (const auto* const height = std::get_if<pade::BarometricHeight>(&measurement)) {
        navigator_.add(*height);
      }
    }
  }

  void take(const FixMessage& message) {
    pade::io::GeodeticFix fix;
    fix.time = {message.stamp};
    fix.latitude = message.latitude;
    fix.longitude = message.longitude;
    fix.height = message.height;
    if (message.covariance_kind != 0)
      fix.covariance = Eigen::Map<const Eigen::Matrix3d>(message.covariance.data());
    const bool first = !origin_;
    if (first) origin_ = fix;
    std::vector<std::string> remarks;
    const std::array<pade::io::GeodeticFix, 2> pair = {*origin_, fix};
    const pade::GnssLog log = pade::io::local_log(pair, topics_.fix, remarks);
    if (first) remarks_ = std::move(remarks);
    navigator_.add(log.fixes.back());
  }

  /// The transform that is published is that of the vehicle, wherever the IMU sits on it.
  void place_body(Time time, PoseReply& reply) {
    const std::string body = frame_name(options_.base_frame);
    body_remark_.clear();
    reply.body_frame = body;
    if (body == imu_frame_) return;
    Placement placement;
    std::string why;
    if (transforms_.find(imu_frame_, body, time.nanoseconds, placement, why) == Transforms::Answer::valid) {
      reply.T_world_body = reply.T_world_body * pose_of(placement);
      return;
    }
    reply.body_frame.clear();
    body_remark_ =
        fmt::format("not published, since it is not known how {} sits on {}: {}", body, imu_frame_, why);
  }

  NodeOptions options_;
  pade::navigation::NavigatorOptions navigator_options_;
  Topics topics_;
  Transforms& transforms_;
  Mounting mounting_;
  std::mutex mutex_;
  Navigator navigator_;
  Pose T_body_camera_;
  std::string imu_frame_, last_jump_, field_remark_, body_remark_, antenna_remark_, waits_for_;
  std::deque<std::pair<Time, Held>> held_;  // until there is an origin
  std::size_t held_fixes_ = 0;              // of these
  std::optional<Time> asked_since_;         // where the antenna sits
  std::optional<pade::io::GeodeticFix> origin_;
  Time newest_imu_{};
  Rate imu_rate_, fix_rate_;
  std::vector<std::string> remarks_;
  std::size_t incomplete_ = 0, without_fix_ = 0, velocities_ = 0, fields_ = 0, heights_ = 0, jumps_ = 0;
  std::uint64_t restarts_ = 0;
};

}  // namespace

std::unique_ptr<PoseInput> make_sensor_poses(const NodeOptions& options, const Topics& topics,
                                             Transforms& transforms) {
  return std::make_unique<SensorPoses>(options, topics, transforms);
}

}  // namespace pade_ros
