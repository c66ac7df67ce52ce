// Readers of raw GNSS: what is right, and what is wrong and survived.
#include "pade/io/gnss/raw_gnss_files.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using gnss::System;
using testing::HasSubstr;

constexpr std::int64_t kSecond = 1'000'000'000;

std::string header_line(std::string text, const std::string& label) {
  text.resize(60, ' ');
  return text + label + "\n";
}

std::string obs_header(const std::string& version = "3.03", const std::string& time_system = "GPS") {
  return header_line("     " + version + "           OBSERVATION DATA    M", "RINEX VERSION / TYPE") +
         header_line("G    4 C1C L1C D1C S1C", "SYS / # / OBS TYPES") +
         header_line("R    2 C1C L1C", "SYS / # / OBS TYPES") +
         header_line("  2023     6    29    11    11   42.6940000     " + time_system, "TIME OF FIRST OBS") +
         header_line("", "END OF HEADER");
}

std::string epoch_line(double second, int count, int flag = 0) {
  char line[64];
  std::snprintf(line, sizeof line, "> 2023  6 29 11 12%11.7f  %d%3d\n", second, flag, count);
  return line;
}

const std::string kG8 = "G 8  18689403.653 1  98213476.439 1      -249.408          47.000\n";
const std::string kG10 = "G10  19512480.874   102538779.13513     -1894.674          45.000\n";
const std::string kR1 = "R 1  21761825.907 2\n";

gnss::RawLog parsed(const std::string& text) {
  gnss::RawLog log;
  const Status status = parse_rinex_observations(text, "a.obs", log);
  EXPECT_TRUE(status) << status.error().message;
  return log;
}

std::string refused(const std::string& text) {
  gnss::RawLog log;
  const Status status = parse_rinex_observations(text, "a.obs", log);
  EXPECT_FALSE(status);
  return status.error().message;
}

TEST(RinexObservations, GivesEachSignalItsValues) {
  const auto log = parsed(obs_header() + epoch_line(42.094, 3) + kG8 + kG10 + kR1);
  ASSERT_EQ(log.epochs.size(), 1U);
  // GPS week 2268, Thursday.
  EXPECT_EQ(log.epochs[0].time.nanoseconds,
            (2268LL * 604800 + 4 * 86400 + 11 * 3600 + 12 * 60 + 42) * kSecond + 94'000'000);
  ASSERT_EQ(log.epochs[0].signals.size(), 3U);
  const gnss::Signal& g8 = log.epochs[0].signals[0];
  EXPECT_EQ(to_string(g8.satellite), "G08");
  EXPECT_EQ(g8.code, (std::array<char, 2>{'1', 'C'}));
  EXPECT_DOUBLE_EQ(*g8.pseudorange, 18689403.653);
  EXPECT_DOUBLE_EQ(*g8.carrier, 98213476.439);
  EXPECT_DOUBLE_EQ(*g8.doppler, -249.408);
  EXPECT_DOUBLE_EQ(*g8.cn0, 47);
  EXPECT_FALSE(g8.lost_lock);
  const gnss::Signal& g10 = log.epochs[0].signals[1];
  EXPECT_TRUE(g10.lost_lock);
  EXPECT_FALSE(g10.half_cycle);
  const gnss::Signal& r1 = log.epochs[0].signals[2];
  EXPECT_EQ(r1.satellite.system, System::glonass);
  EXPECT_TRUE(r1.pseudorange);
  EXPECT_FALSE(r1.carrier);
  EXPECT_TRUE(log.remarks.empty());
}

TEST(RinexObservations, TurnsOtherTimeSystemsIntoGps) {
  const auto gps = parsed(obs_header() + epoch_line(42, 1) + kG8);
  const auto beidou = parsed(obs_header("3.04", "BDT") + epoch_line(42, 1) + kG8);
  const auto glonass = parsed(obs_header("3.04", "GLO") + epoch_line(42, 1) + kG8);
  EXPECT_EQ(beidou.epochs[0].time.nanoseconds - gps.epochs[0].time.nanoseconds, 14 * kSecond);
  EXPECT_EQ(glonass.epochs[0].time.nanoseconds - gps.epochs[0].time.nanoseconds, 18 * kSecond);
  EXPECT_THAT(refused(obs_header("3.04", "XYZ") + epoch_line(42, 1) + kG8), HasSubstr("time system \"XYZ\""));
}

