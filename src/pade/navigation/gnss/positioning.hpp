// Position, velocity and motion of the antenna from the raw measurements of one or two epochs.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "pade/core/sensors/raw_gnss.hpp"
#include "pade/navigation/gnss/atmosphere.hpp"
#include "pade/navigation/gnss/satellite_state.hpp"

namespace pade::gnss {

/// How the measurements are weighed and which are refused.
struct PositioningOptions {
  bool gps = true;                     ///< use GPS
  bool glonass = true;                 ///< use GLONASS
  bool galileo = true;                 ///< use Galileo
  bool beidou = true;                  ///< use BeiDou
  double elevation_mask = 0.1745;      ///< lower satellites are not used, rad
  double lowest_cn0 = 0;               ///< weaker signals are not used, dB-Hz
  double pseudorange_sigma = 0.6;      ///< in the zenith at 45 dB-Hz, m
  double doppler_sigma = 0.016;        ///< of the range's rate, likewise, m/s
  double phase_sigma = 0.0009;         ///< likewise, m
  double glonass_orbit_sigma = 5;      ///< of its broadcast orbit and clock, which do not say it, m
  bool estimate_doppler_sigma = true;  ///< over many epochs it grows to what the residuals show
  bool estimate_phase_sigma = true;    ///< likewise
  bool weigh_by_cn0 = true;            ///< false: by elevation alone
  double outlier_gate = 4;             ///< normalised residuals beyond this are outliers
};

/// visit(options, f) calls f(name, field) for each field.
template <class Options, class Function>
void visit(Options& o,
           const Function& f) requires std::is_same_v<std::remove_const_t<Options>, PositioningOptions> {
  f("gps", o.gps);
  f("glonass", o.glonass);
  f("galileo", o.galileo);
  f("beidou", o.beidou);
  f("elevation_mask", o.elevation_mask);
  f("lowest_cn0", o.lowest_cn0);
  f("pseudorange_sigma", o.pseudorange_sigma);
  f("doppler_sigma", o.doppler_sigma);
  f("phase_sigma", o.phase_sigma);
  f("glonass_orbit_sigma", o.glonass_orbit_sigma);
  f("estimate_doppler_sigma", o.estimate_doppler_sigma);
  f("estimate_phase_sigma", o.estimate_phase_sigma);
  f("weigh_by_cn0", o.weigh_by_cn0);
  f("outlier_gate", o.outlier_gate);
}

/// What became of a satellite at an epoch.
enum class Use : std::uint8_t { used, outlier, low, weak, no_ephemeris, stale, unhealthy, not_measured };
constexpr std::size_t kUses = 8;  ///< how many they are
/// "used", "outlier", "low", "weak", "no ephemeris", "stale ephemeris", "unhealthy", "not measured".
const char* to_name(Use use);

/// One satellite at one epoch, in the signal of its system's first band.
struct SatelliteView {
  SatelliteId satellite;
  const Signal* signal = nullptr;     ///< null for a known range
  const void* ephemeris = nullptr;    ///< which message the state is of; null for a known range
  SatelliteState state;               ///< when the signal left it
  Direction direction;                ///< from the last position that was computed
  double wavelength = 0;              ///< m
  double range = 0;                   ///< pseudorange without clock and group delay of the satellite, m
  double orbit_sigma = 0;             ///< of orbit and clock, m
  double cn0 = 45;                    ///< dB-Hz; 45 if the receiver does not say
  double air = 0;                     ///< delay of troposphere and ionosphere of the code, m
  double air_of_phase = 0;            ///< the same of the carrier, m
  double air_doubt = 0.5;             ///< by what share the ionosphere's delay may be wrong
  Use use = Use::used;                ///< for the position
  Use rate_use = Use::not_measured;   ///< for the velocity
  Use phase_use = Use::not_measured;  ///< for the step since the epoch before
  double range_residual = 0;          ///< m; of outliers too
  double rate_residual = 0;           ///< m/s
  double phase_residual = 0;          ///< m
};

/// The antenna's position.
struct PositionFix {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();    ///< ECEF, m
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< ECEF, m²
  std::array<std::optional<double>, kSystems> clock;     ///< of the receiver against each system's time, m
  int used = 0;                                          ///< satellites
  int redundancy = 0;                                    ///< of the equations
  double chi_square = 0;                                 ///< `redundancy` is expected
};

/// The antenna's velocity. Where measurements that are used still contradict each other the covariance is as
/// many times larger as they do.
struct VelocityFix {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();    ///< ECEF, m/s
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< (m/s)²
  double clock_rate = 0;                                 ///< of the receiver, m/s
  int used = 0;                                          ///< satellites
  int redundancy = 0;                                    ///< of the equations
  double chi_square = 0;                                 ///< `redundancy` is expected
};

/// How far the antenna came since another epoch, from the change of the carriers' phases. The covariance is
/// enlarged as that of VelocityFix.
struct PhaseStep {
  Time from;                                             ///< the epoch before
  Eigen::Vector3d step = Eigen::Vector3d::Zero();        ///< ECEF, m
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< m²
  double clock_step = 0;                                 ///< of the receiver, m
  int used = 0;                                          ///< satellites
  int redundancy = 0;                                    ///< of the equations
  double chi_square = 0;                                 ///< `redundancy` is expected
  int slips = 0;                                         ///< phases refused: flagged, or outliers
  bool contradicted = false;  ///< those used contradict each other: this is no step to rely on
};

constexpr double kLongestStep = 2;  ///< between epochs whose phases are compared, s

/// Whether satellites of a system are used.
bool is_enabled(System system, const PositioningOptions& options);

/// The satellites of an epoch with their states. Those whose state is unknown say why in all three uses.
/// The views point into `epoch`.
std::vector<SatelliteView> views_of(const Epoch& epoch, const BroadcastData& broadcast,
                                    const PositioningOptions& options);
/// The same of known ranges.
std::vector<SatelliteView> views_of(const KnownRangeEpoch& epoch);

/// What is known of the errors of a satellite's measurements.
struct ViewSigmas {
  double range = 0;  ///< m
  double rate = 0;   ///< m/s
  double phase = 0;  ///< m
};
/// @param air_is_corrected  false for known ranges
ViewSigmas sigmas_of(const SatelliteView& view, bool air_is_corrected, const PositioningOptions& options);

/// How the air is corrected.
struct Atmosphere {
  Time time;
  std::optional<IonosphereModel> ionosphere;  ///< without it assumed_ionosphere_delay()
};
/// Writes directions and delays as seen from a position, ECEF; satellites below the mask are `low`, others
/// that have a state `used`. Without `atmosphere` there are no delays (known ranges).
void look_from(const Eigen::Vector3d& position, std::span<SatelliteView> views,
               const std::optional<Atmosphere>& atmosphere, const PositioningOptions& options);

/// Least squares on pseudoranges: position, and a clock for each system. Writes directions, uses and
/// residuals into the views. Empty if the satellites are too few or the solution does not converge near the
/// Earth.
/// @param guess  a position within some 100 km; without it the search begins at the Earth's centre
std::optional<PositionFix> locate(std::span<SatelliteView> views, const std::optional<Atmosphere>& atmosphere,
                                  const PositioningOptions& options,
                                  const std::optional<Eigen::Vector3d>& guess = {});

/// Least squares on Doppler: velocity and the clock's rate at a known position. Uses satellites that locate()
/// has used or called outliers in range.
std::optional<VelocityFix> velocity_at(std::span<SatelliteView> views, const Eigen::Vector3d& position,
                                       const PositioningOptions& options);

/// Least squares on the change of the phases from `before` to `now`, both of which locate() has seen.
/// A phase is refused if it or its half cycle is flagged, if it contradicts the mean Doppler by more than 2
/// m/s or 0.5 m (beside what all do alike: the receiver's clock may jump), or if it does not fit the others.
/// One whose satellite has changed its message in between is not used: no orbit is exact, and their
/// difference no motion.
/// @param position  of the epoch before
/// @param speed     a rough velocity, ECEF, m/s
std::optional<PhaseStep> step_between(std::span<const SatelliteView> before, std::span<SatelliteView> now,
                                      Time time_before, Time time_now, const Eigen::Vector3d& position,
                                      const Eigen::Vector3d& speed, const PositioningOptions& options);

/// Range from satellite to receiver, with what the Earth turns while the signal travels (Sagnac), m.
double range_between(const Eigen::Vector3d& satellite, const Eigen::Vector3d& receiver);
/// Its derivative by the receiver's position; also that of its rate by the receiver's velocity.
Eigen::Vector3d range_gradient(const Eigen::Vector3d& satellite, const Eigen::Vector3d& receiver);
/// Its rate in time, while the receiver moves, m/s.
double range_rate_between(const SatelliteState& satellite, const Eigen::Vector3d& receiver,
                          const Eigen::Vector3d& velocity);

}  // namespace pade::gnss
