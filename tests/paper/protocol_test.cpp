// The whole protocol of docs/navigation.md on the recordings: every seed, outages, starts in motion, late
// data, glitches. Slow, so labelled; prints the table that the document quotes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/navigation/replay.hpp"
#include "pade/paper/navigation_protocol.hpp"
#include "pade/simulation/flight/sensors/aiding.hpp"

namespace pade::navigation {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180;
const fs::path kData = fs::path(PADE_SOURCE_DIR) / "../shared/data/navigation";

Time at(double seconds) { return Time::from_seconds(seconds); }

class Protocol : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kData)) GTEST_SKIP() << kData << " is not here";
  }

  static NavigationLog recording(const std::string& folder, const std::string& gnss = "") {
    io::NavigationLogOptions options;
    options.gnss = gnss;
    auto log = io::read_navigation_log(kData / folder, options);
    EXPECT_TRUE(log.ok());
    return log ? *log : NavigationLog{};
  }
  static NavigatorOptions mav_options(const NavigationLog& log) {
    NavigatorOptions options;
    options.filter.gravity = 9.8064;
    options.gnss_lever_arm = log.gnss.lever_arm.value_or(Vector3d::Zero());
    return options;
  }
  static double worst(const std::vector<double>& values) {
    return *std::max_element(values.begin(), values.end());
  }
};

/// Of the pairs whose length is wrong by less than 10 % of the baseline, the share that a threshold on
/// baseline over sigma keeps when it refuses 95 % of those wrong by more than 20 %: the best that any
/// threshold does.
template <class Statistic>
double kept_at_95(const std::vector<evaluation::MotionError>& errors, const Statistic& statistic) {
  std::vector<double> bad;
  std::vector<double> good;
  for (const auto& e : errors) {
    if (e.length > 0.2 * e.baseline) bad.push_back(statistic(e));
    if (e.length < 0.1 * e.baseline) good.push_back(statistic(e));
  }
  const double threshold = evaluation::quantile(bad, 0.95);
  const auto kept = std::count_if(good.begin(), good.end(), [&](double s) { return s > threshold; });
  return static_cast<double>(kept) / static_cast<double>(good.size());
}

double kept_at_95(const std::vector<evaluation::MotionError>& errors) {
  return kept_at_95(errors, [](const auto& e) { return e.estimated_baseline / e.length_sigma; });
}

/// Of the pairs flagged `scale_valid`, the share whose length is wrong by more than 20 %.
double wrong_of_flagged(const std::vector<evaluation::MotionError>& errors) {
  double flagged = 0;
  double wrong = 0;
  for (const auto& e : errors) {
    flagged += e.scale_valid;
    wrong += e.scale_valid && e.length > 0.2 * e.baseline;
  }
  return flagged > 0 ? wrong / flagged : 0;
}

/// The number of sigmas in the limit below which 95 % of the bad pairs lie.
template <class Bad, class Statistic>
double sigmas_at_95(const std::vector<evaluation::MotionError>& errors, const Bad& bad,
                    const Statistic& statistic) {
  std::vector<double> values;
  for (const auto& e : errors) {
    if (bad(e)) values.push_back(statistic(e));
  }
  return evaluation::quantile(values, 0.95);
}

/// The errors with the rms that the other draws have at the same time in place of the predicted sigma: of an
/// oracle that knows how wrong the IMU is at each moment.
std::vector<evaluation::MotionError> with_rms_of_others(
    const std::vector<std::vector<evaluation::MotionError>>& draws) {
  std::vector<evaluation::MotionError> result;
  for (std::size_t i = 0; i < draws.front().size(); ++i) {
    double sum = 0;
    for (const auto& draw : draws) sum += draw[i].length * draw[i].length;
    for (const auto& draw : draws) {
      result.push_back(draw[i]);
      const double others = sum - draw[i].length * draw[i].length;
      result.back().length_sigma = std::sqrt(others / static_cast<double>(draws.size() - 1));
    }
  }
  return result;
}