TEST(RinexObservations, ALeapSecondIsASecond) {
  std::string text = obs_header("3.04", "GLO");
  for (const char* stamp : {"2016 12 31 23 59 59.0000000", "2016 12 31 23 59 60.0000000",
                            "2017  1  1  0  0  0.0000000", "2017  1  1  0  0  1.0000000"}) {
    text += std::string("> ") + stamp + "  0  1\n" + kG8;
  }
  const auto log = parsed(text);
  ASSERT_EQ(log.epochs.size(), 4U);
  EXPECT_TRUE(log.remarks.empty());
  for (int i = 0; i < 4; ++i) {
    const std::int64_t midnight = time_of_date(2017, 1, 1, 0, 0, 0)->nanoseconds;
    EXPECT_EQ(log.epochs[static_cast<std::size_t>(i)].time.nanoseconds, midnight + (16 + i) * kSecond) << i;
  }
}

TEST(RinexObservations, NamesAndSurvivesRepeatedAndBackwardEpochs) {
  const auto log = parsed(obs_header() + epoch_line(42, 1) + kG8 + epoch_line(42, 1) + kG10 +
                          epoch_line(41, 1) + kG10 + epoch_line(43, 1) + kG8);
  EXPECT_EQ(log.epochs.size(), 2U);
  ASSERT_EQ(log.remarks.size(), 2U);
  EXPECT_THAT(log.remarks[0], HasSubstr("a.obs: line 8: the time of the epoch before once more"));
  EXPECT_THAT(log.remarks[1], HasSubstr("a.obs: line 10: earlier than the epoch before"));
}

TEST(RinexObservations, LeavesOutWhatIsCutOff) {
  const std::string whole = obs_header() + epoch_line(42, 2) + kG8 + kG10;
  const auto log = parsed(whole + epoch_line(43, 2) + kG8);
  EXPECT_EQ(log.epochs.size(), 1U);
  ASSERT_EQ(log.remarks.size(), 1U);
  EXPECT_THAT(log.remarks[0], HasSubstr("line 9: found 1 of 2 satellites"));
  // Cut anywhere: an error or fewer epochs, never a crash.
  const std::string text = whole + epoch_line(43, 2) + kG8 + kG10;
  for (std::size_t length = 0; length < text.size(); length += 7) {
    gnss::RawLog cut;
    const Status status = parse_rinex_observations(text.substr(0, length), "cut", cut);
    EXPECT_LE(cut.epochs.size(), 2U) << status.error().message;
  }
}

/// RINEX 3.02 calls BeiDou's B1I 1I, the others 2I; 1X is B1C from 3.04 on.
TEST(RinexObservations, BeidousFirstSignalHasOneName) {
  const auto name = [](const std::string& version, const std::string& code) {
    std::string text = obs_header(version) + epoch_line(42, 1) + "C08  38689403.653\n";
    text.replace(text.find("R    2 C1C L1C"), 14, "C    1 C" + code + "    ");
    const auto log = parsed(text);
    const auto& found = log.epochs.at(0).signals.at(0).code;
    return std::string(found.begin(), found.end());
  };
  EXPECT_EQ(name("3.02", "1I"), "2I");
  EXPECT_EQ(name("3.02", "1Q"), "2Q");
  EXPECT_EQ(name("3.02", "1X"), "2X");
  EXPECT_EQ(name("3.04", "1I"), "2I");
  EXPECT_EQ(name("3.04", "1X"), "1X");
  EXPECT_EQ(name("3.04", "1P"), "1P");
  EXPECT_EQ(name("3.03", "2I"), "2I");
}

