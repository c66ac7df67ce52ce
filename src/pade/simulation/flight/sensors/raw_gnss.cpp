#include "pade/simulation/flight/sensors/raw_gnss.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
using gnss::kEarthRate;
using gnss::kSpeedOfLight;

constexpr std::array<char, gnss::kSystems> kBands{'1', '1', '1', '2'};
constexpr double kIonosphereFrequency = 1575.42e6;

Time after(Time time, double seconds) {
  return Time{time.nanoseconds + static_cast<std::int64_t>(std::llround(seconds * 1e9))};
}

gnss::SatelliteState state_at(const gnss::EphemerisChoice& choice, Time sent) {
  if (choice.kepler != nullptr)
    return gnss::satellite_state(*choice.kepler, seconds_between(choice.kepler->toe, sent));
  return gnss::satellite_state(*choice.glonass, seconds_between(choice.glonass->toe, sent));
}

std::set<gnss::SatelliteId> satellites_of(const gnss::BroadcastData& broadcast) {
  std::set<gnss::SatelliteId> satellites;
  for (const auto& e : broadcast.kepler) satellites.insert(e.satellite);
  for (const auto& e : broadcast.glonass) satellites.insert(e.satellite);
  return satellites;
}

}  // namespace

bool Spells::at(double seconds) const {
  return period > 0 && std::fmod(seconds, period) >= period - duration - 1e-6;
}

RawGnss::RawGnss(const RawGnssModel& model, const gnss::BroadcastData& broadcast,
                 const gnss::Geodetic& origin, Time zero, std::uint64_t seed)
    : model_(model),
      broadcast_(&broadcast),
      place_(origin),
      origin_(gnss::ecef_of(origin)),
      R_enu_ecef_(gnss::enu_axes(origin)),
      zero_(zero),
      random_(seed),
      clock_(model.clock * kSpeedOfLight),
      clock_rate_(model.clock_rate * kSpeedOfLight) {}

void RawGnss::step_clock(double dt) {
  const double root = std::sqrt(std::max(dt, 0.0));
  clock_ += dt * clock_rate_ + model_.clock_noise * root * random_.normal();
  clock_rate_ += model_.clock_walk * root * random_.normal();
  const double millisecond = 1e-3 * kSpeedOfLight;
  const double jump =
      std::abs(clock_) > model_.clock_limit * kSpeedOfLight ? std::copysign(millisecond, clock_) : 0;
  clock_ -= jump;
}

RawGnss::Visible RawGnss::look_at(const gnss::EphemerisChoice& ephemeris, gnss::SatelliteId satellite,
                                  const Vector3d& antenna, const Vector3d& velocity, Time gps_time) const {
  Visible seen{ephemeris, satellite, {}, {}, 0, 0};
  double travel = 0.07;
  // Light goes straight in the frame that does not turn: the satellite as seen from the Earth at reception.
  const auto way = [&](Time received, const Vector3d& at) {
    for (int i = 0; i < 4; ++i) {
      seen.sent = state_at(ephemeris, after(received, -travel));
      const Eigen::AngleAxisd turned(-kEarthRate * travel, Vector3d::UnitZ());
      seen.range = (turned * seen.sent.position - at).norm();
      travel = seen.range / kSpeedOfLight;
    }
    return seen.range;
  };
  constexpr double kStep = 0.01;  // s
  const double before = way(after(gps_time, -kStep), antenna - kStep * velocity);
  seen.rate = (way(after(gps_time, kStep), antenna + kStep * velocity) - before) / (2 * kStep);
  way(gps_time, antenna);
  // Times are whole nanoseconds, in which a satellite moves by some micrometres.
  seen.direction = gnss::direction_of(seen.sent.position - antenna, R_enu_ecef_);
  return seen;
}

std::vector<RawGnss::Visible> RawGnss::visible(const KinematicState& truth) const {
  const Time gps_time{truth.time.nanoseconds + zero_.nanoseconds};
  const Vector3d enu = truth.position + truth.R_world_body * model_.lever_arm;
  const Vector3d enu_velocity =
      truth.velocity + truth.R_world_body * truth.angular_velocity.cross(model_.lever_arm);
  const Vector3d antenna = origin_ + R_enu_ecef_.transpose() * enu;
  const Vector3d velocity = R_enu_ecef_.transpose() * enu_velocity;
  std::vector<Visible> all;
  for (const gnss::SatelliteId satellite : satellites_of(*broadcast_)) {
    const auto choice = gnss::choose_ephemeris(*broadcast_, satellite, gps_time);
    if (!choice.found()) continue;
    all.push_back(look_at(choice, satellite, antenna, velocity, gps_time));
    if (all.back().direction.elevation < model_.lowest_elevation) all.pop_back();
  }
  const double seconds = seconds_between(first_, truth.time);
  if (model_.masked.at(seconds) && all.size() > model_.satellites_left) {
    std::sort(all.begin(), all.end(), [](const Visible& a, const Visible& b) {
      return a.direction.elevation > b.direction.elevation;
    });
    all.resize(model_.satellites_left);
  }
  return all;
}

