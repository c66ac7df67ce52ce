// UBX, written by an encoder of the test's own.
#include <cmath>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/gnss/raw_gnss_files.hpp"

namespace pade::io {
namespace {

using testing::HasSubstr;

template <class T>
void append(std::string& bytes, T value) {
  std::array<char, sizeof value> raw{};
  std::memcpy(raw.data(), &value, sizeof value);
  bytes.append(raw.data(), raw.size());
}

std::string ubx_message(char id, const std::string& payload) {
  std::string body{'\x02', id};
  append(body, static_cast<std::uint16_t>(payload.size()));
  body += payload;
  std::uint8_t a = 0, b = 0;
  for (const char c : body) {
    a = static_cast<std::uint8_t>(a + static_cast<std::uint8_t>(c));
    b = static_cast<std::uint8_t>(b + a);
  }
  return "\xB5\x62" + body + static_cast<char>(a) + static_cast<char>(b);
}

struct Measured {
  std::uint8_t system, number, signal;
  std::uint16_t lock;
  std::uint8_t tracked;
};

std::string rawx(double of_week, const std::vector<Measured>& all, std::uint16_t week = 2268) {
  std::string p;
  append(p, of_week);
  append(p, week);
  append(p, std::int8_t{18});
  append(p, static_cast<std::uint8_t>(all.size()));
  append(p, std::uint32_t{0x0101});
  for (const Measured& m : all) {
    append(p, 2.1e7 + m.number);
    append(p, 1.1e8 + m.number);
    append(p, -1234.5F);
    for (const unsigned byte : {m.system + 0U, m.number + 0U, m.signal + 0U, 7U})
      append(p, static_cast<std::uint8_t>(byte));
    append(p, m.lock);
    append(p, std::uint8_t{44});
    append(p, std::uint16_t{0});
    append(p, std::uint8_t{0});
    append(p, m.tracked);
    append(p, std::uint8_t{0});
  }
  return ubx_message('\x15', p);
}

/// Bits of a subframe, from the left.
class SubframeWriter {
 public:
  explicit SubframeWriter(unsigned number) {
    put(0x8B, 8);
    put(0, 35);
    put(number, 3);
    put(0, 2);
  }
  void put(std::uint32_t value, unsigned width) {
    for (unsigned i = width; i-- > 0;) bits_.push_back((value >> i & 1U) != 0);
  }
  void scaled(double value, unsigned width, int exponent) {
    put(static_cast<std::uint32_t>(std::llround(std::ldexp(value, -exponent))), width);
  }
  [[nodiscard]] std::string message(std::uint8_t system, std::uint8_t number) const {
    std::string p;
    for (const unsigned byte : {system + 0U, number + 0U, 0U, 0U, 10U, 0U, 2U, 0U})
      append(p, static_cast<std::uint8_t>(byte));
    for (std::size_t word = 0; word < 10; ++word) {
      std::uint32_t value = 0;
      for (std::size_t i = 0; i < 24; ++i) {
        const std::size_t at = 24 * word + i;
        value = value << 1U | (at < bits_.size() && bits_[at] ? 1U : 0U);
      }
      append(p, value << 6U | 0x2AU);  // some parity
    }
    return ubx_message('\x13', p);
  }

