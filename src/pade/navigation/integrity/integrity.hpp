// What the filter knows of its own state: whether its innovations still are what its covariance says, and
// which of filter and GNSS velocity is wrong where they part (docs/navigation.md, section 6).
#pragma once

#include "pade/navigation/integrity/innovation_window.hpp"
#include "pade/navigation/integrity/yaw_witness.hpp"

namespace pade::navigation {

/// Where the way flown comes from, when filter and GNSS velocities have parted: positions decide.
class Dispute {
 public:
  enum class Ruling { none, filter_wrong, velocity_wrong };

  /// An epoch of GNSS velocities: measured and predicted, of the antenna, m/s.
  void velocity(const Vector3d& measured, const Vector3d& predicted, Time now, bool parted);
  /// A position of the antenna with its white noise per axis, m. Rules once the two ways differ by more than
  /// the noise of two positions can hide.
  Ruling position(const Vector3d& measured, double white_sigma, Time now);
  /// A position that can rule is at hand.
  [[nodiscard]] bool can_rule(Time now) const;

 private:
  bool has_fix_ = false;
  bool has_velocity_ = false;
  bool parted_ = false;
  Vector3d fix_ = Vector3d::Zero();
  Time fix_time_;                              ///< of the last one
  Time velocity_time_;                         ///< of the last one
  Time time_;                                  ///< up to which the ways are summed
  Vector3d measured_ = Vector3d::Zero();       ///< last velocity, m/s
  Vector3d predicted_ = Vector3d::Zero();      ///< m/s
  Vector3d way_measured_ = Vector3d::Zero();   ///< since `fix_`, m
  Vector3d way_predicted_ = Vector3d::Zero();  ///< m

  void advance(Time now, const Vector3d& measured, const Vector3d& predicted);
};

/// Whether the positions of the GNSS move as its velocities say, whatever the filter holds of either.
class GnssAgreement {
 public:
  /// @param axes  1 for those that are measured, 0 for the others, of which nothing is said
  void velocity(const Vector3d& measured, const Vector3d& axes, Time now);
  /// @param white    standard deviation of the white noise per axis, m
  /// @param walk     by which the correlated error changes in a second, per axis, m
  void position(const Vector3d& measured, const Vector3d& white, const Vector3d& walk, Time now);
  /// The filter has given way to the positions by `shift`, ENU, m. A jump is no drift, and what was before is
  /// no evidence; positions that lead on in the same way are.
  void jumped(const Vector3d& shift, Time now);

  [[nodiscard]] bool contradicts() const { return ratio_ > kContradiction; }
  /// Velocities come: without them nothing is compared.
  [[nodiscard]] bool hears_velocities(Time now) const;
  /// For how long the two have agreed, s.
  [[nodiscard]] double agreed(Time now) const;

 private:
  static constexpr double kContradiction = 6;  // sigmas

  bool has_velocity_ = false;
  int positions_ = 0;
  Time time_;
  Vector3d velocity_ = Vector3d::Zero();
  Vector3d axes_ = Vector3d::Ones();  ///< that are measured
  Vector3d way_ = Vector3d::Zero();   ///< integral of the velocities, m
  Vector3d fast_ = Vector3d::Zero();  ///< position less way, averaged over a short and a long time, m
  Vector3d slow_ = Vector3d::Zero();
  Time position_time_;
  double fastest_ = 0;  ///< speed of late, m/s
  double ratio_ = 0;    ///< of the difference of the averages to its standard deviation
  Time agrees_since_;
  Vector3d last_shift_ = Vector3d::Zero();  ///< m
  Time last_shift_time_;
};

/// Part of the filter's state, kept and restored with it.
struct Integrity {
  InnovationWindow velocity;
  InnovationWindow position;
  InnovationWindow heading;
  InnovationWindow magnetometer;
  Dispute dispute;
  GnssAgreement agreement;
  YawWitness yaw;

  bool watching = false;  ///< only from the end of the alignment on: its hypotheses are meant to fail
  bool lost = false;      ///< the covariance has been refuted, and not been confirmed since
  Time lost_since;
  Time last_alarm;
  int openings = 0;  ///< of covariances since `lost_since`
  int times_lost = 0;

  bool velocity_doubted = false;       ///< GNSS velocities contradict positions and are not used
  bool velocity_refuses_wait = false;  ///< the filter is known to be wrong: believe the velocities at once
  Time velocity_agrees_since;
  int times_doubted = 0;

  bool position_doubted = false;  ///< the same of the positions
  bool ever_agreed = false;       ///< velocities and positions of the GNSS, for a while
  Time last_opening;              ///< because of the velocities

  bool magnetometer_doubted = false;  ///< its azimuth contradicts velocities and inertial sensors: not used
  Time magnetometer_agrees_since;
  int times_magnetometer_doubted = 0;

  /// Innovations of a sensor have refuted the covariance.
  void raise(Time now);
  /// Ends being lost once nothing has contradicted for a while.
  void settle(Time now);
  /// Opening covariances has not helped for too long: only a new start does.
  [[nodiscard]] bool hopeless(Time now) const;
};

}  // namespace pade::navigation
