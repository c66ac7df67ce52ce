// The constants of the filter that moves by odometry.
#pragma once

#include <type_traits>

#include "pade/core/result.hpp"

namespace pade::navigation {

/// Noise and gates (docs/navigation.md, section 8, says where each number comes from).
struct PlanarOptions {
  // Of the odometry, beside the noise of its samples.
  double scale_sigma = 0.02;           ///< of the wheels' scale factor
  double scale_walk = 0.001;           ///< of it, 1/sqrt(s)
  double yaw_rate_bias_sigma = 0.005;  ///< rad/s
  double yaw_rate_bias_walk = 2e-5;    ///< rad/s/sqrt(s)
  double yaw_noise = 0.002;            ///< rad/sqrt(s)
  double turn_noise = 0.02;            ///< what turning adds, rad/sqrt(rad)
  double path_noise = 0.1;             ///< of the position: slip, motion to the side, m/sqrt(s)
  double height_walk = 0.1;            ///< the height is no plane's, m/sqrt(s)
  double gap = 1;                      ///< samples farther apart than this leave a gap, s
  double gap_acceleration = 2;         ///< rms of the unseen change of speed, m/s²
  double gap_yaw_rate = 0.3;           ///< rms of the unseen yaw rate, rad/s

  // Of the receiver's clock: a quartz with temperature compensation.
  double clock_noise = 0.1;       ///< m/sqrt(s)
  double clock_drift_walk = 0.2;  ///< m/s/sqrt(s)

  // Of the satellites.
  double correlation_time = 5;  ///< their errors are those of the place and last so long, s
  double gate = 4;              ///< sigmas beyond which a range is not used
  double doubt = 1;  ///< residual in sigmas at which a range that is too long counts half; 0: none is doubted
  bool only_late = true;       ///< a range that is too short is doubted as noise is, not as a reflection
  double reacquire_after = 2;  ///< seconds of most ranges doubted or refused after which they are believed
  double yaw_known = 0.2;      ///< sigma at which the yaw counts as known, rad

  /// visit(self, f) calls f(name, field, meaning) for each field.
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("scale_sigma", self.scale_sigma, "of the wheels' scale factor");
    field("scale_walk", self.scale_walk, "of it, 1/sqrt(s)");
    field("yaw_rate_bias_sigma", self.yaw_rate_bias_sigma, "rad/s");
    field("yaw_rate_bias_walk", self.yaw_rate_bias_walk, "rad/s/sqrt(s)");
    field("yaw_noise", self.yaw_noise, "rad/sqrt(s)");
    field("turn_noise", self.turn_noise, "what turning adds, rad/sqrt(rad)");
    field("path_noise", self.path_noise, "slip and motion to the side, m/sqrt(s)");
    field("height_walk", self.height_walk, "m/sqrt(s)");
    field("gap", self.gap, "samples farther apart than this leave a gap, s");
    field("gap_acceleration", self.gap_acceleration, "rms of the change of speed in a gap, m/s²");
    field("gap_yaw_rate", self.gap_yaw_rate, "rms of the yaw rate in a gap, rad/s");
    field("clock_noise", self.clock_noise, "of the receiver's clock, m/sqrt(s)");
    field("clock_drift_walk", self.clock_drift_walk, "of its drift, m/s/sqrt(s)");
    field("correlation_time", self.correlation_time, "of the errors of the ranges, s");
    field("gate", self.gate, "sigmas beyond which a range is not used");
    field("doubt", self.doubt,
          "residual in sigmas at which a range that is too long counts half; 0: none is doubted");
    field("only_late", self.only_late, "ranges that are too short are doubted as noise, not as reflections");
    field("reacquire_after", self.reacquire_after,
          "seconds of most ranges doubted or refused before they are believed");
    field("yaw_known", self.yaw_known, "sigma at which the yaw counts as known, rad");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const PlanarOptions& options);

}  // namespace pade::navigation