/// A receiver that does not know the date yet may stamp its first epochs years ahead.
TEST(RinexObservations, EpochsOfTheFutureDoNotCostTheRest) {
  std::string future = "> 2031  6 29 11 12 41.0000000  0  1\n" + kG8;
  std::string good;
  for (int i = 0; i < 6; ++i) good += epoch_line(42 + i, 1) + kG8;
  const auto first = parsed(obs_header() + future + good);
  EXPECT_EQ(first.epochs.size(), 6U);
  ASSERT_EQ(first.remarks.size(), 1U);
  EXPECT_THAT(first.remarks[0], HasSubstr("a.obs: line 6: later than the epochs behind it, left out"));
  const auto amid = parsed(obs_header() + epoch_line(41, 1) + kG8 + future + good);
  EXPECT_EQ(amid.epochs.size(), 7U);
  // Two hundred that lie behind a hundred are the majority, five behind ten are not.
  const auto blocks = [&](int later, int earlier) {
    std::string text = obs_header();
    for (int i = 0; i < later; ++i) text += epoch_line(30 + 0.1 * i, 1) + kG8;
    for (int i = 0; i < earlier; ++i) text += epoch_line(1 + 0.1 * i, 1) + kG8;
    return parsed(text).epochs.size();
  };
  EXPECT_EQ(blocks(100, 200), 200U);
  EXPECT_EQ(blocks(10, 5), 10U);
}

TEST(RinexObservations, SaysWhichVersionItFound) {
  EXPECT_THAT(refused(obs_header("2.11") + epoch_line(42, 1) + kG8),
              HasSubstr("a.obs: line 1: found RINEX version \"2.11\", expected 3.00 to 3.05"));
  EXPECT_THAT(refused("# no RINEX\n"), HasSubstr("expected RINEX VERSION / TYPE"));
  EXPECT_THAT(refused(obs_header()), HasSubstr("found no usable epoch"));
  // A second file of another version behind the first.
  const auto mixed =
      parsed(obs_header() + epoch_line(42, 1) + kG8 + obs_header("2.11") + epoch_line(43, 1) + kG8);
  EXPECT_EQ(mixed.epochs.size(), 1U);
  ASSERT_EQ(mixed.remarks.size(), 1U);
  EXPECT_THAT(mixed.remarks[0], HasSubstr("line 8: found RINEX version \"2.11\""));
  // One of the same goes on.
  EXPECT_EQ(parsed(obs_header() + epoch_line(42, 1) + kG8 + obs_header("3.04") + epoch_line(43, 1) + kG8)
                .epochs.size(),
            2U);
}

TEST(RinexObservations, PassesOverEventsAndForeignSystemsAndBadLines) {
  const auto log = parsed(obs_header() + epoch_line(41, 1, 4) + header_line("moved", "COMMENT") +
                          epoch_line(42, 3) + kG8 + "S20  38000000.000\n" + "Gxx  18689403.653\n" +
                          "> 2023 13 29 11 12 42.0000000  0  1\n" + kG10 + epoch_line(43, 1, 1) + kG10);
  ASSERT_EQ(log.epochs.size(), 2U);
  EXPECT_EQ(log.epochs[0].signals.size(), 1U);
  EXPECT_TRUE(log.epochs[1].signals[0].lost_lock);  // a power failure
  ASSERT_EQ(log.remarks.size(), 2U);
  EXPECT_THAT(log.remarks[0], HasSubstr("2023 13 29"));
  EXPECT_THAT(log.remarks[1], HasSubstr("\"Gxx\""));
}

std::string nav_header(const std::string& version = "3.03") {
  return header_line("     " + version + "           N: GNSS NAV DATA    M: Mixed", "RINEX VERSION / TYPE") +
         header_line("GPSA   1.4901E-08  2.2352E-08 -1.1921E-07 -1.1921E-07", "IONOSPHERIC CORR") +
         header_line("GPSB   1.1469E+05  1.6384E+05 -6.5536E+04 -4.5875E+05", "IONOSPHERIC CORR") +
         header_line("", "END OF HEADER");
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%19.12E", value);
  return text;
}