TEST_F(Protocol, TwentySeeds) {
  for (const bool carrier : {false, true}) {
    const auto log = recording("mav_mh01", carrier ? "gnss_rtk_5hz.csv" : "gnss_spp_5hz.csv");
    std::vector<double> t95, t50, t95_long, rotation, velocity, tilt, nees, unsafe, lost, kept;
    std::vector<double> rotation_nees, length_nees, direction_nees;
    std::vector<double> unsafe_long, lost_long, unsafe_all, lost_all, wrong;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      NavigationProtocol protocol;
      protocol.seed = seed;
      const auto f = run_protocol(log, mav_options(log), protocol);
      EXPECT_TRUE(f.finite);
      t95.push_back(100 * f.short_pairs.translation_95);
      t50.push_back(100 * f.short_pairs.translation_median);
      t95_long.push_back(100 * f.long_pairs.translation_95);
      rotation.push_back(f.short_pairs.rotation_95 / kDegree);
      velocity.push_back(f.velocity_rms);
      tilt.push_back(f.tilt_rms / kDegree);
      nees.push_back(f.short_pairs.nees_mean);
      rotation_nees.push_back(f.short_pairs.rotation_nees_mean);
      length_nees.push_back(f.short_pairs.length_nees_mean);
      direction_nees.push_back(f.short_pairs.direction_nees_mean);
      wrong.push_back(wrong_of_flagged(f.short_errors));
      EXPECT_EQ(f.health.times_lost, 0U) << "seed " << seed;
      unsafe.push_back(-f.short_pairs.invalid_where_bad);
      lost.push_back(-f.short_pairs.valid_where_good);
      kept.push_back(-kept_at_95(f.short_errors));
      unsafe_long.push_back(-f.long_pairs.invalid_where_bad);
      lost_long.push_back(-f.long_pairs.valid_where_good);
      auto both = f.short_errors;
      both.insert(both.end(), f.long_errors.begin(), f.long_errors.end());
      const auto all = evaluation::summarise(both);
      unsafe_all.push_back(-all.invalid_where_bad);
      lost_all.push_back(-all.valid_where_good);
    }
    std::printf(
        "%s, worst of 20 seeds: 0.1 s 95 %% %.3f cm, median %.3f cm; 0.5 s 95 %% %.2f cm; rotation %.4f deg; "
        "velocity "
        "%.4f m/s; tilt %.3f deg; NEES %.2f..%.2f; scale_valid false where bad %.3f, true where good %.3f (a "
        "threshold made for 0.95 would keep %.3f)\n",
        carrier ? "RTK" : "SPP", worst(t95), worst(t50), worst(t95_long), worst(rotation), worst(velocity),
        worst(tilt), *std::min_element(nees.begin(), nees.end()), worst(nees), -worst(unsafe), -worst(lost),
        -worst(kept));
    std::printf(
        "    scale_valid false where bad / true where good, pairs 0.5 s apart: %.3f / %.3f; pairs of both "
        "lengths together: %.3f / %.3f\n",
        -worst(unsafe_long), -worst(lost_long), -worst(unsafe_all), -worst(lost_all));
    std::printf("    of the pairs flagged scale_valid at most %.2f %% err by more than 20 %%\n",
                100 * worst(wrong));
    EXPECT_LT(worst(wrong), 0.04);
    const auto least = [](const std::vector<double>& values) {
      return *std::min_element(values.begin(), values.end());
    };
    std::printf("    NEES of rotation (3) %.2f..%.2f, length (1) %.2f..%.2f, direction (2) %.2f..%.2f\n",
                least(rotation_nees), worst(rotation_nees), least(length_nees), worst(length_nees),
                least(direction_nees), worst(direction_nees));
    EXPECT_GT(least(rotation_nees), 1.8);
    EXPECT_LT(worst(rotation_nees), 5);
    EXPECT_LT(worst(t95), carrier ? 0.85 : 1.3);
    EXPECT_LT(worst(t50), 0.6);
    EXPECT_LT(worst(t95_long), 5.8);
    EXPECT_LT(worst(rotation), 0.03);
    EXPECT_LT(worst(velocity), 0.065);
    EXPECT_LT(worst(tilt), 0.30);
    EXPECT_LT(worst(nees), 5);
    EXPECT_GT(*std::min_element(nees.begin(), nees.end()), 1.8);
  }
}

