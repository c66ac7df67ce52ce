#include "pade/navigation/tight/raw_observer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pade::navigation {
namespace {

// Directions and delays are taken from one place until the antenna is so far from it, m: delays that followed
// each position would move with its errors, and the phases with them.
constexpr double kNear = 100;

}  // namespace

LocalFrame LocalFrame::at(const gnss::Geodetic& place) {
  return {gnss::ecef_of(place), gnss::enu_axes(place), place};
}

LocalFrame LocalFrame::at(const GeodeticOrigin& origin) {
  constexpr double kDegree = std::numbers::pi / 180;
  return at(gnss::Geodetic{origin.latitude * kDegree, origin.longitude * kDegree, origin.height});
}

RawObserver::RawObserver(const gnss::BroadcastData& broadcast, const gnss::PositioningOptions& options,
                         const std::optional<LocalFrame>& frame, Time zero)
    : broadcast_(&broadcast), options_(options), frame_(frame), zero_(zero) {}

std::optional<gnss::VelocityFix> RawObserver::add_fix(std::span<gnss::SatelliteView> views,
                                                      const gnss::PositionFix& fix,
                                                      const gnss::PositioningOptions& weights,
                                                      RawEpoch& epoch) const {
  const Matrix3d& R = frame_->R_enu_ecef;
  epoch.fix = GnssFix{epoch.time, R * (fix.position - frame_->origin), R * fix.covariance * R.transpose()};
  auto velocity = gnss::velocity_at(views, fix.position, weights);
  if (velocity) {
    epoch.velocity =
        GnssVelocity{epoch.time, R * velocity->velocity, R * velocity->covariance * R.transpose()};
  }
  return velocity;
}

void RawObserver::learn_noise(std::vector<gnss::SatelliteView>& views,
                              const std::shared_ptr<const gnss::Epoch>& measured,
                              const gnss::PositionFix& fix, const std::optional<gnss::VelocityFix>& velocity,
                              const gnss::PositioningOptions& weights) {
  if (velocity) noise_.learn(*velocity);
  if (!options_.estimate_phase_sigma) return;
  const double interval = before_ ? seconds_between(before_->epoch->time, measured->time) : 0;
  if (interval > 0 && interval <= gnss::kLongestStep) {
    const Vector3d speed = velocity ? velocity->velocity : Vector3d(Vector3d::Zero());
    const auto step = gnss::step_between(before_->views, views, before_->epoch->time, measured->time,
                                         before_->position, speed, weights);
    if (step) noise_.learn(*step);
  }
  before_ = Seen{measured, views, fix.position};
}

RawSatellite RawObserver::satellite_of(const gnss::SatelliteView& view, bool air_is_corrected,
                                       const gnss::PositioningOptions& weights) const {
  // In the frame of the moment of reception: the Earth turns while the signal is under way, and for longer
  // the farther the satellite is.
  const double distance = (view.state.position - *near_).norm();
  const double angle = gnss::kEarthRate * distance / gnss::kSpeedOfLight;
  const Eigen::AngleAxisd turn(-angle, Vector3d::UnitZ());
  const Vector3d position = turn * view.state.position;
  const Vector3d velocity = turn * view.state.velocity;
  const Vector3d sight = (position - *near_).normalized();
  const double lengthening = sight.dot(velocity) / gnss::kSpeedOfLight;
  const Vector3d turning = -gnss::kEarthRate * Vector3d::UnitZ().cross(position);

  RawSatellite s;
  s.satellite = view.satellite;
  s.position = frame_->R_enu_ecef * (position - frame_->origin);
  s.velocity = frame_->R_enu_ecef * (velocity + lengthening * turning);
  s.range = view.range - view.air;
  const gnss::ViewSigmas sigmas = gnss::sigmas_of(view, air_is_corrected, weights);
  s.range_sigma = sigmas.range;
  s.rate_sigma = sigmas.rate;
  s.phase_sigma = sigmas.phase;
  if (view.signal == nullptr) return s;
  const gnss::Signal& signal = *view.signal;
  s.code = signal.code;
  if (signal.doppler) {
    s.rate = -view.wavelength * *signal.doppler + gnss::kSpeedOfLight * view.state.clock_rate;
  }
  if (signal.carrier) {
    s.phase = view.wavelength * *signal.carrier + gnss::kSpeedOfLight * view.state.clock - view.air_of_phase;
  }
  s.lost_lock = signal.lost_lock;
  s.half_cycle = signal.half_cycle;
  return s;
}

std::shared_ptr<const RawEpoch> RawObserver::observe(const gnss::Epoch& epoch) {
  const auto measured = std::make_shared<const gnss::Epoch>(epoch);  // the views point into it
  const gnss::PositioningOptions weights = noise_.applied_to(options_);
  return observe(gnss::views_of(*measured, *broadcast_, weights), epoch.time, measured,
                 gnss::Atmosphere{epoch.time, broadcast_->ionosphere}, weights);
}

std::shared_ptr<const RawEpoch> RawObserver::observe(const gnss::KnownRangeEpoch& epoch) {
  return observe(gnss::views_of(epoch), epoch.time, nullptr, std::nullopt, options_);
}

std::shared_ptr<const RawEpoch> RawObserver::observe(std::vector<gnss::SatelliteView> views, Time time,
                                                     const std::shared_ptr<const gnss::Epoch>& measured,
                                                     const std::optional<gnss::Atmosphere>& air,
                                                     const gnss::PositioningOptions& weights) {
  const auto fix = gnss::locate(views, air, weights, last_);
  if (fix) last_ = fix->position;
  if (fix && (!near_ || (fix->position - *near_).norm() > kNear)) near_ = fix->position;
  if (!near_) return nullptr;
  if (!frame_) frame_ = LocalFrame::at(gnss::geodetic_of(*near_));
  auto result = std::make_shared<RawEpoch>();
  result->time = Time{time.nanoseconds - zero_.nanoseconds};
  if (fix) {
    const auto velocity = add_fix(views, *fix, weights, *result);
    if (measured) learn_noise(views, measured, *fix, velocity, weights);
  }
  gnss::look_from(*near_, views, air, weights);
  for (const gnss::SatelliteView& view : views) {
    if (view.use == gnss::Use::used)
      result->satellites.push_back(satellite_of(view, air.has_value(), weights));
  }
  return result;
}

}  // namespace pade::navigation