/// A record of a satellite whose date is 2023-06-29 11:00, or another.
std::string record(const std::string& satellite, double toe, double health = 0, double source = 517,
                   const std::string& date = "2023 06 29 11 00 00") {
  const std::vector<double> v{-4e-4,  4e-13, 0,      2,    -167,    2.5e-9, 1.09,  -7.8e-6, 1.9e-4,  5e-6,
                              5440.6, toe,   2.2e-8, 1.7,  -1.7e-7, 0.999,  253,   0.86,    -5.5e-9, -3.8e-10,
                              source, 2268,  0,      3.12, health,  -3e-9,  -4e-9, 385939,  0};
  std::string text = satellite + " " + date;
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (i >= 3 && (i - 3) % 4 == 0) text += "\n    ";
    text += number(v[i]);
  }
  return text + "\n";
}

std::string glonass_record(const std::string& date, double x = 10541.1572266) {
  return "R18 " + date + number(8.9e-5) + number(1.8e-12) + number(385890) + "\n    " + number(x) +
         number(0.321145) + number(2.79e-9) + number(0) + "\n    " + number(363.17) + number(3.1672) +
         number(-1.86e-9) + number(-3) + "\n    " + number(23234.11) + number(-0.191) + number(-9.3e-10) +
         number(0) + "\n";
}

gnss::RawLog parsed_navigation(const std::string& text) {
  gnss::RawLog log;
  const Status status = parse_rinex_navigation(text, "a.nav", log);
  EXPECT_TRUE(status) << status.error().message;
  return log;
}

Time at(int year, int month, int day, int hour, double second = 0) {
  return *time_of_date(year, month, day, hour, 0, second);
}

TEST(RinexNavigation, GivesOrbitsInGpsTime) {
  const auto log = parsed_navigation(nav_header() + record("E12", 385200) + record("C30", 385200) +
                                     record("G08", 385200, 63) + glonass_record("2023 06 29 11 15 00"));
  ASSERT_EQ(log.broadcast.kepler.size(), 3U);
  ASSERT_EQ(log.broadcast.glonass.size(), 1U);
  ASSERT_TRUE(log.broadcast.ionosphere);
  EXPECT_DOUBLE_EQ(log.broadcast.ionosphere->alpha[2], -1.1921e-7);
  EXPECT_DOUBLE_EQ(log.broadcast.ionosphere->beta[3], -4.5875e5);
  const auto& e12 = log.broadcast.kepler[0];
  EXPECT_EQ(e12.toe, at(2023, 6, 29, 11));
  EXPECT_DOUBLE_EQ(e12.sqrt_a, 5440.6);
  EXPECT_DOUBLE_EQ(e12.omega_dot, -5.5e-9);
  EXPECT_DOUBLE_EQ(e12.group_delay, -4e-9);  // I/NAV: of E5b and E1
  EXPECT_FALSE(e12.second_choice);
  EXPECT_EQ(log.broadcast.kepler[1].toe.nanoseconds, at(2023, 6, 29, 11).nanoseconds + 14 * kSecond);
  EXPECT_DOUBLE_EQ(log.broadcast.kepler[1].group_delay, -3e-9);
  EXPECT_EQ(log.broadcast.kepler[2].health, 63);
  const auto& r18 = log.broadcast.glonass[0];
  EXPECT_EQ(r18.toe.nanoseconds, at(2023, 6, 29, 11).nanoseconds + (900 + 18) * kSecond);
  EXPECT_DOUBLE_EQ(r18.position.y(), 363170);
  EXPECT_EQ(r18.channel, -3);
}

TEST(RinexNavigation, GalileosFNavHasItsOwnDelay) {
  const auto log = parsed_navigation(nav_header() + record("E12", 385200, 0, 258));
  EXPECT_TRUE(log.broadcast.kepler[0].second_choice);
  EXPECT_DOUBLE_EQ(log.broadcast.kepler[0].group_delay, -3e-9);
}