/// The recording with GNSS made from its truth anew, with other noise of the same model.
NavigationLog redrawn(const NavigationLog& recorded, simulation::GnssModel model, std::uint64_t seed) {
  NavigationLog log = recorded;
  model.lever_arm = recorded.gnss.lever_arm.value_or(Vector3d::Zero());
  simulation::Gnss receiver(model, seed);
  log.gnss.fixes.clear();
  log.gnss.velocities.clear();
  for (std::size_t i = 40; i + 1 < log.truth.size(); i += 40) {  // 5 Hz
    const TrueState& truth = log.truth[i];
    const auto R = [&](std::size_t k) { return log.truth[k].T_world_body.rotation; };
    simulation::KinematicState state;
    state.time = truth.time;
    state.R_world_body = truth.T_world_body.rotation;
    state.position = truth.T_world_body.translation;
    state.velocity = truth.velocity;
    state.angular_velocity = rotation_log(Quaterniond(R(i - 1).conjugate() * R(i + 1))) /
                             seconds_between(log.truth[i - 1].time, log.truth[i + 1].time);
    const auto epoch = receiver.sample(state);
    log.gnss.fixes.push_back(epoch.fix);
    log.gnss.velocities.push_back(epoch.velocity);
  }
  return log;
}

TEST_F(Protocol, ScaleValidOverTwentyDrawsOfTheGnssNoise) {
  // The bad pairs of one recording are a handful of moments; the threshold is judged over many draws. It was
  // chosen on those from 101 on, not on those from 201 on.
  const auto recorded = recording("mav_mh01", "gnss_spp_5hz.csv");
  for (const auto& [carrier, first] : {std::pair{false, 101}, {true, 101}, {false, 201}, {true, 201}}) {
    const auto model =
        carrier ? simulation::GnssModel::carrier_phase() : simulation::GnssModel::single_point();
    std::vector<evaluation::MotionError> pooled;
    std::vector<std::vector<evaluation::MotionError>> draws;
    std::vector<double> kept, wrong;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      NavigationProtocol protocol;
      protocol.seed = seed;
      const auto log = redrawn(recorded, model, static_cast<std::uint64_t>(first) - 1 + seed);
      const auto f = run_protocol(log, mav_options(log), protocol);
      pooled.insert(pooled.end(), f.short_errors.begin(), f.short_errors.end());
      draws.push_back(f.short_errors);
      ASSERT_EQ(draws.back().size(), draws.front().size());
      kept.push_back(kept_at_95(f.short_errors));
      wrong.push_back(wrong_of_flagged(f.short_errors));
      EXPECT_EQ(f.health.times_lost, 0U) << "seed " << seed;
    }
    const auto all = evaluation::summarise(pooled);
    std::printf(
        "%s, GNSS noise drawn anew 20 times from seed %d, all pairs: of the flagged %.2f %% err by more than "
        "20 %% (worst draw %.2f %%); 0.1 s 95 %% %.3f cm; scale_valid false where bad "
        "%.4f of %zu, true where good %.4f of %zu; a threshold made for 0.95 of one draw keeps %.3f (least) "
        "%.3f (median) %.3f "
        "(most)\n",
        carrier ? "RTK" : "SPP", first, 100 * wrong_of_flagged(pooled), 100 * worst(wrong),
        100 * all.translation_95, all.invalid_where_bad, all.bad, all.valid_where_good, all.good,
        evaluation::quantile(kept, 0), evaluation::quantile(kept, 0.5), worst(kept));
    std::printf(
        "    at 95 %% of all bad pairs refused: kept %.4f; by an oracle of the true baseline %.4f, of the "
        "IMU's errors %.4f\n",
        kept_at_95(pooled), kept_at_95(pooled, [](const auto& e) { return e.baseline / e.length_sigma; }),
        kept_at_95(with_rms_of_others(draws)));
    std::printf(
        "    direction_valid false where bad %.4f of %zu, true where good %.4f of %zu; thresholds for 0.95: "
        "length "
        "%.2f, direction %.2f sigmas\n",
        all.direction_invalid_where_bad, all.direction_bad, all.direction_valid_where_good,
        all.direction_good,
        sigmas_at_95(
            pooled, [](const auto& e) { return e.length > 0.2 * e.baseline; },
            [](const auto& e) { return 0.2 * e.estimated_baseline / e.length_sigma; }),
        sigmas_at_95(
            pooled, [](const auto& e) { return e.direction > 0.35; },
            [](const auto& e) { return 0.35 / e.direction_sigma; }));
    EXPECT_LT(wrong_of_flagged(pooled), 0.02);
    EXPECT_LT(worst(wrong), 0.04);
    EXPECT_GT(all.valid_where_good, carrier ? 0.88 : 0.80);
  }
}

