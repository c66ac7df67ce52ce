// Files of raw GNSS with seeded damage: refused or played, never anything that is not finite. The fuzz
// targets go on from here (tests/fuzz/raw_gnss_fuzz.cpp).
#include <cmath>
#include <filesystem>
#include <random>

#include <gtest/gtest.h>

#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/io/text.hpp"
#include "pade/navigation/gnss/raw_run.hpp"
#include "pade/navigation/odometry/planar_run.hpp"

namespace pade::io {
namespace {

std::string damaged(std::string text, std::mt19937& random) {
  constexpr std::string_view kBytes = "0123456789 -.eED>GREC\n\0\xff";
  const auto below = [&](std::size_t n) {
    return static_cast<std::size_t>(random() % std::max<std::size_t>(n, 1));
  };
  for (std::size_t i = below(6) + 1; i > 0 && !text.empty(); --i) {
    const std::size_t at = below(text.size());
    switch (below(5)) {
      case 0:
        text[at] = kBytes[below(kBytes.size())];
        break;
      case 1:
        text.erase(at, below(100));
        break;
      case 2:
        text.insert(at, text.substr(below(text.size()), below(200)));
        break;
      case 3:
        text.resize(at);
        break;
      default:
        text.insert(at, 1, kBytes[below(kBytes.size())]);
        break;
    }
  }
  return text;
}

/// An epoch that sees every satellite of the messages.
void see_all_satellites(gnss::RawLog& log) {
  gnss::Epoch epoch;
  const auto add = [&](const auto& ephemeris) {
    epoch.time = ephemeris.toe;
    gnss::Signal signal;
    signal.satellite = ephemeris.satellite;
    signal.code = {ephemeris.satellite.system == gnss::System::beidou ? '2' : '1', 'C'};
    signal.pseudorange = 2.2e7;
    signal.doppler = 100;
    signal.carrier = 1e8;
    epoch.signals.push_back(signal);
  };
  for (const auto& ephemeris : log.broadcast.kepler) add(ephemeris);
  for (const auto& ephemeris : log.broadcast.glonass) add(ephemeris);
  log.epochs = {epoch, epoch};
  log.epochs.back().time.nanoseconds += 1'000'000'000;
}

void expect_finite(const gnss::RawLog& log) {
  for (const auto& epoch : gnss::run_raw(log, {}).epochs) {
    for (const auto& view : epoch.satellites) {
      EXPECT_TRUE(view.use != gnss::Use::used || std::isfinite(view.range_residual));
    }
    EXPECT_TRUE(!epoch.position || epoch.position->position.allFinite());
    EXPECT_TRUE(!epoch.velocity || epoch.velocity->velocity.allFinite());
    EXPECT_TRUE(!epoch.step || epoch.step->step.allFinite());
  }
  using navigation::PlanarCoupling;
  for (const auto coupling : {PlanarCoupling::tight, PlanarCoupling::loose}) {
    for (const auto& frame : navigation::run_planar(log, {}, {}, coupling).frames) {
      EXPECT_TRUE(frame.estimate.position.allFinite());
      EXPECT_GE(frame.estimate.covariance.diagonal().minCoeff(), 0);
      EXPECT_TRUE(std::isfinite(frame.estimate.yaw_sigma));
    }
  }
}

TEST(DamagedRawGnss, IsRefusedOrPlayed) {
  namespace fs = std::filesystem;
  const fs::path corpus = fs::path(PADE_SOURCE_DIR) / "tests/fuzz/corpus";
  const std::vector<std::pair<std::string, Status (*)(std::string_view, std::string_view, gnss::RawLog&)>>
      kReaders{{"raw_observations/epochs.obs", parse_rinex_observations},
               {"raw_observations/events.obs", parse_rinex_observations},
               {"raw_navigation/mixed.nav", parse_rinex_navigation},
               {"raw_known_ranges/street.txt", parse_known_ranges},
               {"raw_known_ranges/drive.txt", parse_known_ranges}};
  std::mt19937 random(1);
  for (const auto& [file, parse] : kReaders) {
    const auto whole = read_file(corpus / file);
    ASSERT_TRUE(whole) << whole.error().message;
    gnss::RawLog intact;
    ASSERT_TRUE(parse(*whole, file, intact)) << file;
    int played = 0;
    for (int i = 0; i < 1500; ++i) {
      gnss::RawLog log;
      if (!parse(damaged(*whole, random), file, log)) continue;
      if (parse == parse_rinex_navigation) see_all_satellites(log);
      expect_finite(log);
      ++played;
    }
    EXPECT_GT(played, 100) << file;
  }
}

}  // namespace
}  // namespace pade::io
