// Error-state extended Kalman filter on SE_2(3) with stochastic clones: GPS and INS fused as in Section 4.1
// of the paper, with the relative pose read from cloned states (Roumeliotis and Burdick, "Stochastic
// cloning", ICRA 2002).
//
// The filter knows no order of arrival and no history: that is the Navigator's. It never allocates.
#pragma once

#include <array>
#include <cstdint>

#include "pade/core/sensors/measurements.hpp"
#include "pade/navigation/camera/camera_state.hpp"
#include "pade/navigation/filter_options.hpp"
#include "pade/navigation/filter_state.hpp"
#include "pade/navigation/imu_increment.hpp"
#include "pade/navigation/integrity/integrity.hpp"
#include "pade/navigation/measurement.hpp"
#include "pade/navigation/measurement_models.hpp"
#include "pade/navigation/tight/raw_epoch.hpp"
#include "pade/navigation/tight/raw_information.hpp"
#include "pade/navigation/tight/raw_state.hpp"

namespace pade::navigation {

inline constexpr int kMaxClones = 10;
inline constexpr int kMostCommon = kBase + kRawStates + kCameraStates;  ///< errors without the clones'
/// Even: what Eigen may align it sums in pairs, and without raw GNSS and camera the sums must be those of a
/// filter that knows nothing of them, to the last bit.
inline constexpr int kMaxState = kMostCommon + 6 * kMaxClones;
static_assert(kMaxState % 2 == 0);

/// Split of a reported GNSS position error into white noise and Gauss-Markov bias.
struct GnssErrorClass {
  Vector3d bias_sigma = Vector3d::Zero();
  double correlation_time = 0;  ///< 0: no bias known yet
  /// That of the bias without measurements: it falls to bias_sigma² within the correlation time, so that a
  /// sigma that goes up and down is not added up.
  Vector3d bias_variance = Vector3d::Zero();
};

/// How much the samples of an axis differ from a smooth motion: rotor and engine vibration, which aliases
/// into the band of the motion.
struct Vibration {
  ImuSample last;
  ImuSample before_last;
  double interval = 0.005;                             ///< between samples, s
  Vector3d rate_variance = Vector3d::Constant(1e-4);   ///< (rad/s)²
  Vector3d force_variance = Vector3d::Constant(0.25);  ///< (m/s²)²
  int samples = 0;

  void observe(const ImuSample& sample, double longest_interval);
};

/// Everything of the filter but its covariance and clones.
struct FilterCore {
  NavigationState state;
  ImuIncrement pending;  ///< motion since the covariance was valid
  Vibration vibration;
  GnssErrorClass gnss_class;
  bool height_known = false;                    ///< the barometer's zero has been set
  Vector3d smooth_position = Vector3d::Zero();  ///< smooth minus filtered position, decaying, ENU, m
  Vector3d smooth_rotation = Vector3d::Zero();  ///< R_smooth = Exp(smooth_rotation) R, decaying
  Time position_accepted;                       ///< last time a position passed its gate
  Time velocity_accepted;                       ///< last time a velocity did
  bool velocity_seen = false;                   ///< one has since the start
  double log_likelihood = 0;    ///< of all GNSS innovations since the start, bounded per innovation
  int position_rejections = 0;  ///< in a row
  int velocity_rejections = 0;
  Integrity integrity;
  RawState raw;        ///< of no account unless raw GNSS is expected
  CameraState camera;  ///< likewise motions of the camera
};

/// What is kept to come back to: everything but clones.
struct FilterSnapshot : FilterCore {
  /// Of the 22 errors, and the 9 of raw GNSS and the 9 of the camera if these are expected.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostCommon, kMostCommon> P = BaseMatrix::Zero();
};

/// Motion of the body between two clones or a clone and now.
struct CloneMotion {
  Pose T_1_2;
  Matrix6d covariance = Matrix6d::Zero();  ///< of (rotation, translation), T_1_2 = T̂ exp(ξ): axes of frame 2
};

class Filter {
 public:
  Filter() = default;
  Filter(const FilterOptions& options, const Vector3d& gnss_lever_arm)
      : options_(options), lever_arm_(gnss_lever_arm) {}

  /// Starts at a state with the covariance of its error; forgets all clones.
  void start(const NavigationState& state, const BaseMatrix& covariance);

  [[nodiscard]] const NavigationState& state() const { return core_.state; }
  [[nodiscard]] const FilterCore& core() const { return core_; }
  [[nodiscard]] FilterSnapshot snapshot() const;
  [[nodiscard]] const FilterOptions& options() const { return options_; }
  /// Goes back to a snapshot; forgets all clones.
  void restore(const FilterSnapshot& snapshot);
  /// Covariance of the 22 errors at state().time.
  BaseMatrix covariance();

  /// Moves the state over the interval between two IMU values by their mean (trapezoid). `to` must not lie
  /// before state().time.
  void propagate(Time to, const Vector3d& rate_mean, const Vector3d& force_mean, const Vector3d& rate_end);
  /// Learns the level of vibration from a sample that the state has been moved to.
  void observe(const ImuSample& sample) { core_.vibration.observe(sample, options_.gap); }
  /// Adds the uncertainty of a step within a gap without samples: the same in one step as in many.
  /// @param from, to  since the last sample, s
  void add_gap_noise(double from, double to);