/// Takes the GNSS away within each window.
void remove_gnss(NavigationLog& log, const std::vector<double>& starts, double length) {
  const auto inside = [&](const auto& m) {
    return std::any_of(starts.begin(), starts.end(),
                       [&](double s) { return m.time > at(s) && m.time <= at(s + length); });
  };
  std::erase_if(log.gnss.fixes, inside);
  std::erase_if(log.gnss.velocities, inside);
}

TEST_F(Protocol, OutagesOfTenSeconds) {
  NavigationLog log = recording("mav_mh01", "gnss_spp_5hz.csv");
  std::vector<double> starts;
  for (double t = 60; t < 170; t += 20) starts.push_back(t);
  remove_gnss(log, starts, 10);
  std::vector<double> drifts;
  std::size_t inside = 0;
  std::size_t samples = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Navigator navigator(mav_options(log));
    ReplayOptions replay_options;
    replay_options.from = at(27);
    Random random(seed);
    const auto truth27 = evaluation::truth_at(log.truth, at(28.00356));
    const Vector3d x = truth27->T_world_body.rotation * Vector3d::UnitX();
    replay_options.headings.push_back(
        {at(28), std::atan2(x.y(), x.x()) + 2 * kDegree * random.normal(), 2 * kDegree});
    Vector3d at_start = Vector3d::Zero();
    std::size_t tick = 0;
    replay(log, navigator, replay_options, [&](Time now) {
      if (++tick % 20 != 0 || now < at(57)) return;  // 10 Hz
      const auto truth = evaluation::truth_at(log.truth, now);
      const auto pose = navigator.absolute_pose(now);
      if (!truth || pose.answer != Answer::valid) return;
      const Vector3d error = pose.T_world_body.translation - truth->T_world_body.translation;
      const Matrix3d R = pose.T_world_body.matrix3();
      const Matrix3d P = R * pose.covariance.block<3, 3>(6, 6) * R.transpose();
      for (const double start : starts) {
        const double since = now.seconds() - start;
        if (since > -0.1 && since <= 0) at_start = error;
        if (since <= 0 || since > 10) continue;
        ++samples;
        inside += (error.cwiseAbs().array() < 3 * P.diagonal().cwiseSqrt().array()).all();
        if (since > 9.9) drifts.push_back((error - at_start).norm());
      }
    });
  }
  const double share = static_cast<double>(inside) / static_cast<double>(samples);
  std::printf("outage 10 s: drift median %.2f m, max %.2f m over %zu windows; inside 3 sigma %.4f of %zu\n",
              evaluation::quantile(drifts, 0.5), worst(drifts), drifts.size(), share, samples);
  EXPECT_LT(evaluation::quantile(drifts, 0.5), 3);
  EXPECT_LT(worst(drifts), 8);
  EXPECT_GT(share, 0.99);
}

