#include "pade/navigation/gnss/positioning.hpp"

#include <algorithm>
#include <cmath>

#include "pade/navigation/gnss/least_squares.hpp"

namespace pade::gnss {
namespace {

constexpr std::size_t kMost = 64;  // satellites in an equation system; the rest would add nothing
constexpr double kIonosphereFrequency = 1575.42e6;

/// The equations of an epoch and the views that they are of.
struct System64 {
  std::array<Equation, kMost> equations;
  std::array<SatelliteView*, kMost> views{};
  std::size_t size = 0;

  std::span<Equation> all() { return std::span(equations).first(size); }
  Equation& add(SatelliteView& view) {
    views.at(size) = &view;
    Equation& equation = equations.at(size++);
    equation = Equation{};
    return equation;
  }
};

/// Growing towards the horizon and with the noise: 1 in the zenith at 45 dB-Hz.
double noise_factor(const SatelliteView& view, const PositioningOptions& options) {
  const double sine = std::sin(std::max(view.direction.elevation, 0.05));
  const double by_elevation = std::sqrt(0.5 + 0.5 / sine);
  if (!options.weigh_by_cn0) return by_elevation;
  return by_elevation * std::pow(10, (45 - std::clamp(view.cn0, 15.0, 50.0)) / 20);
}

double range_variance(const SatelliteView& view, bool air_is_corrected, const PositioningOptions& options) {
  const double factor = noise_factor(view, options);
  if (!air_is_corrected) return view.orbit_sigma * view.orbit_sigma * factor * factor;  // of known ranges
  const double noise = options.pseudorange_sigma * factor;
  const double ionosphere = 0.5 * view.air_doubt * (view.air - view.air_of_phase);  // the two are ±
  const double troposphere = 0.1 / std::sin(std::max(view.direction.elevation, 0.05));
  return noise * noise + view.orbit_sigma * view.orbit_sigma + ionosphere * ionosphere +
         troposphere * troposphere;
}

bool may_be_used(const SatelliteView& view) {
  return view.use == Use::used || view.use == Use::low || view.use == Use::outlier;
}

/// The middle of all ranges.
double middle_range(std::span<const SatelliteView> views) {
  std::array<double, kMost> ranges{};
  std::size_t count = 0;
  for (const SatelliteView& view : views) {
    if (may_be_used(view) && count < kMost) ranges.at(count++) = view.range;
  }
  if (count == 0) return 0;
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(ranges.begin(), middle, ranges.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

/// From anywhere to within some 10 m, without air or mask.
std::optional<Eigen::Vector3d> search(std::span<SatelliteView> views, double gate) {
  // From the nearest satellite to the farthest are 23000 km. What lies farther apart is no range, and would
  // spoil the first rounds, which know no outliers.
  constexpr double kFarthestApart = 3e7;
  const double middle = middle_range(views);
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  for (int i = 0; i < 12; ++i) {
    System64 system;
    for (SatelliteView& view : views) {
      if (!may_be_used(view) || !(std::abs(view.range - middle) < kFarthestApart) || system.size == kMost) {
        continue;
      }
      Equation& e = system.add(view);
      e.coefficients.head<3>() = range_gradient(view.state.position, position);
      e.coefficients[3 + static_cast<int>(view.satellite.system)] = 1;
      e.value = view.range - range_between(view.state.position, position);
      e.sigma = 30;
    }
    // Outliers can be told only where the equations are nearly linear.
    const auto found = i < 5 ? solve(system.all()) : solve_without_outliers(system.all(), gate);
    if (!found) return std::nullopt;
    position += found->x.head<3>();
    if (!position.allFinite() || position.norm() > 1e9) return std::nullopt;
    if (i > 5 && found->x.head<3>().norm() < 10) return position;
  }
  return std::nullopt;
}

struct Converged {
  Eigen::Vector3d position;
  Estimate estimate;
};

std::optional<Converged> refine(Eigen::Vector3d position, std::span<SatelliteView> views,
                                const std::optional<Atmosphere>& atmosphere,
                                const PositioningOptions& options) {
  for (int i = 0; i < 10; ++i) {
    look_from(position, views, atmosphere, options);
    System64 system;
    for (SatelliteView& view : views) {
      if (view.use != Use::used || system.size == kMost) continue;
      Equation& e = system.add(view);
      e.coefficients.head<3>() = range_gradient(view.state.position, position);
      e.coefficients[3 + static_cast<int>(view.satellite.system)] = 1;
      e.value = view.range - view.air - range_between(view.state.position, position);
      e.sigma = std::sqrt(range_variance(view, atmosphere.has_value(), options));
    }
    const auto found = solve_without_outliers(system.all(), options.outlier_gate);
    if (!found) return std::nullopt;
    position += found->x.head<3>();
    for (std::size_t k = 0; k < system.size; ++k) {
      system.views.at(k)->range_residual = system.equations.at(k).residual;
      system.views.at(k)->use = system.equations.at(k).used ? Use::used : Use::outlier;
    }
    if (found->x.head<3>().norm() < 1e-4) return Converged{position, *found};
  }
  return std::nullopt;
}

/// Velocity or step with the receiver's one clock in the fourth unknown.
template <class Fix>
void take(const Estimate& estimate, Fix& fix) {
  fix.covariance = estimate.covariance.topLeftCorner<3, 3>();
  if (estimate.contradicted) fix.covariance *= std::max(1.0, estimate.chi_square / estimate.redundancy);
  fix.used = estimate.used;
  fix.redundancy = estimate.redundancy;
  fix.chi_square = estimate.chi_square;
}

/// A satellite whose phase is known at both epochs.
struct PhasePair {
  const SatelliteView* before = nullptr;
  SatelliteView* now = nullptr;
  std::optional<double> surplus;  ///< change of the phase beyond that of the mean Doppler, m
};

bool is_flagged(const Signal& before, const Signal& now) {
  return now.lost_lock || now.half_cycle != before.half_cycle || now.code != before.code;
}

/// What all phases have gained over their Doppler: a jump of the receiver's clock, which is no slip.
double common_surplus(std::span<const PhasePair> pairs) {
  std::array<double, kMost> values{};
  std::size_t count = 0;
  for (const PhasePair& pair : pairs) {
    if (pair.surplus) values.at(count++) = *pair.surplus;
  }
  if (count == 0) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(values.begin(), middle, values.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

bool has_state(const SatelliteView& view) { return view.use == Use::used || view.use == Use::outlier; }

struct PhasePairs {
  std::array<PhasePair, kMost> all;
  std::size_t size = 0;
};

/// The phases that go on from one epoch to the other; the count of those that are flagged or contradict the
/// Doppler, which become outliers.
int pair_phases(std::span<const SatelliteView> before, std::span<SatelliteView> now, double interval,
                PhasePairs& pairs) {
  int refused = 0;
  for (SatelliteView& view : now) {
    view.phase_use = has_state(view) ? Use::not_measured : view.use;
    const auto old = std::find_if(before.begin(), before.end(),
                                  [&](const auto& v) { return v.satellite == view.satellite; });
    if (!has_state(view) || old == before.end() || !has_state(*old) || view.signal == nullptr ||
        !view.signal->carrier || !old->signal->carrier || view.ephemeris != old->ephemeris ||
        pairs.size == kMost) {
      continue;
    }
    if (is_flagged(*old->signal, *view.signal)) {
      view.phase_use = Use::outlier;
      ++refused;
      continue;
    }
    PhasePair pair{&*old, &view, {}};
    if (old->signal->doppler && view.signal->doppler) {
      const double by_doppler = -0.5 * (*old->signal->doppler + *view.signal->doppler) * interval;
      pair.surplus = (*view.signal->carrier - *old->signal->carrier - by_doppler) * view.wavelength;
    }
    pairs.all.at(pairs.size++) = pair;
  }
  const double common = common_surplus(std::span(pairs.all).first(pairs.size));
  const double gate = std::max(0.5, 2 * std::abs(interval));
  const auto contradicts = [&](const PhasePair& pair) {
    if (!pair.surplus || std::abs(*pair.surplus - common) < gate) return false;
    pair.now->phase_use = Use::outlier;
    ++refused;
    return true;
  };
  const auto end = pairs.all.begin() + static_cast<std::ptrdiff_t>(pairs.size);
  pairs.size =
      static_cast<std::size_t>(std::remove_if(pairs.all.begin(), end, contradicts) - pairs.all.begin());
  return refused;
}

/// The equation of a phase's change, while the receiver goes from one place to another.
void add_phase(const PhasePair& pair, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
               const PositioningOptions& options, System64& system) {
  const SatelliteView& old = *pair.before;
  SatelliteView& view = *pair.now;
  Equation& e = system.add(view);
  e.coefficients.head<3>() = range_gradient(view.state.position, to);
  e.coefficients[3] = 1;
  e.value = view.wavelength * (*view.signal->carrier - *old.signal->carrier) +
            kSpeedOfLight * (view.state.clock - old.state.clock) - (view.air_of_phase - old.air_of_phase) -
            (range_between(view.state.position, to) - range_between(old.state.position, from));
  e.sigma = M_SQRT2 * options.phase_sigma * noise_factor(view, options);
}

}  // namespace

ViewSigmas sigmas_of(const SatelliteView& view, bool air_is_corrected, const PositioningOptions& options) {
  const double factor = noise_factor(view, options);
  return {std::sqrt(range_variance(view, air_is_corrected, options)), options.doppler_sigma * factor,
          options.phase_sigma * factor};
}

void look_from(const Eigen::Vector3d& position, std::span<SatelliteView> views,
               const std::optional<Atmosphere>& atmosphere, const PositioningOptions& options) {
  const Geodetic place = geodetic_of(position);
  const Eigen::Matrix3d axes = enu_axes(place);
  for (SatelliteView& view : views) {
    if (!may_be_used(view)) continue;
    view.direction = direction_of(view.state.position - position, axes);
    view.use = view.direction.elevation < options.elevation_mask ? Use::low : Use::used;
    if (!atmosphere) continue;
    const double troposphere = troposphere_delay(place, view.direction);
    double ionosphere = 0;
    view.air_doubt = atmosphere->ionosphere ? 0.5 : 1;
    if (place.height > -1e4 && place.height < 1e5) {
      const double ratio = view.wavelength * kIonosphereFrequency / kSpeedOfLight;
      ionosphere = ratio * ratio *
                   (atmosphere->ionosphere
                        ? ionosphere_delay(*atmosphere->ionosphere, place, view.direction, atmosphere->time)
                        : assumed_ionosphere_delay(view.direction));
    }
    view.air = troposphere + ionosphere;
    view.air_of_phase = troposphere - ionosphere;
  }
}

std::optional<PositionFix> locate(std::span<SatelliteView> views, const std::optional<Atmosphere>& atmosphere,
                                  const PositioningOptions& options,
                                  const std::optional<Eigen::Vector3d>& guess) {
  const auto start = guess ? guess : search(views, options.outlier_gate);
  if (!start) return std::nullopt;
  auto found = refine(*start, views, atmosphere, options);
  if (!found && guess) {  // the guess may have been far off
    const auto again = search(views, options.outlier_gate);
    if (again) found = refine(*again, views, atmosphere, options);
  }
  if (!found) return std::nullopt;
  const double height = geodetic_of(found->position).height;
  if (height < -1e5 || height > 1e6) return std::nullopt;
  PositionFix fix;
  fix.position = found->position;
  take(found->estimate, fix);
  for (const SatelliteView& view : views) {
    const auto system = static_cast<std::size_t>(view.satellite.system);
    if (view.use == Use::used) fix.clock.at(system) = found->estimate.x[3 + static_cast<int>(system)];
  }
  return fix;
}

std::optional<VelocityFix> velocity_at(std::span<SatelliteView> views, const Eigen::Vector3d& position,
                                       const PositioningOptions& options) {
  System64 system;
  const Eigen::Vector3d rest = Eigen::Vector3d::Zero();
  for (SatelliteView& view : views) {
    view.rate_use = has_state(view) ? Use::not_measured : view.use;
    if (!has_state(view) || view.signal == nullptr || !view.signal->doppler || system.size == kMost) continue;
    Equation& e = system.add(view);
    e.coefficients.head<3>() = range_gradient(view.state.position, position);
    e.coefficients[3] = 1;
    e.value = -view.wavelength * *view.signal->doppler + kSpeedOfLight * view.state.clock_rate -
              range_rate_between(view.state, position, rest);
    e.sigma = options.doppler_sigma * noise_factor(view, options);
  }
  const auto found = solve_without_outliers(system.all(), options.outlier_gate);
  if (!found) return std::nullopt;
  for (std::size_t k = 0; k < system.size; ++k) {
    system.views.at(k)->rate_residual = system.equations.at(k).residual;
    system.views.at(k)->rate_use = system.equations.at(k).used ? Use::used : Use::outlier;
  }
  VelocityFix fix;
  fix.velocity = found->x.head<3>();
  fix.clock_rate = found->x[3];
  take(*found, fix);
  return fix;
}

std::optional<PhaseStep> step_between(std::span<const SatelliteView> before, std::span<SatelliteView> now,
                                      Time time_before, Time time_now, const Eigen::Vector3d& position,
                                      const Eigen::Vector3d& speed, const PositioningOptions& options) {
  const double interval = seconds_between(time_before, time_now);
  PhaseStep step;
  step.from = time_before;
  step.step = speed * interval;
  PhasePairs pairs;
  const int refused = pair_phases(before, now, interval, pairs);
  std::optional<Estimate> found;
  for (int i = 0; i < 4; ++i) {
    System64 system;
    for (const PhasePair& pair : std::span(pairs.all).first(pairs.size)) {
      add_phase(pair, position, position + step.step, options, system);
    }
    found = solve_without_outliers(system.all(), options.outlier_gate);
    if (!found) return std::nullopt;
    step.step += found->x.head<3>();
    step.slips = refused;
    for (std::size_t k = 0; k < system.size; ++k) {
      system.views.at(k)->phase_residual = system.equations.at(k).residual;
      system.views.at(k)->phase_use = system.equations.at(k).used ? Use::used : Use::outlier;
      if (!system.equations.at(k).used) ++step.slips;
    }
    if (found->x.head<3>().norm() < 1e-5) break;
  }
  step.clock_step = found->x[3];
  step.contradicted = found->contradicted;
  take(*found, step);
  return step;
}

}  // namespace pade::gnss