/// Blanks at the end of a line are no part of it: many programs cut them off, and the next line goes on in
/// its own columns.
TEST(RinexNavigation, ColumnsThatAreCutOffShiftNothing) {
  const auto cut = [](const std::string& whole, std::size_t line, std::size_t values) {
    std::size_t from = 0;
    for (std::size_t i = 0; i < line; ++i) from = whole.find('\n', from) + 1;
    const std::size_t end = whole.find('\n', from);
    const std::size_t width = 4 + 19 * values;
    return whole.substr(0, std::min(from + width, end)) + whole.substr(end);
  };
  // Galileo's spare behind its week, GPS's flag of L2 and then its issue of the clock, BeiDou's line of the
  // accuracy.
  const std::string galileo = cut(record("E12", 385200), 5, 3);
  const std::string gps = cut(cut(record("G08", 385200), 5, 3), 6, 3);
  const std::string beidou = cut(record("C30", 385200), 5, 1);
  const auto log = parsed_navigation(nav_header() + galileo + gps + beidou);
  EXPECT_TRUE(log.remarks.empty());
  ASSERT_EQ(log.broadcast.kepler.size(), 3U);
  EXPECT_DOUBLE_EQ(log.broadcast.kepler[0].group_delay, -4e-9);
  EXPECT_DOUBLE_EQ(log.broadcast.kepler[1].group_delay, -3e-9);
  EXPECT_DOUBLE_EQ(log.broadcast.kepler[2].group_delay, -3e-9);
  for (const auto& e : log.broadcast.kepler) EXPECT_DOUBLE_EQ(e.accuracy, 3.12) << to_string(e.satellite);
  // GLONASS does not need the age of its message.
  const auto glonass = parsed_navigation(nav_header() + cut(glonass_record("2023 06 29 11 15 00"), 3, 3));
  EXPECT_EQ(glonass.broadcast.glonass.size(), 1U);
  // A delay that is needed and missing is not taken to be zero, nor one that no satellite has to be right.
  gnss::RawLog none;
  EXPECT_FALSE(
      parse_rinex_navigation(nav_header() + cut(record("E12", 385200), 6, 3).substr(0, 540), "a", none));
  std::string wild = record("E12", 385200);
  wild.replace(wild.find("-4.000000000000E-09"), 19, " 3.859390000000E+05");
  const Status status = parse_rinex_navigation(nav_header() + wild, "a", none);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("a group delay of 385939 s"));
}

/// Galileo's -1 and an accuracy of many kilometres promise nothing; 0 alone is what was not said.
TEST(RinexNavigation, ASatelliteThatPromisesNothingIsNotTheBest) {
  const auto accuracy = [](const std::string& value) {
    std::string text = record("E12", 385200);
    text.replace(text.find(" 3.120000000000E+00"), 19, value);
    return parsed_navigation(nav_header() + text).broadcast.kepler.at(0).accuracy;
  };
  EXPECT_DOUBLE_EQ(accuracy("-1.000000000000E+00"), 8192);
  EXPECT_DOUBLE_EQ(accuracy(" 3.276800000000E+04"), 8192);
  EXPECT_DOUBLE_EQ(accuracy(" 0.000000000000E+00"), 0);
}

TEST(RinexNavigation, KnowsLeapSecondsAndTheEndOfTheWeek) {
  const auto before = parsed_navigation(nav_header() + glonass_record("2016 12 31 23 45 00"));
  const auto after = parsed_navigation(nav_header() + glonass_record("2017 01 01 00 15 00"));
  EXPECT_EQ(before.broadcast.glonass[0].toe.nanoseconds,
            at(2016, 12, 31, 23).nanoseconds + (2700 + 17) * kSecond);
  EXPECT_EQ(after.broadcast.glonass[0].toe.nanoseconds, at(2017, 1, 1, 0).nanoseconds + (900 + 18) * kSecond);
  EXPECT_EQ(leap_seconds(at(1980, 1, 6, 0)), 0);
  EXPECT_EQ(leap_seconds(at(2000, 1, 1, 0)), 13);
  // Clock of Saturday 23:59:44, orbit of Sunday 0:00: of the next week.
  const auto rollover = parsed_navigation(nav_header() + record("G08", 0, 0, 1, "2023 07 01 23 59 44"));
  EXPECT_EQ(rollover.broadcast.kepler[0].toe, at(2023, 7, 2, 0));
  EXPECT_EQ(seconds_between(rollover.broadcast.kepler[0].toc, rollover.broadcast.kepler[0].toe), 16);
}