TEST_F(Protocol, TwentyStartsInMotionWithUnknownYaw) {
  const auto log = recording("mav_mh01", "gnss_spp_5hz.csv");
  std::vector<double> candidates;
  for (std::size_t i = 0; i + 2000 < log.truth.size(); i += 20) {
    const double t = log.truth[i].time.seconds();
    std::size_t fast = 0;
    for (std::size_t j = i; j < i + 2000; ++j) fast += log.truth[j].velocity.norm() > 0.4 ? 1 : 0;
    if (fast >= 1000 && t < 140) candidates.push_back(t);
  }
  int failures = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    NavigationProtocol protocol;
    protocol.start =
        candidates[static_cast<std::size_t>(random.uniform() * static_cast<double>(candidates.size()))];
    protocol.score_from = protocol.start + 30;
    protocol.heading_given = false;
    const auto f = run_protocol(log, mav_options(log), protocol);
    const double after = f.aligned.seconds() - protocol.start;
    const bool failed = f.aligned == Time{} || after > 15 || std::abs(f.yaw_error_aligned) > 10 * kDegree ||
                        f.short_pairs.translation_95 > 1.5 * 0.013;
    failures += failed;
    std::printf(
        "start %2d at %5.1f s: yaw known after %4.1f s, error %5.1f deg; then 0.1 s 95 %% %.2f cm%s\n",
        static_cast<int>(seed), protocol.start, after, f.yaw_error_aligned / kDegree,
        100 * f.short_pairs.translation_95, failed ? "  FAILED" : "");
  }
  EXPECT_EQ(failures, 0);
}

TEST_F(Protocol, LateGnss) {
  // Asked at once a frame cannot profit from what has not arrived; it is held to what punctual GNSS must
  // give.
  for (const bool carrier : {false, true}) {
    const char* file = carrier ? "gnss_rtk_5hz.csv" : "gnss_spp_5hz.csv";
    const auto log = recording("mav_mh01", file);
    std::vector<double> ratios, sigma_ratios, nees, t95;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      evaluation::MotionSummary figure[3];
      double sigma[3] = {};
      for (int k = 0; k < 3; ++k) {
        NavigationProtocol protocol;
        protocol.seed = seed;
        protocol.replay.seed = seed;
        protocol.replay.gnss_delay_high = k == 0 ? 0 : 0.3;
        protocol.answer_delay = k == 2 ? 0.35 : 0;
        const auto f = run_protocol(log, mav_options(log), protocol);
        figure[k] = f.short_pairs;
        for (const auto& e : f.short_errors)
          sigma[k] += e.sigma * e.sigma / static_cast<double>(f.short_errors.size());
      }
      EXPECT_EQ(figure[0].translation_95, figure[2].translation_95) << "late or not: the same bits";
      ratios.push_back(figure[1].translation_95 / figure[0].translation_95);
      sigma_ratios.push_back(std::sqrt(sigma[1] / sigma[0]));
      nees.push_back(figure[1].nees_mean);
      t95.push_back(100 * figure[1].translation_95);
    }
    std::printf(
        "%s, 0-300 ms late: asked 0.35 s later the same bits; asked at once 0.1 s 95 %% %.3f cm, %.1f %% "
        "more "
        "(worst of 20 seeds), the filter predicts %.1f %%, NEES %.2f to %.2f\n",
        file, worst(t95), 100 * (worst(ratios) - 1), 100 * (worst(sigma_ratios) - 1),
        *std::min_element(nees.begin(), nees.end()), worst(nees));
    EXPECT_LT(worst(t95), carrier ? 0.85 : 1.3);
    EXPECT_GT(*std::min_element(nees.begin(), nees.end()), 1.8);
    EXPECT_LT(worst(nees), 5);
  }
}