 private:
  std::vector<bool> bits_;
};

constexpr double kHalfTurn = 3.1415926535898;

std::string subframes(std::uint8_t number, std::uint32_t issue, double m0) {
  SubframeWriter one(1), two(2), three(3), four(4);
  one.put(220, 10), one.put(1, 2), one.put(1, 4), one.put(0, 6), one.put(0, 2 + 1 + 31), one.put(0, 32),
      one.put(0, 24);
  one.scaled(-1.1e-8, 8, -31), one.put(issue, 8), one.scaled(388800, 16, 4);
  one.scaled(0, 8, -55), one.scaled(-4.7e-12, 16, -43), one.scaled(2.27e-4, 22, -31);
  two.put(issue, 8), two.scaled(34.375, 16, -5), two.scaled(4.17e-9 / kHalfTurn, 16, -43),
      two.scaled(m0 / kHalfTurn, 32, -31);
  two.scaled(2e-6, 16, -29), two.scaled(0.0121, 32, -33), two.scaled(1e-6, 16, -29),
      two.scaled(5153.65, 32, -19);
  two.scaled(388800, 16, 4);
  three.scaled(1.15e-7, 16, -29), three.scaled(-1.5 / kHalfTurn, 32, -31), three.scaled(2.6e-7, 16, -29);
  three.scaled(0.989 / kHalfTurn, 32, -31), three.scaled(374.28, 16, -5),
      three.scaled(0.937 / kHalfTurn, 32, -31);
  three.scaled(-8.2e-9 / kHalfTurn, 24, -43), three.put(issue, 8),
      three.scaled(9.75e-11 / kHalfTurn, 14, -43);
  four.put(1, 2), four.put(56, 6);
  four.scaled(1.4901e-8, 8, -30), four.scaled(2.2352e-8, 8, -27), four.scaled(-1.1921e-7, 8, -24),
      four.scaled(-1.1921e-7, 8, -24);
  four.scaled(114690, 8, 11), four.scaled(163840, 8, 14), four.scaled(-65536, 8, 16),
      four.scaled(-458750, 8, 16);
  return one.message(0, number) + two.message(0, number) + three.message(0, number) + four.message(0, number);
}

TEST(Ubx, GivesEachSignalItsValues) {
  gnss::RawLog log;
  const std::string text =
      rawx(385962.094,
           {{0, 8, 0, 900, 7}, {0, 8, 3, 900, 7}, {6, 255, 0, 9, 7}, {2, 12, 1, 64500, 3}, {3, 30, 0, 0, 1}});
  ASSERT_TRUE(parse_ubx("$GNGGA,,*00\r\n" + text + "noise", "a.ubx", log));
  ASSERT_EQ(log.epochs.size(), 1U);
  EXPECT_EQ(log.epochs[0].time.nanoseconds, (2268LL * 604800 + 385962) * 1'000'000'000 + 94'000'000);
  const auto& signals = log.epochs[0].signals;
  ASSERT_EQ(signals.size(), 4U);  // the GLONASS satellite's number is unknown
  EXPECT_EQ(to_string(signals[0].satellite), "G08");
  EXPECT_DOUBLE_EQ(*signals[0].pseudorange, 2.1e7 + 8);
  EXPECT_DOUBLE_EQ(*signals[0].carrier, 1.1e8 + 8);
  EXPECT_DOUBLE_EQ(*signals[0].doppler, -1234.5);
  EXPECT_DOUBLE_EQ(*signals[0].cn0, 44);
  EXPECT_EQ(signals[1].code, (std::array<char, 2>{'2', 'L'}));
  EXPECT_EQ(to_string(signals[2].satellite), "E12");
  EXPECT_TRUE(signals[2].half_cycle);
  EXPECT_FALSE(signals[2].lost_lock);
  EXPECT_EQ(to_string(signals[3].satellite), "C30");
  EXPECT_FALSE(signals[3].carrier);
}

TEST(Ubx, AShorterLockTimeIsALoss) {
  gnss::RawLog log;
  ASSERT_TRUE(parse_ubx(
      rawx(1, {{0, 8, 0, 900, 7}}) + rawx(2, {{0, 8, 0, 1900, 7}}) + rawx(3, {{0, 8, 0, 400, 7}}), "a", log));
  EXPECT_FALSE(log.epochs[1].signals[0].lost_lock);
  EXPECT_TRUE(log.epochs[2].signals[0].lost_lock);
}

/// Lost and found again between two epochs: the lock is younger than the epoch before.
TEST(Ubx, ALockTimeYoungerThanTheEpochBeforeIsALoss) {
  gnss::RawLog log;
  ASSERT_TRUE(parse_ubx(
      rawx(1, {{0, 8, 0, 400, 7}, {0, 9, 0, 64500, 7}}) + rawx(2, {{0, 8, 0, 700, 7}, {0, 9, 0, 64500, 7}}) +
          rawx(3, {{0, 8, 0, 1700, 7}, {0, 9, 0, 64500, 7}}) + rawx(4, {{0, 9, 0, 64500, 7}}) +
          rawx(5, {{0, 8, 0, 1800, 7}, {0, 9, 0, 64500, 7}}),
      "a", log));
  EXPECT_TRUE(log.epochs[1].signals[0].lost_lock);
  EXPECT_FALSE(log.epochs[2].signals[0].lost_lock);
  EXPECT_TRUE(log.epochs[4].signals[0].lost_lock);
  for (const gnss::Epoch& epoch : log.epochs) EXPECT_FALSE(epoch.signals.back().lost_lock);
}

/// A capture of a serial line begins with NMEA, or amid a message.
TEST(Ubx, IsKnownWhateverStandsBeforeItsFirstMessage) {
  const std::string epoch = rawx(385962, {{0, 8, 0, 900, 7}});
  EXPECT_EQ(raw_gnss_kind(epoch), RawGnssKind::ubx);
  EXPECT_EQ(raw_gnss_kind("$GNGGA,,*00\r\n" + epoch), RawGnssKind::ubx);
  EXPECT_EQ(raw_gnss_kind(epoch.substr(10) + epoch), RawGnssKind::ubx);
  EXPECT_EQ(raw_gnss_kind(std::string(60000, 'x') + epoch), RawGnssKind::ubx);
  std::string damaged = epoch;
  damaged[40] = static_cast<char>(damaged[40] ^ 1);
  EXPECT_FALSE(raw_gnss_kind("$GNGGA,,*00\r\n" + damaged));
  EXPECT_FALSE(raw_gnss_kind("$GNGGA,,*00\r\n"));
  // A recording of another kind that has such messages in it is not one of this kind.
  for (const char* magic : {"#ROSBAG V2.0\n", "\x89MCAP0\r\n", "ULog\x01\x12\x35", "SQLite format 3"}) {
    EXPECT_FALSE(raw_gnss_kind(magic + epoch)) << magic;
  }
}

/// Subframes are of the week of the epochs that stay.
TEST(Ubx, AnEpochOfTheFutureCostsNeitherTheRestNorTheEphemerides) {
  const std::vector<Measured> one{{0, 8, 0, 900, 7}};
  std::string good;
  for (int i = 0; i < 6; ++i) good += rawx(385962 + i, one);
  gnss::RawLog log;
  ASSERT_TRUE(parse_ubx(rawx(100, one, 2700) + subframes(8, 31, -0.95) + good, "a.ubx", log));
  EXPECT_EQ(log.epochs.size(), 6U);
  ASSERT_EQ(log.broadcast.kepler.size(), 1U);
  EXPECT_EQ(log.broadcast.kepler[0].toe.nanoseconds, (2268LL * 604800 + 388800) * 1'000'000'000);
  ASSERT_EQ(log.remarks.size(), 1U);
  EXPECT_THAT(log.remarks[0], HasSubstr("a.ubx: byte 0: later than the epochs behind it, left out"));
}

/// A checksum says nothing of the sense: found by fuzzing, where a time did not fit into its nanoseconds.
TEST(Ubx, AWeekThatIsNotOfThisCenturyIsNamedAndLeftOut) {
  gnss::RawLog log;
  const std::vector<Measured> one{{0, 8, 0, 900, 7}};
  ASSERT_TRUE(parse_ubx(rawx(1, one) + rawx(2, one, 59'669) + rawx(3, one, 65'535) + rawx(4, one, 7000),
                        "a.ubx", log));
  ASSERT_EQ(log.epochs.size(), 2U);
  EXPECT_GT(log.epochs[1].time, log.epochs[0].time);
  ASSERT_FALSE(log.remarks.empty());
  EXPECT_THAT(log.remarks[0], HasSubstr("week 59669"));
  EXPECT_THAT(log.remarks[0], HasSubstr("before 2115"));
}

TEST(Ubx, ABrokenChecksumIsNamedAndSurvived) {
  std::string broken = rawx(2, {{0, 8, 0, 900, 7}});
  broken[40] = static_cast<char>(broken[40] ^ 1);
  gnss::RawLog log;
  const std::string whole = rawx(1, {{0, 8, 0, 900, 7}});
  ASSERT_TRUE(
      parse_ubx(whole + broken + rawx(3, {{0, 8, 0, 900, 7}}) + rawx(3, {{0, 9, 0, 1, 7}}), "a.ubx", log));
  EXPECT_EQ(log.epochs.size(), 2U);
  ASSERT_EQ(log.remarks.size(), 2U);
  EXPECT_THAT(log.remarks[0], HasSubstr("a.ubx: the message at byte 56 has the checksum"));
  EXPECT_THAT(log.remarks[1], HasSubstr("the time of the epoch before once more"));
  gnss::RawLog none;
  const Status status = parse_ubx(broken, "a.ubx", none);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message,
              HasSubstr("found no usable RXM-RAWX message; a.ubx: the message at byte 0"));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    gnss::RawLog cut;
    EXPECT_FALSE(parse_ubx(whole.substr(0, length), "cut", cut));
  }
}

TEST(Ubx, GathersSubframesOfOneIssue) {
  for (const bool before : {true, false}) {  // the week is known before or after them
    gnss::RawLog log;
    const std::string epoch = rawx(385962, {{0, 8, 0, 900, 7}});
    const std::string frames = subframes(8, 31, -0.95);
    ASSERT_TRUE(parse_ubx(before ? epoch + frames + frames : frames + epoch, "a", log));
    ASSERT_EQ(log.broadcast.kepler.size(), 1U);
    const gnss::KeplerEphemeris& e = log.broadcast.kepler[0];
    EXPECT_EQ(e.toe.nanoseconds, (2268LL * 604800 + 388800) * 1'000'000'000);
    EXPECT_EQ(e.toc, e.toe);
    EXPECT_NEAR(e.af0, 2.27e-4, 1e-9);
    EXPECT_NEAR(e.af1, -4.7e-12, 1e-13);
    EXPECT_NEAR(e.group_delay, -1.1e-8, 5e-10);
    EXPECT_DOUBLE_EQ(e.accuracy, std::pow(2, 1.5));
    EXPECT_NEAR(e.sqrt_a, 5153.65, 1e-5);
    EXPECT_NEAR(e.eccentricity, 0.0121, 1e-9);
    EXPECT_NEAR(e.m0, -0.95, 1e-8);
    EXPECT_NEAR(e.omega0, -1.5, 1e-8);
    EXPECT_NEAR(e.i0, 0.989, 1e-8);
    EXPECT_NEAR(e.omega_dot, -8.2e-9, 1e-12);
    EXPECT_NEAR(e.idot, 9.75e-11, 1e-12);
    EXPECT_NEAR(e.crs, 34.375, 1e-9);
    EXPECT_NEAR(e.crc, 374.28, 0.02);
    ASSERT_TRUE(log.broadcast.ionosphere);
    EXPECT_NEAR(log.broadcast.ionosphere->alpha[2], -1.1921e-7, 1e-9);
    EXPECT_NEAR(log.broadcast.ionosphere->beta[3], -458750, 1e3);
  }
  // Parts of different issues do not mix.
  gnss::RawLog log;
  const std::string old = subframes(8, 31, -0.95);
  const std::string next = subframes(8, 32, -0.9);
  const std::size_t one = SubframeWriter(1).message(0, 8).size();
  ASSERT_TRUE(
      parse_ubx(rawx(385962, {{0, 8, 0, 900, 7}}) + old.substr(0, 2 * one) + next.substr(2 * one), "a", log));
  EXPECT_TRUE(log.broadcast.kepler.empty());
  ASSERT_TRUE(parse_ubx(rawx(385963, {{0, 8, 0, 900, 7}}) + SubframeWriter(1).message(2, 8), "a", log));
  EXPECT_THAT(log.remarks.back(),
              HasSubstr("1 navigation messages of Galileo, BeiDou and GLONASS are not decoded"));
}

}  // namespace
}  // namespace pade::io
