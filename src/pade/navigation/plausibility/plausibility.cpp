#include "pade/navigation/plausibility/plausibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "pade/core/compute/median.hpp"
#include "pade/navigation/plausibility/force_match.hpp"
#include "pade/navigation/plausibility/position_lag.hpp"

namespace pade::navigation {
namespace {

using Eigen::Matrix3d;

void add(std::vector<Hint>& hints, std::string id, HintSeverity severity, std::string message,
         std::string advice) {
  hints.push_back({std::move(id), severity, std::move(message), std::move(advice)});
}

/// First and last stamp of a sensor, in whatever order.
struct Span {
  double first = std::numeric_limits<double>::infinity();
  double last = -std::numeric_limits<double>::infinity();
  [[nodiscard]] bool empty() const { return first > last; }
};

template <class Samples>
Span span_of(const Samples& samples) {
  Span span;
  for (const auto& sample : samples) {
    span.first = std::min(span.first, sample.time.seconds());
    span.last = std::max(span.last, sample.time.seconds());
  }
  return span;
}

void check_overlap(const NavigationLog& log, std::vector<Hint>& hints) {
  const Span imu = span_of(log.imu);
  const std::array<std::pair<const char*, Span>, 4> others = {
      {{"GNSS velocities", span_of(log.gnss.velocities)},
       {"GNSS positions", span_of(log.gnss.fixes)},
       {"barometer", span_of(log.barometer)},
       {"magnetometer", span_of(log.magnetometer)}}};
  for (const auto& [name, span] : others) {
    if (imu.empty() || span.empty()) continue;
    const double common = std::min(imu.last, span.last) - std::max(imu.first, span.first);
    const std::string covers = fmt::format("{} cover {:.1f} to {:.1f} s, the IMU {:.1f} to {:.1f} s", name,
                                           span.first, span.last, imu.first, imu.last);
    if (common <= 0) {
      add(hints, "no-overlap", HintSeverity::error, covers + ": no overlap",
          "the clocks differ: give all logs the same zero, or the stamps of one are in another unit");
    } else if (common < 0.5 * (imu.last - imu.first)) {
      add(hints, "no-overlap", HintSeverity::warning,
          fmt::format("{}: they share {:.0f} s only", covers, common),
          "see whether the clocks differ; what lies outside is navigated without this sensor");
    }
  }
}

void check_stamps_go_back(const std::vector<ImuSample>& imu, std::vector<Hint>& hints) {
  constexpr double kReset = 0.5;  // s; less is jitter
  for (std::size_t i = 1; i < imu.size(); ++i) {
    const double step = seconds_between(imu[i - 1].time, imu[i].time);
    if (step > -kReset) continue;
    add(hints, "stamps-go-back", HintSeverity::error,
        fmt::format("the stamps of the IMU go back by {:.3f} s at sample {} of {}, from {:.3f} to {:.3f} s: "
                    "its clock "
                    "was set anew, and every sample until it has caught up is refused",
                    -step, i + 1, imu.size(), imu[i - 1].time.seconds(), imu[i].time.seconds()),
        "cut the log there, or add the jump to the stamps behind it");
    return;
  }
}

void check_rate(const std::vector<ImuSample>& imu, std::vector<Hint>& hints) {
  constexpr double kSlow = 80;        // Hz
  constexpr double kVibration = 1.5;  // m/s²
  std::vector<double> steps;
  std::vector<double> bends;
  for (std::size_t i = 2; i < imu.size(); ++i) {
    steps.push_back(seconds_between(imu[i - 1].time, imu[i].time));
    const Vector3d bend = imu[i].specific_force - 2 * imu[i - 1].specific_force + imu[i - 2].specific_force;
    bends.push_back(bend.norm());
  }
  if (steps.size() < 100) return;
  const double rate = 1 / median(std::move(steps));
  // The norm of three components of variance 6 s², at its median.
  const double spread = median(std::move(bends)) / (1.538 * std::sqrt(6.0));
  if (rate > kSlow || spread < kVibration) return;
  add(hints, "imu-picked", HintSeverity::warning,
      fmt::format(
          "the IMU has {:.0f} samples per second that differ by {:.1f} m/s² from one to the next: they look "
          "picked from a faster stream, so that vibration appears as motion",
          rate, spread),
      "log the IMU at its full rate, or its integrated increments, or filter before picking");
}

void check_upright(const std::vector<ImuSample>& imu, std::vector<Hint>& hints) {
  Vector3d mean = Vector3d::Zero();
  for (const ImuSample& sample : imu) mean += sample.specific_force;
  if (imu.empty()) return;
  mean /= static_cast<double>(imu.size());
  if (mean.z() > -0.8 * mean.norm() || mean.norm() < 5) return;
  add(hints, "upside-down", HintSeverity::warning,
      fmt::format("the mean specific force is {:.1f} m/s² along the body's z, which is up: the vehicle would "
                  "fly upside "
                  "down",
                  mean.z()),
      "where the log is in forward, right, down, write '# frame=FRD' into its first line; where it counts "
      "the pull of "
      "gravity as a positive acceleration downwards, turn the signs of ax ay az round (at rest a level "
      "sensor measures "
      "+9.8 upwards)");
}

/// Without the axes that most velocities do not measure, where positions then have no way either, and without
/// the velocities that do not measure the others.
GnssLog measured_part(const GnssLog& gnss) {
  Vector3d measured = Vector3d::Zero();
  for (const GnssVelocity& velocity : gnss.velocities) measured += measured_axes(velocity);
  const Vector3d axes = (measured.array() > 0.5 * static_cast<double>(gnss.velocities.size())).cast<double>();
  GnssLog part = gnss;
  std::erase_if(part.velocities, [&](const GnssVelocity& velocity) {
    return (axes - measured_axes(velocity)).maxCoeff() > 0;
  });
  if (gnss.velocities.empty() || axes == Vector3d::Ones()) return part;
  for (GnssFix& fix : part.fixes) fix.position = fix.position.cwiseProduct(axes).eval();
  for (GnssVelocity& velocity : part.velocities)
    velocity.velocity = velocity.velocity.cwiseProduct(axes).eval();
  return part;
}

/// The mean velocity between two fixes, from the velocities in between.
void check_positions(const GnssLog& gnss, std::vector<Hint>& hints) {
  constexpr double kStep = 2;  // s
  double path = 0, along = 0, along_swapped = 0, moved2 = 0, flown2 = 0, noise2 = 0, farthest = 0;
  double level_moved2 = 0, level_flown2 = 0;  // horizontal
  std::size_t next = 0;
  const GnssFix* last = nullptr;
  Vector3d flown = Vector3d::Zero();
  const GnssVelocity* before = nullptr;
  for (const GnssFix& fix : gnss.fixes) {
    for (; next < gnss.velocities.size() && gnss.velocities[next].time <= fix.time; ++next) {
      const GnssVelocity& v = gnss.velocities[next];
      if (before != nullptr)
        flown += 0.5 * seconds_between(before->time, v.time) * (before->velocity + v.velocity);
      before = &v;
    }
    farthest = std::max(farthest, fix.position.head<2>().cwiseAbs().maxCoeff());
    const double gap = last == nullptr ? 0 : seconds_between(last->time, fix.time);
    if (last != nullptr && gap < kStep) continue;
    if (last != nullptr && gap < 3 * kStep) {
      const Vector3d moved = fix.position - last->position;
      path += flown.norm();
      along += moved.dot(flown);
      along_swapped += moved.dot(Vector3d(flown.y(), flown.x(), -flown.z()));
      moved2 += moved.squaredNorm();
      flown2 += flown.squaredNorm();
      noise2 += fix.covariance.trace() + last->covariance.trace();
      level_moved2 += moved.head<2>().squaredNorm();
      level_flown2 += flown.head<2>().squaredNorm();
    }
    last = &fix;
    flown.setZero();
  }
  constexpr double kLeastPath = 30;  // m
  constexpr double kDegreePerMetre = 1e-5;
  const bool as_degrees =
      farthest <= 360 && std::sqrt(level_moved2) < 10 * kDegreePerMetre * std::sqrt(level_flown2);
  if ((path < kLeastPath && !as_degrees) || flown2 == 0) return;
  const double scale = along / flown2;
  const double agreement = along / std::sqrt(moved2 * flown2 + 1e-12);
  if (as_degrees) {
    return add(
        hints, "gnss-degrees", HintSeverity::error,
        fmt::format("the velocities fly {:.0f} m while the positions move by {:.2g} of that: they look like "
                    "latitude and longitude",
                    path, std::sqrt(level_moved2 / level_flown2)),
        "name the columns lat, lon, alt, and they become metres around the first fix");
  }
  // What the errors of the positions explain is no contradiction.
  if (moved2 + flown2 - 2 * along < 2 * noise2) return;
  if (along_swapped > 1.3 * std::max(along, 0.0) && along_swapped > 0.7 * std::sqrt(moved2 * flown2)) {
    return add(
        hints, "gnss-axes", HintSeverity::error,
        "the velocities fit the positions when read as north, east, down: positions and velocities are in "
        "different axes",
        "name the columns (pE pN pU, vN vE vD), so that each is read in its own axes");
  }
  if (agreement > 0.8 && scale > 0.7 && scale < 1.4) return;
  const std::string unit = agreement > 0.8 && scale > 0.24 && scale < 0.32   ? " (km/h?)"
                           : agreement > 0.8 && scale > 0.47 && scale < 0.56 ? " (knots?)"
                           : agreement > 0.8 && scale < 0.02                 ? " (cm/s?)"
                                                                             : "";
  add(hints, "gnss-contradiction", HintSeverity::error,
      fmt::format("positions and velocities of the GNSS do not belong together: the positions move by {:.2f} "
                  "of what the "
                  "velocities fly{}, with an agreement of {:.2f} (1 is the same)",
                  scale, unit, agreement),
      "see which of the two is wrong: axes, unit (m/s), or the clock of one of them");
}

/// Which of positions and velocities a lag between them is laid upon.
enum class Late { positions, velocities, either };

std::string described(const PositionLag& apart, Late which) {
  const double by = std::abs(apart.seconds);
  const auto late = [](double seconds) { return seconds > 0 ? "late" : "early"; };
  switch (which) {
    case Late::positions:
      return fmt::format("the GNSS positions are {:.2f} s {} against its velocities", by,
                         late(apart.seconds));
    case Late::velocities:
      return fmt::format("the GNSS velocities are {:.2f} s {} against its positions", by,
                         late(-apart.seconds));
    case Late::either:
      break;
  }
  return fmt::format(
      "positions and velocities of the GNSS are {:.2f} s apart: the positions are {}, or the velocities {}",
      by, late(apart.seconds), late(-apart.seconds));
}

/// By what the IMU says: `velocity_lag` in s where it has found one, else where it clearly fits better.
Late late_one(const PositionLag& apart, const ForceMatch& imu, double velocity_lag) {
  constexpr double kPunctual = 0.05;  // s
  constexpr double kClearly = 0.8;    // of the misfit
  if (velocity_lag != 0) {
    return std::abs(velocity_lag + apart.seconds) < kPunctual ? Late::velocities : Late::positions;
  }
  const double as_stamped = imu.misfit();
  const double moved = imu.misfit(-apart.seconds);
  if (as_stamped < kClearly * moved) return Late::positions;
  return moved < kClearly * as_stamped ? Late::velocities : Late::either;
}

/// Positions and velocities that part.
void check_drift(const GnssLog& gnss, double lag, std::vector<Hint>& hints) {
  const auto drift = position_drift(gnss, lag);
  if (!drift) return;
  constexpr std::array kAxes = {"to the east", "to the north", "upward"};
  add(hints, "gnss-drift", HintSeverity::warning,
      fmt::format("the velocities of the GNSS fly {:.0f} m farther {} than its positions in {:.0f} s ({:.2f} "
                  "m/s on average)",
                  drift->metres, kAxes[static_cast<std::size_t>(drift->axis)], drift->seconds,
                  drift->metres / drift->seconds),
      "one of them has a bias, and places drift with the velocities: give the worse one a larger sigma in "
      "gnss.csv, "
      "and do not rely on heights or places over minutes");
}

/// Positions and velocities that are apart in time. @return by how much, s
double check_apart(const GnssLog& gnss, const ForceMatch& imu, double velocity_lag,
                   std::vector<Hint>& hints) {
  const auto apart = position_lag(gnss);
  if (!apart) return 0;
  const Late late = late_one(*apart, imu, velocity_lag);
  const auto options = [](double position, double velocity) {
    return fmt::format("--gnss-latency {:.2f} --gnss-velocity-latency {:.2f}", position, velocity);
  };
  const std::string of_positions = options(velocity_lag + apart->seconds, velocity_lag);
  const std::string of_velocities = options(0, velocity_lag != 0 ? velocity_lag : -apart->seconds);
  for (Hint& hint : hints) {
    if (hint.id == "gnss-lag") hint.advice = "this is not the lag of the positions: see what is said of both";
  }
  add(hints, "gnss-apart", HintSeverity::warning,
      fmt::format("{} (± {:.2f} s): the ways between fixes and what the velocities fly differ by {:.2f} m as "
                  "stamped, and "
                  "by {:.2f} m when moved by that",
                  described(*apart, late), std::max(apart->sigma, 0.01), apart->as_stamped, apart->moved),
      late == Late::either
          ? fmt::format("try {}, then {}, and keep what leaves the smaller mean χ² of the positions",
                        of_positions, of_velocities)
          : fmt::format("give both latencies ({}), or correct the stamps",
                        late == Late::positions ? of_positions : of_velocities));
  return apart->seconds;
}

/// What of the readings of IMU and GNSS fits best. Returns the seconds that the velocities are late, 0 where
/// that is not known.
double check_readings(const NavigationLog& log, const ForceMatch& given, std::vector<Hint>& hints) {
  const double as_given = given.misfit();
  if (!std::isfinite(as_given)) return 0;
  constexpr double kSuspicious = 1.0;  // m/s²
  constexpr double kClearly = 0.5;
  struct Candidate {
    Reading reading;
    const char* id;
    const char* what;
    const char* advice;
  };
  constexpr double kDegree = 0.017453292519943295;
  const std::array candidates = {
      Candidate{{kDegree, false, Vector3d::Zero(), false, false},
                "gyro-unit",
                "when the angular rates are read as deg/s",
                "convert the angular rates to rad/s, or write the unit into the heading (gx [deg/s])"},
      Candidate{{1, true, Vector3d::Zero(), false, false},
                "gyro-axes",
                "when y and z of the angular rates are turned round",
                "gyroscopes and accelerometers are in different axes (FLU and FRD): convert one of them"},
      Candidate{
          {-1, false, Vector3d::Zero(), false, true},  // mirrored axes are right-handed with all signs turned
          "gyro-axes",
          "when the axes of the IMU are read as left-handed",
          "two axes of the IMU have changed places, or the sign of one is wrong, in the angular rates and "
          "the "
          "forces alike: give x, y, z of a right-handed frame"},
      Candidate{{-1, false, Vector3d::Zero(), false, false},
                "gyro-axes",
                "when all angular rates have the other sign",
                "turn the signs of the angular rates round: positive is counterclockwise about each axis"},
      Candidate{{1, false, Vector3d::Zero(), true, false},
                "gnss-axes",
                "when the GNSS velocities are read as north, east, down",
                "write '# frame=NED' into the first line of the GNSS log, or name its columns vN vE vD"}};
  const Candidate* best = nullptr;
  double least = kClearly * as_given;
  for (const Candidate& candidate : candidates) {
    if (as_given <= kSuspicious) break;
    const double misfit = ForceMatch(log, with_bias(log, candidate.reading)).misfit();
    if (misfit < least) {
      least = misfit;
      best = &candidate;
    }
  }
  if (best != nullptr) {
    add(hints, best->id, HintSeverity::error,
        fmt::format("IMU and GNSS contradict each other by {:.1f} m/s² as given, and by {:.2f} m/s² {}",
                    as_given, least, best->what),
        best->advice);
    return 0;
  }
  if (const auto lag = given.lag(); lag) {
    const bool leap = std::abs(std::abs(lag->seconds) - 18) < 1 || std::abs(std::abs(lag->seconds) - 37) < 1;
    add(hints, "gnss-lag", std::abs(lag->seconds) > 1 ? HintSeverity::error : HintSeverity::warning,
        fmt::format(
            "the GNSS velocities are {:.2f} s {}: IMU and GNSS contradict each other by {:.2f} m/s² as "
            "stamped, and by {:.2f} m/s² when moved by that{}",
            std::abs(lag->seconds), lag->seconds > 0 ? "late" : "early", as_given, lag->misfit,
            leap ? "; this looks like the leap seconds between GPS time and UTC (18 s) or TAI (37 s)" : ""),
        fmt::format("give the latency (--gnss-latency {:.2f}), or correct the stamps", lag->seconds));
    return lag->seconds;
  }
  constexpr double kContradiction = 3;  // m/s²
  if (as_given > kContradiction) {
    add(hints, "imu-contradiction", HintSeverity::error,
        fmt::format(
            "IMU and GNSS contradict each other by {:.1f} m/s² (flights of good logs: under 1), and neither "
            "another unit, other axes nor a lag explains it",
            as_given),
        "check the columns, axes and units of imu.csv, and that both logs are of the same flight");
  }
  return 0;
}

}  // namespace

std::vector<Hint> check_log(const NavigationLog& log) {
  std::vector<Hint> hints;
  check_overlap(log, hints);
  check_stamps_go_back(log.imu, hints);
  check_rate(log.imu, hints);
  check_upright(log.imu, hints);
  const GnssLog gnss = measured_part(log.gnss);
  check_positions(gnss, hints);
  const bool clocks = std::any_of(hints.begin(), hints.end(), [](const Hint& hint) {
    return hint.severity == HintSeverity::error && (hint.id == "no-overlap" || hint.id == "stamps-go-back");
  });
  if (clocks) return hints;
  const ForceMatch given(log, with_bias(log, {}));
  const double velocity_lag = check_readings(log, given, hints);
  const bool contradicts = std::any_of(hints.begin(), hints.end(), [](const Hint& hint) {
    return hint.severity == HintSeverity::error && hint.id != "upside-down";
  });
  if (!contradicts) check_drift(gnss, check_apart(gnss, given, velocity_lag, hints), hints);
  return hints;
}

std::optional<Hint> regularise_stamps(std::vector<ImuSample>& samples) {
  constexpr double kShare = 0.005;  // of samples that do not rise; fewer are refused one by one
  constexpr double kReset = 0.5;    // s; a step back by more is a clock that was set anew
  std::vector<double> steps;
  std::size_t falling = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double step = seconds_between(samples[i - 1].time, samples[i].time);
    if (step < -kReset) return std::nullopt;
    if (step <= 0) ++falling;
    steps.push_back(step);
  }
  if (steps.size() < 10 || static_cast<double>(falling) < kShare * static_cast<double>(steps.size())) {
    return std::nullopt;
  }
  const double total = seconds_between(samples.front().time, samples.back().time);
  const double usual = total / static_cast<double>(steps.size());
  double largest = 0;
  for (std::size_t begin = 0; begin < samples.size();) {
    std::size_t end = begin + 1;
    while (end < samples.size() &&
           seconds_between(samples[end - 1].time, samples[end].time) < 30 * usual + 0.1)
      ++end;
    // A line through stamp over number.
    const double n = static_cast<double>(end - begin);
    const Time zero = samples[begin].time;
    double mean_t = 0, slope = usual, sum = 0, squares = 0;
    for (std::size_t i = begin; i < end; ++i) mean_t += seconds_between(zero, samples[i].time) / n;
    const double mean_i = 0.5 * (n - 1);
    for (std::size_t i = begin; i < end; ++i) {
      const double x = static_cast<double>(i - begin) - mean_i;
      sum += x * (seconds_between(zero, samples[i].time) - mean_t);
      squares += x * x;
    }
    if (squares > 0 && sum > 0) slope = sum / squares;
    for (std::size_t i = begin; i < end; ++i) {
      const double fitted = mean_t + slope * (static_cast<double>(i - begin) - mean_i);
      largest = std::max(largest, std::abs(fitted - seconds_between(zero, samples[i].time)));
      samples[i].time = Time{zero.nanoseconds + Time::from_seconds(fitted).nanoseconds};
    }
    begin = end;
  }
  return Hint{
      "imu-stamps-regularised", HintSeverity::warning,
      fmt::format(
          "{} of {} stamps of the IMU repeat or go back: they were put on a straight line ({:.1f} Hz), "
          "moved by at most {:.1f} ms",
          falling, samples.size(), 1 / usual, 1e3 * largest),
      "log the stamps of the sensor itself, with microseconds"};
}

}  // namespace pade::navigation
