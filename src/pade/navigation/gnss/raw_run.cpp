#include "pade/navigation/gnss/raw_run.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>

namespace pade::gnss {
namespace {

void count(const EpochResult& result, RawRun& run) {
  for (const SatelliteView& view : result.satellites) ++run.uses.at(static_cast<std::size_t>(view.use));
  if (!result.position) ++run.without_position;
}

void add_step(const EpochResult& before, EpochResult& now, const PositioningOptions& options,
              NoiseEstimate& noise) {
  const double interval = seconds_between(before.time, now.time);
  if (!before.position || !now.position || interval > kLongestStep) return;
  Eigen::Vector3d speed = Eigen::Vector3d::Zero();
  if (now.velocity) speed = now.velocity->velocity;
  now.step = step_between(before.satellites, now.satellites, before.time, now.time, before.position->position,
                          speed, options);
  if (!now.step) return;
  noise.learn(*now.step);
  if (now.step->contradicted) now.step.reset();
}

/// The satellites of an epoch that have a view, and how often the others have none.
struct Signals {
  std::set<SatelliteId> seen;
  std::map<SatelliteId, std::size_t> unseen;

  void add(const Epoch& epoch, const std::vector<SatelliteView>& views, const PositioningOptions& options) {
    std::optional<SatelliteId> last;  // the signals of a satellite stand together
    for (const Signal& signal : epoch.signals) {
      if (last == signal.satellite || !is_enabled(signal.satellite.system, options)) continue;
      last = signal.satellite;
      const bool has_view = std::any_of(views.begin(), views.end(), [&](const SatelliteView& view) {
        return view.satellite == signal.satellite;
      });
      if (has_view) {
        seen.insert(signal.satellite);
      } else {
        ++unseen[signal.satellite];
      }
    }
  }
  /// Those that never had one.
  [[nodiscard]] std::map<SatelliteId, std::size_t> never() const {
    std::map<SatelliteId, std::size_t> result = unseen;
    for (const SatelliteId satellite : seen) result.erase(satellite);
    return result;
  }
};

/// "E31 (610 epochs), E33 (2 epochs)".
std::string names_of(const std::map<SatelliteId, std::size_t>& satellites) {
  std::string names;
  for (const auto& [satellite, count] : satellites) {
    names += fmt::format("{}{} ({} epochs)", names.empty() ? "" : ", ", to_string(satellite), count);
  }
  return names;
}

EpochResult play(const Epoch& epoch, const RawLog& log, const PositioningOptions& options,
                 const std::optional<Eigen::Vector3d>& guess) {
  EpochResult result;
  result.time = epoch.time;
  result.satellites = views_of(epoch, log.broadcast, options);
  const Atmosphere air{epoch.time, log.broadcast.ionosphere};
  result.position = locate(result.satellites, air, options, guess);
  if (result.position) result.velocity = velocity_at(result.satellites, result.position->position, options);
  return result;
}

}  // namespace

std::vector<std::string> unusable_satellites(const RawRun& run) {
  std::map<Use, std::map<SatelliteId, std::size_t>> epochs;
  for (const EpochResult& epoch : run.epochs) {
    for (const SatelliteView& view : epoch.satellites) {
      if (view.use == Use::no_ephemeris || view.use == Use::stale || view.use == Use::unhealthy) {
        ++epochs[view.use][view.satellite];
      }
    }
  }
  std::vector<std::string> sentences;
  for (const auto& [use, satellites] : epochs) {
    sentences.push_back(fmt::format("{}: {}", to_name(use), names_of(satellites)));
  }
  if (!run.without_signal.empty()) {
    sentences.push_back(fmt::format("no pseudorange in the first band: {}", names_of(run.without_signal)));
  }
  return sentences;
}

std::vector<std::string> remarks_on(const NoiseEstimate& noise, const PositioningOptions& options) {
  constexpr double kMatters = 1.5;
  const PositioningOptions found = noise.applied_to(options);
  std::vector<std::string> remarks;
  if (found.doppler_sigma > kMatters * options.doppler_sigma) {
    remarks.push_back(fmt::format(
        "the residuals of Doppler show a sigma of {:.1f} cm/s (zenith, 45 dB-Hz) at the end, more "
        "than the {:.1f} cm/s that are assumed; it is used",
        100 * found.doppler_sigma, 100 * options.doppler_sigma));
  }
  if (found.phase_sigma > kMatters * options.phase_sigma) {
    remarks.push_back(fmt::format(
        "the residuals of the phases show a sigma of {:.1f} mm (zenith, 45 dB-Hz) at the end, more "
        "than the {:.1f} mm that are assumed; it is used",
        1e3 * found.phase_sigma, 1e3 * options.phase_sigma));
  }
  return remarks;
}

RawRun run_raw(const RawLog& log, const PositioningOptions& options) {
  RawRun run;
  std::optional<Eigen::Vector3d> guess;
  Signals signals;
  for (const Epoch& epoch : log.epochs) {
    const PositioningOptions weights = run.noise.applied_to(options);
    EpochResult result = play(epoch, log, weights, guess);
    signals.add(epoch, result.satellites, options);
    if (result.velocity) run.noise.learn(*result.velocity);
    if (!run.epochs.empty()) add_step(run.epochs.back(), result, weights, run.noise);
    if (result.position) guess = result.position->position;
    count(result, run);
    run.epochs.push_back(std::move(result));
  }
  run.without_signal = signals.never();
  for (const KnownRangeEpoch& epoch : log.known_ranges) {
    EpochResult result;
    result.time = epoch.time;
    result.satellites = views_of(epoch);
    result.position = locate(result.satellites, std::nullopt, options);
    count(result, run);
    run.epochs.push_back(std::move(result));
  }
  return run;
}

}  // namespace pade::gnss