gnss::Signal RawGnss::measure(const Visible& v, Time gps_time, bool has_phase) {
  const auto system = static_cast<std::size_t>(v.satellite.system);
  const int channel = v.ephemeris.glonass != nullptr ? v.ephemeris.glonass->channel : 0;
  const double frequency = gnss::carrier_frequency(v.satellite.system, kBands.at(system), channel);
  const double wavelength = kSpeedOfLight / frequency;
  const double troposphere = gnss::troposphere_delay(place_, v.direction);
  double ionosphere = 0;
  if (broadcast_->ionosphere) {
    ionosphere = std::pow(kIonosphereFrequency / frequency, 2) *
                 gnss::ionosphere_delay(*broadcast_->ionosphere, place_, v.direction, gps_time);
  }
  const double delay = v.ephemeris.kepler != nullptr ? kSpeedOfLight * v.ephemeris.kepler->group_delay : 0;
  const double seen =
      v.range + clock_ + model_.system_bias.at(system) - kSpeedOfLight * v.sent.clock + troposphere;
  const double height = std::sin(v.direction.elevation);
  const double lowest = std::sin(model_.lowest_elevation);
  const double share = std::clamp((1 / height - 1) / (1 / lowest - 1), 0.0, 1.0);

  // All is drawn always, so that one kind of error does not change the others.
  const double range_noise = random_.normal();
  const double rate_noise = random_.normal();
  const double phase_noise = random_.normal();
  const double strength_noise = random_.normal();
  const bool reflected = random_.uniform() < model_.reflected;
  const double longer = random_.uniform(model_.reflected_least, model_.reflected_most);
  const bool slipped = random_.uniform() < model_.slips;
  const bool said = random_.uniform() < model_.slips_said;
  const double slip = std::floor(random_.uniform(1, 21));
  const double cycles = random_.uniform() < 0.5 ? -slip : slip;
  const double whole = std::floor(random_.uniform(-1e6, 1e6));

  gnss::Signal signal;
  signal.satellite = v.satellite;
  signal.code = {kBands.at(system), 'C'};
  const double range_sigma = model_.range_zenith + share * (model_.range_horizon - model_.range_zenith);
  signal.pseudorange = seen + ionosphere + delay + range_sigma * range_noise + (reflected ? longer : 0);
  signal.doppler =
      -(v.rate + clock_rate_ - kSpeedOfLight * v.sent.clock_rate + model_.rate_white * rate_noise) /
      wavelength;
  signal.cn0 = 47 - 7 * share + 0.5 * strength_noise;
  Tracked& tracked = tracked_[v.satellite];
  if (has_phase) {
    signal.lost_lock = !tracked.seen;
    if (!tracked.seen) tracked.cycles = whole;
    if (slipped && tracked.seen) {
      tracked.cycles += cycles;
      signal.lost_lock = said;
    }
    signal.carrier = (seen - ionosphere + model_.phase_white * phase_noise) / wavelength + tracked.cycles;
  }
  tracked.seen = has_phase;
  return signal;
}

gnss::Epoch RawGnss::sample(const KinematicState& truth) {
  if (!started_) first_ = last_ = truth.time;
  started_ = true;
  step_clock(seconds_between(last_, truth.time));
  last_ = truth.time;
  const bool has_phase = !model_.canopy.at(seconds_between(first_, truth.time));
  const Time gps_time{truth.time.nanoseconds + zero_.nanoseconds};
  gnss::Epoch epoch;
  epoch.time = after(gps_time, clock_ / kSpeedOfLight);
  const std::vector<Visible> all = visible(truth);
  for (auto& [satellite, tracked] : tracked_) {
    const auto same = [&id = satellite](const Visible& v) { return v.satellite == id; };
    if (std::none_of(all.begin(), all.end(), same)) tracked.seen = false;
  }
  for (const Visible& v : all) epoch.signals.push_back(measure(v, gps_time, has_phase));
  return epoch;
}

}  // namespace pade::simulation
