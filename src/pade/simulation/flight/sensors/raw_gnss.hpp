// A GNSS receiver that gives what it measures of each satellite: pseudorange, Doppler, phase, strength; with
// a clock that drifts and jumps, reflections, slips, and a sky that is masked or behind leaves at times.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "pade/core/random.hpp"
#include "pade/core/sensors/raw_gnss.hpp"
#include "pade/navigation/gnss/atmosphere.hpp"
#include "pade/navigation/gnss/satellite_state.hpp"
#include "pade/simulation/flight/sensors/kinematics.hpp"

namespace pade::simulation {

/// Something that lasts `duration` seconds and begins every `period` seconds, first `period - duration`
/// seconds after the first epoch; a period of 0 is never.
struct Spells {
  double period = 0;
  double duration = 0;

  [[nodiscard]] bool at(double seconds) const;
};

/// Errors of the receiver and of its surroundings.
struct RawGnssModel {
  double range_zenith = 0.5;         ///< white error of a pseudorange in the zenith, m
  double range_horizon = 3;          ///< at the lowest elevation, m
  double rate_white = 0.05;          ///< of the range's rate, m/s
  double phase_white = 0.002;        ///< m
  double lowest_elevation = 0.1745;  ///< lower satellites are not seen, rad
  double reflected = 0;              ///< share of the pseudoranges that are too long
  double reflected_least = 10;       ///< by so much, m
  double reflected_most = 100;       ///< to so much, m
  double slips = 0.01;               ///< share of the phases that slip by 1 to 20 cycles
  double slips_said = 0.5;           ///< share of the slips that the receiver flags
  double clock = 1e-4;               ///< at the first epoch, s
  double clock_rate = 5e-7;          ///< s/s
  double clock_noise = 0.1;          ///< walk of the clock, m/sqrt(s)
  double clock_walk = 0.2;           ///< walk of its rate, m/s/sqrt(s)
  double clock_limit = 5e-4;         ///< beyond it the clock is set by a millisecond, s
  std::array<double, gnss::kSystems> system_bias{0, 8, 3, -5};  ///< of the signals of each system, m
  std::size_t satellites_left = 3;                              ///< the highest, while the sky is masked
  Spells masked;                                                ///< all others are gone
  Spells canopy;                                                ///< no phases
  Eigen::Vector3d lever_arm = Eigen::Vector3d::Zero();          ///< antenna in the body frame, m
};

class RawGnss {
 public:
  /// @param broadcast  the satellites; must outlive the receiver
  /// @param origin     of the local frame
  /// @param zero       GPS time at which the motion's time is 0
  RawGnss(const RawGnssModel& model, const gnss::BroadcastData& broadcast, const gnss::Geodetic& origin,
          Time zero, std::uint64_t seed);

  /// The epoch that is measured at the time of `truth`, stamped by the receiver's clock. Times must rise.
  gnss::Epoch sample(const KinematicState& truth);

  /// Ahead of GPS time at the last epoch, m.
  [[nodiscard]] double clock() const { return clock_; }

 private:
  struct Tracked {
    double cycles = 0;  ///< the phase's whole number
    bool seen = false;  ///< at the epoch before
  };
  /// A satellite over the horizon and the distance that its signal went.
  struct Visible {
    gnss::EphemerisChoice ephemeris;
    gnss::SatelliteId satellite;
    gnss::SatelliteState sent;
    gnss::Direction direction;
    double range = 0;  ///< m
    double rate = 0;   ///< m/s
  };

  void step_clock(double dt);
  [[nodiscard]] std::vector<Visible> visible(const KinematicState& truth) const;
  [[nodiscard]] Visible look_at(const gnss::EphemerisChoice& ephemeris, gnss::SatelliteId satellite,
                                const Eigen::Vector3d& antenna, const Eigen::Vector3d& velocity,
                                Time gps_time) const;
  gnss::Signal measure(const Visible& satellite, Time gps_time, bool has_phase);

  RawGnssModel model_;
  const gnss::BroadcastData* broadcast_;
  gnss::Geodetic place_;
  Eigen::Vector3d origin_;
  Eigen::Matrix3d R_enu_ecef_;
  Time zero_;
  Random random_;
  double clock_ = 0;       ///< m
  double clock_rate_ = 0;  ///< m/s
  bool started_ = false;
  Time first_;
  Time last_;
  std::map<gnss::SatelliteId, Tracked> tracked_;
};

}  // namespace pade::simulation