TEST(RinexNavigation, LeavesOutRecordsThatNoOrbitHas) {
  std::string cut = record("E12", 385200);
  cut.resize(300);
  std::string bad_number = record("E13", 385200);
  bad_number.replace(bad_number.find("5.440600000000E+03"), 8, "5.44x600");
  const auto log =
      parsed_navigation(nav_header() + cut + "\n" + record("E11", 385200) + record("E14", 7e5) + bad_number +
                        record("J02", 385200) + glonass_record("2023 06 29 11 15 00", 5e4));
  ASSERT_EQ(log.broadcast.kepler.size(), 1U);
  EXPECT_EQ(to_string(log.broadcast.kepler[0].satellite), "E11");
  EXPECT_TRUE(log.broadcast.glonass.empty());
  ASSERT_EQ(log.remarks.size(), 1U);
  EXPECT_THAT(log.remarks[0], HasSubstr("a.nav: line 5"));
  EXPECT_THAT(log.remarks[0], HasSubstr("expected 27; the ephemeris is left out, and 3 more of the kind"));
  gnss::RawLog none;
  const Status status = parse_rinex_navigation(nav_header() + record("E14", 7e5), "a.nav", none);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("toe = 700000, expected 0 to 604800"));
  const Status old = parse_rinex_navigation(nav_header("2.10"), "a.nav", none);
  ASSERT_FALSE(old);
  EXPECT_THAT(old.error().message, HasSubstr("found RINEX version \"2.10\""));
}

TEST(KnownRanges, AreReadWithTheTruth) {
  gnss::RawLog log;
  const std::string good = "pseudorange3 0 19949087.6 25 14567933.9 2809850.9 21875628.0 12 1 85.1 49\n";
  const std::string text = "odom3 0 5.85 0 0 0 0 -0.006 0.0025 0.0009 0.0009 4e-06 4e-06 4e-06\n" + good +
                           "pseudorange3 0 19713469.0 64 18145814.9 11532054.1 13684003.6 320 4 58.1 40\n" +
                           good + "pseudorange3 0.2 1971x 64 1 1 1 320 4 58.1 40\n" +
                           "point3 0 3785108.1 899901.4 5037234.4 0 0 0 0 0 0 0 0 0\n";
  const Status status = parse_known_ranges(text, "a.txt", log);
  ASSERT_TRUE(status) << status.error().message;
  ASSERT_EQ(log.known_ranges.size(), 1U);
  ASSERT_EQ(log.known_ranges[0].ranges.size(), 2U);
  EXPECT_EQ(to_string(log.known_ranges[0].ranges[1].satellite), "R20");
  EXPECT_DOUBLE_EQ(log.known_ranges[0].ranges[0].sigma, 5);
  EXPECT_DOUBLE_EQ(*log.known_ranges[0].ranges[0].cn0, 49);
  EXPECT_EQ(log.truth.size(), 1U);
  ASSERT_EQ(log.remarks.size(), 1U);
  EXPECT_THAT(log.remarks[0], HasSubstr("a.txt: line 4"));
  ASSERT_EQ(log.odometry.size(), 1U);
  EXPECT_DOUBLE_EQ(log.odometry[0].speed, 5.85);
  EXPECT_DOUBLE_EQ(log.odometry[0].yaw_rate, -0.006);
  EXPECT_DOUBLE_EQ(log.odometry[0].speed_sigma, 0.05);
  EXPECT_DOUBLE_EQ(log.odometry[0].yaw_rate_sigma, 0.002);
  gnss::RawLog none;
  EXPECT_FALSE(parse_known_ranges("odom3 0 1 2 3\n", "a.txt", none));
}

