#include "pade/navigation/filter_options.hpp"

#include "pade/core/option_check.hpp"

namespace pade::navigation {

FilterOptions FilterOptions::of(ImuClass imu) {
  FilterOptions options;
  if (imu == ImuClass::consumer) {
    options.gyroscope_noise = 1e-4;
    options.camera_gyroscope_noise = 1e-4;
    options.gyroscope_vibration = 0.2;
    options.accelerometer_vibration = 0.35;
    options.gyroscope_bias_walk = 3e-5;
    options.accelerometer_bias_walk = 1e-3;
    options.accelerometer_bias_sigma = 0.3;
  }
  return options;
}

Status check(const FilterOptions& o) {
  const OptionRange ranges[] = {
      {"gravity", o.gravity, 9, 11},
      {"gyroscope_noise", o.gyroscope_noise, 0, finite},
      {"accelerometer_noise", o.accelerometer_noise, 0, finite},
      {"gyroscope_vibration", o.gyroscope_vibration, 0, finite},
      {"accelerometer_vibration", o.accelerometer_vibration, 0, finite},
      {"gyroscope_bias_walk", o.gyroscope_bias_walk, 0, finite},
      {"accelerometer_bias_walk", o.accelerometer_bias_walk, 0, finite},
      {"gyroscope_bias_sigma", o.gyroscope_bias_sigma, above_zero, finite},
      {"accelerometer_bias_sigma", o.accelerometer_bias_sigma, above_zero, finite},
      {"gyroscope_range", o.gyroscope_range, above_zero},
      {"accelerometer_range", o.accelerometer_range, above_zero},
      {"gap", o.gap, above_zero, finite},
      {"gap_rate", o.gap_rate, 0, finite},
      {"gap_acceleration", o.gap_acceleration, 0, finite},
      {"single_point_white_share", o.single_point_white_share, above_zero, 1},
      {"single_point_correlation_time", o.single_point_correlation_time, above_zero, finite},
      {"carrier_phase_white_share", o.carrier_phase_white_share, above_zero, 1},
      {"carrier_phase_correlation_time", o.carrier_phase_correlation_time, above_zero, finite},
      {"carrier_phase_limit", o.carrier_phase_limit, 0, finite},
      {"position_sigma_floor", o.position_sigma_floor, above_zero, finite},
      {"velocity_sigma_floor", o.velocity_sigma_floor, above_zero, finite},
      {"barometer_bias_sigma", o.barometer_bias_sigma, above_zero, finite},
      {"barometer_correlation_time", o.barometer_correlation_time, above_zero, finite},
      {"iron_sigma", o.iron_sigma, 0, finite},
      {"iron_correlation_time", o.iron_correlation_time, above_zero, finite},
      {"clock_noise", o.clock_noise, above_zero, finite},
      {"clock_drift_walk", o.clock_drift_walk, above_zero, finite},
      {"raw_bias_sigma", o.raw_bias_sigma, above_zero, finite},
      {"raw_gate", o.raw_gate, 1, finite},
      {"phase_anchor_time", o.phase_anchor_time, 0, 60},
      {"camera_mounting_sigma", o.camera_mounting_sigma, 0, 0.2},
      {"camera_inflation", o.camera_inflation, above_zero, finite},
      {"camera_gyroscope_noise", o.camera_gyroscope_noise, 0, finite},
      {"gate_probability_3", o.gate_probability_3, above_zero},
      {"gate_probability_2", o.gate_probability_2, above_zero},
      {"gate_probability_1", o.gate_probability_1, above_zero},
      {"soft_gate", o.soft_gate, 1},
      {"reacquire_after", o.reacquire_after, 0},
      {"drift_bound", o.drift_bound, above_zero},
  };
  return check_ranges(ranges);
}

Status check(const AlignmentOptions& o) {
  const OptionRange ranges[] = {
      {"level_time", o.level_time, above_zero, 60},
      {"rest_rate_sigma", o.rest_rate_sigma, above_zero, finite},
      {"rest_force_sigma", o.rest_force_sigma, above_zero, finite},
      {"rest_speed", o.rest_speed, 0, finite},
      {"motion_window", o.motion_window, above_zero, 60},
      {"heading_sigma_magnetic", o.heading_sigma_magnetic, above_zero, finite},
      {"hypotheses", static_cast<double>(o.hypotheses), 1, 360},
      {"yaw_known", o.yaw_known, above_zero, finite},
      {"lag", o.lag, 0, 60},
  };
  return check_ranges(ranges);
}

}  // namespace pade::navigation
