// From what a receiver says to what the filter takes: satellites placed, corrected and weighed.
#pragma once

#include <memory>
#include <optional>

#include "pade/core/sensors/navigation_log.hpp"
#include "pade/navigation/gnss/noise_estimate.hpp"
#include "pade/navigation/gnss/positioning.hpp"
#include "pade/navigation/tight/raw_epoch.hpp"

namespace pade::navigation {

/// Where the local frame lies on the Earth.
struct LocalFrame {
  Vector3d origin = Vector3d::Zero();          ///< ECEF, m
  Matrix3d R_enu_ecef = Matrix3d::Identity();  ///< gnss::enu_axes() of the origin
  gnss::Geodetic place;                        ///< the origin once more

  static LocalFrame at(const gnss::Geodetic& place);
  static LocalFrame at(const GeodeticOrigin& origin);
};

/// Takes epochs in the order of their times.
class RawObserver {
 public:
  /// @param broadcast  must outlive the observer
  /// @param frame      without it that of the first position that is found
  /// @param zero       GPS time at which the IMU's time scale is 0
  RawObserver(const gnss::BroadcastData& broadcast, const gnss::PositioningOptions& options,
              const std::optional<LocalFrame>& frame, Time zero);

  /// Null until a first position has been found (4 satellites, and one more for each further system).
  std::shared_ptr<const RawEpoch> observe(const gnss::Epoch& epoch);
  /// The same of known ranges, which have neither rate nor phase.
  std::shared_ptr<const RawEpoch> observe(const gnss::KnownRangeEpoch& epoch);
  /// That of the epochs; empty until there is one.
  [[nodiscard]] const std::optional<LocalFrame>& frame() const { return frame_; }
  /// What the residuals so far show of the receiver; the sigmas of epochs to come are of it.
  [[nodiscard]] const gnss::NoiseEstimate& noise() const { return noise_; }

 private:
  /// An epoch with a position, whose phases those of the next one are held against.
  struct Seen {
    std::shared_ptr<const gnss::Epoch> epoch;  ///< what the views point into
    std::vector<gnss::SatelliteView> views;
    Vector3d position = Vector3d::Zero();  ///< ECEF, m
  };

  std::optional<gnss::VelocityFix> add_fix(std::span<gnss::SatelliteView> views, const gnss::PositionFix& fix,
                                           const gnss::PositioningOptions& weights, RawEpoch& epoch) const;
  void learn_noise(std::vector<gnss::SatelliteView>& views,
                   const std::shared_ptr<const gnss::Epoch>& measured, const gnss::PositionFix& fix,
                   const std::optional<gnss::VelocityFix>& velocity, const gnss::PositioningOptions& weights);
  [[nodiscard]] RawSatellite satellite_of(const gnss::SatelliteView& view, bool air_is_corrected,
                                          const gnss::PositioningOptions& weights) const;
  std::shared_ptr<const RawEpoch> observe(std::vector<gnss::SatelliteView> views, Time time,
                                          const std::shared_ptr<const gnss::Epoch>& measured,
                                          const std::optional<gnss::Atmosphere>& air,
                                          const gnss::PositioningOptions& weights);

  const gnss::BroadcastData* broadcast_;
  gnss::PositioningOptions options_;
  std::optional<LocalFrame> frame_;
  Time zero_;
  std::optional<Vector3d> last_;  ///< position that was found, ECEF, m
  std::optional<Vector3d> near_;  ///< ECEF, m; where directions and delays are taken from
  gnss::NoiseEstimate noise_;
  std::optional<Seen> before_;
};

}  // namespace pade::navigation