TEST(KnownRanges, OdometryThatNoCarHasIsNamedAndLeftOut) {
  const std::string tail = " 0.0025 0.0009 0.0009 4e-06 4e-06 4e-06\n";
  std::string text;
  for (int i = 0; i < 6; ++i) text += "odom3 " + std::to_string(i) + " 5 0 0 0 0 0.1" + tail;
  for (const char* bad : {"odom3 5 5 0 0 0 0 0.1", "odom3 4 5 0 0 0 0 0.1", "odom3 7 nan 0 0 0 0 0.1",
                          "odom3 7 5000 0 0 0 0 0.1", "odom3 7 5 0 0 0 0 1e9"}) {
    gnss::RawLog log;
    ASSERT_TRUE(parse_known_ranges(text + bad + tail, "a.txt", log)) << bad;
    EXPECT_EQ(log.odometry.size(), 6U) << bad;
    ASSERT_EQ(log.remarks.size(), 1U) << bad;
    EXPECT_THAT(log.remarks[0], HasSubstr("a.txt: line 7"));
    EXPECT_THAT(log.remarks[0], HasSubstr("expected odom3, time, velocity x y z"));
  }
  gnss::RawLog log;
  ASSERT_TRUE(parse_known_ranges(text + "odom3 7 5 0 0 0 0 0.1 0 1 1 1 1 1\n", "a.txt", log));
  EXPECT_EQ(log.odometry.size(), 6U) << "a variance of zero";
}

TEST(RawGnssFolder, FindsItsFilesByTheirFirstLines) {
  const test::TemporaryFolder folder;
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder / name) << text;
  };
  auto none = read_raw_gnss(folder.path());
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("found no raw GNSS"));
  EXPECT_FALSE(read_raw_gnss(folder / "absent"));
  write("log.23O", obs_header() + epoch_line(42, 1) + kG8);
  none = read_raw_gnss(folder.path());
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("no RINEX 3 navigation file"));
  write("any.name", nav_header() + record("G08", 385200));
  write("notes.txt", "nothing\n");
  EXPECT_TRUE(read_raw_gnss(folder.path()));
  write("other.obs", obs_header() + epoch_line(43, 1) + kG8);
  none = read_raw_gnss(folder.path());
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("2 observation files"));
  const auto one = read_raw_gnss(folder / "other.obs");
  ASSERT_TRUE(one);
  EXPECT_EQ(one->epochs.size(), 1U);
  EXPECT_EQ(one->broadcast.kepler.size(), 1U);
  EXPECT_FALSE(read_raw_gnss(folder / "any.name"));
}

/// What one navigation file lacks another beside it may have.
TEST(RawGnssFolder, OneNavigationFileThatGivesNothingIsNoFault) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "a.obs") << obs_header() + epoch_line(42, 1) + kG8;
  std::ofstream(folder / "a.nav") << nav_header() + record("G08", 385200);
  std::ofstream(folder / "b.nav") << nav_header() + record("J02", 385200);
  std::ofstream(folder / "c.nav") << nav_header();
  std::ofstream(folder / "d.nav") << nav_header("2.11") + record("G08", 385200);
  const auto log = read_raw_gnss(folder.path());
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_EQ(log->broadcast.kepler.size(), 1U);
  ASSERT_EQ(log->remarks.size(), 3U);
  EXPECT_THAT(log->remarks[0], HasSubstr("b.nav: no ephemeris of GPS, GLONASS, Galileo or BeiDou in it"));
  EXPECT_THAT(log->remarks[1], HasSubstr("c.nav: no ephemeris"));
  EXPECT_THAT(log->remarks[2], HasSubstr("found RINEX version \"2.11\""));
  EXPECT_THAT(log->remarks[2], HasSubstr("left out"));
  std::filesystem::remove(folder / "a.nav");
  const auto none = read_raw_gnss(folder.path());
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("observations but no ephemeris"));
  EXPECT_THAT(none.error().message, HasSubstr("found RINEX version \"2.11\""));
}

TEST(RawGnssFolder, SaysThatTheIonosphereIsNotKnown) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "a.obs") << obs_header() + epoch_line(42, 1) + kG8;
  std::string nav = nav_header() + record("G08", 385200);
  for (const char* label : {"GPSA", "GPSB"}) nav.replace(nav.find(label), 4, "GAL ");
  std::ofstream(folder / "a.nav") << nav;
  const auto log = read_raw_gnss(folder.path());
  ASSERT_TRUE(log) << log.error().message;
  ASSERT_EQ(log->remarks.size(), 1U);
  EXPECT_THAT(log->remarks[0], HasSubstr("ionosphere"));
}

}  // namespace
}  // namespace pade::io