/// Seconds after `from` until the 95 % error of 1 s windows is back at or below twice that of the same window
/// of the run without glitches (or of that whole run, where that is more).
double recovery(const NavigationFigures& figures, const NavigationFigures& clean, double from) {
  constexpr std::size_t kWindow = 10;  // pairs in 1 s
  double bad_until = from;
  const auto window_95 = [](const std::vector<evaluation::MotionError>& errors, std::size_t first) {
    std::vector<double> window;
    for (std::size_t i = first; i < first + kWindow; ++i) window.push_back(errors[i].translation);
    return evaluation::quantile(window, 0.95);
  };
  const std::size_t pairs = std::min(figures.short_errors.size(), clean.short_errors.size());
  for (std::size_t i = 0; i + kWindow <= pairs; ++i) {
    const double t = figures.short_errors[i].t2.seconds();
    if (t < from || t > from + 8) continue;
    const double usual = std::max(window_95(clean.short_errors, i), clean.short_pairs.translation_95);
    if (window_95(figures.short_errors, i) > 2 * usual) bad_until = t;
  }
  return bad_until - from;
}

TEST_F(Protocol, Glitches) {
  const auto clean = recording("mav_mh01", "gnss_spp_5hz.csv");
  for (const std::string name : {"steps", "velocity spikes", "outliers"}) {
    std::vector<double> ratios, recoveries;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      NavigationLog log = clean;
      Random random(seed);
      std::vector<double> glitches;  // when they begin
      for (std::size_t i = 0; i < log.gnss.fixes.size(); ++i) {
        const double t = log.gnss.fixes[i].time.seconds();
        if (t < 40) continue;
        // Steps of 2 to 50 m, 3 s long, every 10 s; spikes of 1 to 10 m/s every 5 s; a tenth of all epochs
        // wild.
        const double size =
            2 * std::pow(25, std::fmod(std::floor(t / 10) * 0.618 + 0.05 * static_cast<double>(seed), 1.0));
        if (name == "steps" && std::fmod(t, 10) < 3) {
          const double turn = 0.7 * static_cast<double>(seed) + std::floor(t / 10);
          log.gnss.fixes[i].position += size * Vector3d(0.9 * std::cos(turn), 0.9 * std::sin(turn), 0.43);
          if (std::fmod(t, 10) < 0.2) glitches.push_back(t);
        }
        if (name == "velocity spikes" && (i + seed) % 25 == 0) {
          log.gnss.velocities[i].velocity += (1 + 9 * random.uniform()) * random.normal3().normalized();
          glitches.push_back(t);
        }
        if (name == "outliers" && random.uniform() < 0.1) {
          log.gnss.fixes[i].position += 20 * random.normal3();
          log.gnss.velocities[i].velocity += 2 * random.normal3();
          glitches.push_back(t);
        }
      }
      NavigationProtocol protocol;
      protocol.seed = seed;
      const auto undisturbed = run_protocol(clean, mav_options(clean), protocol);
      const auto f = run_protocol(log, mav_options(log), protocol);
      EXPECT_TRUE(f.finite);
      ASSERT_EQ(f.short_errors.size(), undisturbed.short_errors.size());
      ratios.push_back(f.short_pairs.translation_95 / undisturbed.short_pairs.translation_95);
      for (const double glitch : glitches) {
        if (glitch > 57 && glitch < 177) recoveries.push_back(recovery(f, undisturbed, glitch));
      }
    }
    std::printf("%s: 0.1 s 95 %% at most %.2f x clean (20 seeds)", name.c_str(), worst(ratios));
    ASSERT_FALSE(recoveries.empty());
    std::printf("; after %zu glitches the windows of 1 s were at most 2 x clean again within %.1f s",
                recoveries.size(), worst(recoveries));
    EXPECT_LT(worst(recoveries), 3);
    std::printf("\n");
    EXPECT_LT(worst(ratios), 2);
  }
}

