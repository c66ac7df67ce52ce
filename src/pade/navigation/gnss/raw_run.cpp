#include "pade/navigation/gnss/raw_run.hpp"

#include <map>
#include <utility>

#include <fmt/format.h>

namespace pade::gnss {
namespace {

constexpr double kLongestStep = 2;  // s

void count(const EpochResult& result, RawRun& run) {
  for (const SatelliteView& view : result.satellites) ++run.uses.at(static_cast<std::size_t>(view.use));
  if (!result.position) ++run.without_position;
}

void add_step(const EpochResult& before, EpochResult& now, const PositioningOptions& options) {
  const double interval = seconds_between(before.time, now.time);
  if (!before.position || !now.position || interval > kLongestStep) return;
  Eigen::Vector3d speed = Eigen::Vector3d::Zero();
  if (now.velocity) speed = now.velocity->velocity;
  now.step = step_between(before.satellites, now.satellites, before.time, now.time, before.position->position,
                          speed, options);
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
    std::string names;
    for (const auto& [satellite, count] : satellites) {
      names += fmt::format("{}{} ({} epochs)", names.empty() ? "" : ", ", to_string(satellite), count);
    }
    sentences.push_back(fmt::format("{}: {}", to_name(use), names));
  }
  return sentences;
}

RawRun run_raw(const RawLog& log, const PositioningOptions& options) {
  RawRun run;
  std::optional<Eigen::Vector3d> guess;
  for (const Epoch& epoch : log.epochs) {
    EpochResult result = play(epoch, log, options, guess);
    if (!run.epochs.empty()) add_step(run.epochs.back(), result, options);
    if (result.position) guess = result.position->position;
    count(result, run);
    run.epochs.push_back(std::move(result));
  }
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
