// The error of the yaw as GNSS velocities and inertial sensors show it, whatever a compass says
// (docs/navigation.md, section 6).
#pragma once

#include <complex>

#include "pade/core/lie.hpp"
#include "pade/core/time.hpp"

namespace pade::navigation {

/// Where a vehicle changes its velocity, the change that the GNSS shows and that of the inertial sensors
/// point in directions that differ by the error of the yaw.
class YawWitness {
 public:
  /// The estimate has moved on.
  /// @param change  of the velocity, ENU as the estimate has it, gravity taken out, m/s
  void inertial(const Vector3d& change) { inertial_ += complex(change); }
  /// The estimate has been turned about the vertical, rad; up to here it was wrong by so much.
  void turned(double angle);
  /// @param measured  of the body by the GNSS, ENU, m/s
  /// @param sigma     of each of its horizontal components, m/s
  void velocity(const Vector3d& measured, double sigma, Time now);
  /// What lies between the last velocity and the next tells nothing: samples are missing.
  void interrupt() { has_velocity_ = false; }
  void forget() { *this = {}; }

  /// Whether the changes of the last 20 s are of one length, and their directions differ by one angle that is
  /// known to 0.2 rad.
  [[nodiscard]] bool is_clear() const;
  /// By which the estimate has to be turned, rad.
  [[nodiscard]] double error() const { return std::arg(total().turn); }
  /// Standard deviation of error(), rad; infinite while the velocity has not changed.
  [[nodiscard]] double sigma() const;

 private:
  using Complex = std::complex<double>;  // east + i north
  /// Sums over changes of velocity, decaying.
  struct Changes {
    Complex turn = 0;     // conj(inertial) measured
    double inertial = 0;  // squares, (m/s)²
    double measured = 0;  // likewise, without noise
  };
  /// The one that goes on, up to the last velocity.
  struct Open {
    Complex inertial = 0;
    Complex measured = 0;
    double seconds = 0;
  };
  static Complex complex(const Vector3d& v) { return {v.x(), v.y()}; }
  [[nodiscard]] static bool is_plausible(const Open& change, double sigma);
  [[nodiscard]] Changes total() const;
  [[nodiscard]] double variance_of(double seconds) const;
  void add_open(Changes& sums) const;
  void close();

  Complex inertial_ = 0;  // since the open one began, up to now
  Changes closed_;
  Open open_;
  bool has_velocity_ = false;
  Complex first_ = 0;  // velocity from which the open change is counted
  Time first_time_;
  double sigma_ = 0;  // of a component of a velocity, m/s
};

}  // namespace pade::navigation