TEST_F(Protocol, CarThroughOutages) {
  // The positions of this log are of a moment 0.1 s after their stamp: with 0 the mean chi-square of their
  // innovations is 18 instead of 3.
  NavigatorOptions options;
  options.filter = FilterOptions::of(ImuClass::consumer);
  options.gnss_position_latency = -0.1;
  const NavigationLog full = recording("car_drive_rtk");
  const double limits[] = {1.7, 40, 206};
  const double lengths[] = {10, 30, 60};
  for (const bool on_road : {false, true}) {
    for (int k = 0; k < 3; ++k) {
      std::vector<double> drifts;
      // Each outage in a run of its own. One every 15 s are too few: for 10 s their median is anything from
      // 1.2 to 2.4 m, with the moment of the first.
      for (double start = 100; start + lengths[k] < 540; start += 2) {
        NavigationLog log = full;
        remove_gnss(log, {start}, lengths[k]);
        const auto fix =
            std::lower_bound(full.gnss.fixes.begin(), full.gnss.fixes.end(), at(start + lengths[k] - 0.3),
                             [](const GnssFix& f, Time t) { return f.time < t; });
        Navigator navigator(options);
        ReplayOptions until;
        until.to = at(start + lengths[k]);
        until.road_rate = on_road ? 5 : 0;
        replay(log, navigator, until, nullptr);
        const auto pose = navigator.absolute_pose(at(fix->time.seconds() - options.gnss_position_latency));
        ASSERT_EQ(pose.answer, Answer::valid);
        drifts.push_back((pose.T_world_body.translation - fix->position).head<2>().norm());
      }
      const double median = evaluation::quantile(drifts, 0.5);
      std::printf(
          "car%s, outage %2.0f s: horizontal drift median %.2f m (limit %.1f), max %.1f m, %zu windows\n",
          on_road ? " on its wheels" : "", lengths[k], median, limits[k], worst(drifts), drifts.size());
      EXPECT_LT(median, limits[k]);
    }
  }
}

TEST_F(Protocol, QuadrotorWithAGap) {
  const auto log = recording("quad_px4_flow");
  NavigatorOptions options;
  options.filter = FilterOptions::of(ImuClass::consumer);
  Navigator navigator(options);
  int counts[5] = {};
  std::vector<double> chi_square;
  navigator.on_retired([&](const Measurement& m) {
    if (m.kind() != SensorKind::gnss_velocity || m.innovation.size == 0) return;
    ++counts[static_cast<int>(m.innovation.verdict)];
    chi_square.push_back(m.innovation.chi_square);
  });
  replay(log, navigator, {}, nullptr);
  double mean = 0;
  for (const double c : chi_square) mean += c / static_cast<double>(chi_square.size());
  const Health health = navigator.health();
  std::printf(
      "quadrotor: velocities accepted %d, inflated %d, rejected %d, re-acquired %d; mean chi-square %.2f (3 "
      "expected), median "
      "%.2f (2.37); gaps %d; %s at the end\n",
      counts[0], counts[1], counts[2], counts[3], mean, evaluation::quantile(chi_square, 0.5),
      static_cast<int>(health.imu_gaps), std::string(to_name(health.status)).c_str());
  EXPECT_GT(chi_square.size(), 3000U);
  EXPECT_LT(counts[2] + counts[3], static_cast<int>(chi_square.size() / 50));
  EXPECT_EQ(health.status, NavigationStatus::navigating);
  EXPECT_EQ(health.times_lost, 0U);
}

}  // namespace
}  // namespace pade::navigation
