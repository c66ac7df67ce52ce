// The satellites of an epoch, and the geometry of a signal's way.
#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "pade/navigation/gnss/positioning.hpp"

namespace pade::gnss {
namespace {

constexpr std::array<char, kSystems> kFirstBand{'1', '1', '1', '2'};

Use use_of(NoState reason) {
  switch (reason) {
    case NoState::no_ephemeris:
      return Use::no_ephemeris;
    case NoState::stale:
      return Use::stale;
    case NoState::unhealthy:
      return Use::unhealthy;
  }
  return Use::no_ephemeris;
}

/// State, wavelength and corrected range of a satellite that has an ephemeris.
void fill(const Signal& signal, const EphemerisChoice& choice, Time time, const PositioningOptions& options,
          SatelliteView& view) {
  view.state = state_at_transmission(choice, time, *signal.pseudorange);
  const bool glonass = choice.glonass != nullptr;
  view.ephemeris = glonass ? static_cast<const void*>(choice.glonass) : choice.kepler;
  const int channel = glonass ? choice.glonass->channel : 0;
  view.wavelength = kSpeedOfLight / carrier_frequency(view.satellite.system, signal.code[0], channel);
  // GPS and BeiDou broadcast the middle of a range of accuracies that ends 1.2 times as high.
  const double range_end = view.satellite.system == System::galileo ? 1 : 1.2;
  view.orbit_sigma =
      glonass ? options.glonass_orbit_sigma : range_end * std::max(choice.kepler->accuracy, 1.0);
  view.range = *signal.pseudorange + kSpeedOfLight * view.state.clock;
  if (!glonass) view.range -= kSpeedOfLight * choice.kepler->group_delay;
  if (!view.state.position.allFinite() || !view.state.velocity.allFinite() || !std::isfinite(view.range)) {
    view.use = Use::no_ephemeris;
  }
}

}  // namespace

bool is_enabled(System system, const PositioningOptions& options) {
  switch (system) {
    case System::gps:
      return options.gps;
    case System::glonass:
      return options.glonass;
    case System::galileo:
      return options.galileo;
    case System::beidou:
      return options.beidou;
  }
  return false;
}

const char* to_name(Use use) {
  switch (use) {
    case Use::used:
      return "used";
    case Use::outlier:
      return "outlier";
    case Use::low:
      return "low";
    case Use::weak:
      return "weak";
    case Use::no_ephemeris:
      return "no ephemeris";
    case Use::stale:
      return "stale ephemeris";
    case Use::unhealthy:
      return "unhealthy";
    case Use::not_measured:
      return "not measured";
  }
  return "";
}

std::vector<SatelliteView> views_of(const Epoch& epoch, const BroadcastData& broadcast,
                                    const PositioningOptions& options) {
  std::vector<SatelliteView> views;
  views.reserve(epoch.signals.size());
  for (const Signal& signal : epoch.signals) {
    const System system = signal.satellite.system;
    const auto same = [&](const SatelliteView& v) { return v.satellite == signal.satellite; };
    if (!is_enabled(system, options) || signal.code[0] != kFirstBand.at(static_cast<std::size_t>(system)) ||
        !signal.pseudorange || std::any_of(views.begin(), views.end(), same)) {
      continue;
    }
    SatelliteView& view = views.emplace_back();
    view.satellite = signal.satellite;
    view.signal = &signal;
    view.cn0 = signal.cn0.value_or(view.cn0);
    const EphemerisChoice choice = choose_ephemeris(broadcast, signal.satellite, epoch.time);
    if (!choice.found()) {
      view.use = use_of(choice.reason);
    } else if (view.cn0 < options.lowest_cn0) {
      view.use = Use::weak;
    } else {
      fill(signal, choice, epoch.time, options, view);
    }
  }
  return views;
}

std::vector<SatelliteView> views_of(const KnownRangeEpoch& epoch) {
  std::vector<SatelliteView> views;
  views.reserve(epoch.ranges.size());
  for (const KnownRange& range : epoch.ranges) {
    SatelliteView& view = views.emplace_back();
    view.satellite = range.satellite;
    view.state.position = range.position;
    view.range = range.range;
    view.orbit_sigma = range.sigma;
    view.cn0 = range.cn0.value_or(view.cn0);
  }
  return views;
}

double range_between(const Eigen::Vector3d& satellite, const Eigen::Vector3d& receiver) {
  return (satellite - receiver).norm() +
         kEarthRate / kSpeedOfLight * (satellite.x() * receiver.y() - satellite.y() * receiver.x());
}

Eigen::Vector3d range_gradient(const Eigen::Vector3d& satellite, const Eigen::Vector3d& receiver) {
  const Eigen::Vector3d turn(-satellite.y(), satellite.x(), 0);
  return (receiver - satellite).normalized() + kEarthRate / kSpeedOfLight * turn;
}

double range_rate_between(const SatelliteState& satellite, const Eigen::Vector3d& receiver,
                          const Eigen::Vector3d& velocity) {
  // By the time of reception: in a second of it the satellite sends 1 - rate/c seconds.
  const Eigen::Vector3d turn(receiver.y(), -receiver.x(), 0);
  const Eigen::Vector3d by_satellite =
      (satellite.position - receiver).normalized() + kEarthRate / kSpeedOfLight * turn;
  const double sent = by_satellite.dot(satellite.velocity);
  const double moved = range_gradient(satellite.position, receiver).dot(velocity);
  return (sent + moved) / (1 + sent / kSpeedOfLight);
}

}  // namespace pade::gnss