  Innovation update(const GnssFix& fix);
  Innovation update(const GnssVelocity& velocity);
  Innovation update(const BarometricHeight& height);
  Innovation update(const Heading& heading);
  /// Uses the azimuth of the field; `declination`: of magnetic north, from north towards east, rad.
  Innovation update(const MagneticField& field, double declination);
  Innovation update(const ZeroVelocity& stop);
  Innovation update(const RangeToGround& range);
  Innovation update(const RoadMotion& road);
  /// Every satellite for itself. Before watch(), position and velocity of the epoch instead, if it has them.
  /// The innovation is that of the velocity from Doppler.
  Innovation update(const RawEpoch& epoch);
  /// Of the image that the present pose is that of, if the older one was marked. Marks this image.
  Innovation update(const CameraMotion& motion);
  /// The present pose is that of an image, from which a motion may be measured.
  Innovation mark_image();
  /// Levelling: the mean specific force of a body known to be unaccelerated.
  Innovation update_static_force(const Vector3d& force, double sigma);

  /// From now on the innovations are judged: `core().integrity` says whether the filter is lost.
  void watch() { core_.integrity.watching = true; }

  /// Remembers the present pose; its index, or -1 if kMaxClones are taken.
  int clone();
  void drop_clones();
  [[nodiscard]] int clones() const { return clones_; }
  /// Motion from clone `index` to the present pose.
  CloneMotion motion_since(int index);
  /// That of a camera on the body, with what is known of its mounting.
  /// @param T_body_camera  as calibrated
  CloneMotion camera_motion_since(int index, const Pose& T_body_camera);

  /// The pose without the jumps of corrections: it follows the filtered one with a time constant of 2 s.
  [[nodiscard]] ExtendedPose smooth_pose() const;

 private:
  using FullMatrix =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxState, kMaxState>;

  using TallMatrix = Eigen::Matrix<double, Eigen::Dynamic, kRawVariables, 0, kMaxState, kRawVariables>;

  /// Errors in front of those of the clones.
  [[nodiscard]] int common() const { return camera_at() + (options_.camera ? kCameraStates : 0); }
  /// First of the camera's errors.
  [[nodiscard]] int camera_at() const { return kBase + (options_.raw_gnss ? kRawStates : 0); }
  [[nodiscard]] int size() const { return common() + 6 * clones_; }
  [[nodiscard]] int clone_at(int index) const { return common() + 6 * index; }
  void flush();
  /// White part of the fix's covariance; follows the receiver from one error class to another.
  Matrix3d split_position_noise(const GnssFix& fix);
  void shift_common_position(const Matrix3d& covariance);
  Innovation believe_velocity(const Prediction<3>& prediction, const Vector3d& residual,
                              const Matrix3d& noise);
  void judge_velocity(const Innovation& innovation);
  void judge_position(const Innovation& innovation);
  void judge_azimuth(InnovationWindow& window, const Innovation& innovation);
  void judge_magnetometer(const Innovation& innovation, double turn, double sigma);
  [[nodiscard]] bool velocities_deny(double turn) const;
  void doubt_magnetometer();
  bool check_yaw(const GnssVelocity& velocity, const Prediction<3>& prediction);
  void open_common_yaw(double sigma);
  void turn_to_velocities();
  void hear_dispute(Dispute::Ruling ruling);
  void compare_gnss(const Vector3d& position, const Matrix3d& white);
  void doubt_velocity();
  void open_inertial();
  template <int M>
  Innovation correct(const Prediction<M>& prediction, const Eigen::Matrix<double, M, 1>& residual,
                     Eigen::Matrix<double, M, M> noise, double gate, bool force = false);
  void apply(const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxState, 1>& error);

  // The camera (camera/camera_update.cpp).
  void start_camera();
  Innovation correct_by_camera(const CameraMotion& motion);

  // Raw GNSS (tight/raw_update.cpp).
  void flush_receiver(double T);
  [[nodiscard]] RawVariables raw_variables() const;
  /// Derivative of the antenna's position and velocity by the base errors.
  [[nodiscard]] Eigen::Matrix<double, 6, kBase> antenna_rows() const;
  [[nodiscard]] Innovation velocity_innovation(const GnssVelocity& velocity) const;
  void set_prior(int index, double variance);
  void start_receiver(const RawEpoch& epoch);
  void follow_clock_jump(const RawEpoch& epoch);
  void collect(const RawEpoch& epoch, RawEquations& equations) const;
  [[nodiscard]] bool ranges_fit(RawEquations& equations);
  [[nodiscard]] bool rates_fit(const RawEquations& equations);
  void take(const RawInformation& information, const TallMatrix& C);
  void follow_phases(const RawEpoch& epoch, const RawEquations& equations);
  void set_anchor(const RawEpoch& epoch);
  void judge_raw(const RawEpoch& epoch, const Innovation& innovation);

  FilterOptions options_;
  Vector3d lever_arm_ = Vector3d::Zero();
  FilterCore core_;
  FullMatrix P_ = FullMatrix::Zero(kBase, kBase);  // common errors, then (φ, ρ) of each clone
  std::array<Pose, kMaxClones> clone_poses_;
  int clones_ = 0;
};

}  // namespace pade::navigation
