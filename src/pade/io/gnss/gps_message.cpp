#include "pade/io/gnss/gps_message.hpp"

#include <algorithm>
#include <cmath>

#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/io/gnss/rinex_text.hpp"

namespace pade::io {
namespace {

constexpr double kSemicircle = 3.1415926535898;  // the interface's own π

/// Bits of a subframe, 24 for each word, read in their order.
class Bits {
 public:
  Bits(const GpsMessage::Words& words, std::size_t from) : words_(words), at_(from) {}

  std::uint32_t whole(std::size_t width) {
    std::uint32_t value = 0;
    for (; width > 0; --width, ++at_) {
      value = value << 1U | (words_.data.at(at_ / 24) >> (23 - at_ % 24) & 1U);
    }
    return value;
  }
  /// Two's complement, times a power of two.
  double scaled(std::size_t width, int exponent) {
    const std::uint32_t value = whole(width);
    const double negative = value >> (width - 1) != 0 ? std::ldexp(1, static_cast<int>(width)) : 0;
    return std::ldexp(static_cast<double>(value) - negative, exponent);
  }
  double positive(std::size_t width, int exponent) { return std::ldexp(whole(width), exponent); }
  void skip(std::size_t width) { at_ += width; }

 private:
  const GpsMessage::Words& words_;
  std::size_t at_;
};

constexpr std::size_t kData = 48;  // behind telemetry and handover words

/// The middle of the range that an index of accuracy stands for, m; 15 promises nothing.
double accuracy_of(std::uint32_t index) {
  const auto i = static_cast<double>(index);
  if (index >= 15) return 8192;
  return index <= 6 ? std::pow(2, 1 + i / 2) : std::pow(2, i - 2);
}

/// Clock, health; the issue.
std::uint32_t read_clock(const GpsMessage::Words& words, Time near, gnss::KeplerEphemeris& e) {
  Bits bits(words, kData);
  bits.skip(12);
  e.accuracy = accuracy_of(bits.whole(4));
  e.health = static_cast<int>(bits.whole(6));
  bits.skip(2 + 1 + 87);
  e.group_delay = bits.scaled(8, -31);
  const std::uint32_t issue = bits.whole(8);
  e.toc = rinex::nearest_week(bits.positive(16, 4), near);
  e.af2 = bits.scaled(8, -55);
  e.af1 = bits.scaled(16, -43);
  e.af0 = bits.scaled(22, -31);
  return issue;
}

std::uint32_t read_orbit(const GpsMessage::Words& words, Time near, gnss::KeplerEphemeris& e) {
  Bits bits(words, kData);
  const std::uint32_t issue = bits.whole(8);
  e.crs = bits.scaled(16, -5);
  e.delta_n = kSemicircle * bits.scaled(16, -43);
  e.m0 = kSemicircle * bits.scaled(32, -31);
  e.cuc = bits.scaled(16, -29);
  e.eccentricity = bits.positive(32, -33);
  e.cus = bits.scaled(16, -29);
  e.sqrt_a = bits.positive(32, -19);
  e.toe_of_week = bits.positive(16, 4);
  e.toe = rinex::nearest_week(e.toe_of_week, near);
  return issue;
}

std::uint32_t read_plane(const GpsMessage::Words& words, gnss::KeplerEphemeris& e) {
  Bits bits(words, kData);
  e.cic = bits.scaled(16, -29);
  e.omega0 = kSemicircle * bits.scaled(32, -31);
  e.cis = bits.scaled(16, -29);
  e.i0 = kSemicircle * bits.scaled(32, -31);
  e.crc = bits.scaled(16, -5);
  e.omega = kSemicircle * bits.scaled(32, -31);
  e.omega_dot = kSemicircle * bits.scaled(24, -43);
  const std::uint32_t issue = bits.whole(8);
  e.idot = kSemicircle * bits.scaled(14, -43);
  return issue;
}

/// Page 18 of subframe 4 has Klobuchar's numbers.
void read_ionosphere_page(const GpsMessage::Words& words, gnss::BroadcastData& broadcast) {
  Bits bits(words, kData + 2);
  if (bits.whole(6) != 56) return;
  gnss::IonosphereModel model;
  constexpr std::array<int, 4> kAlpha{-30, -27, -24, -24};
  constexpr std::array<int, 4> kBeta{11, 14, 16, 16};
  for (std::size_t i = 0; i < 4; ++i) model.alpha.at(i) = bits.scaled(8, kAlpha.at(i));
  for (std::size_t i = 0; i < 4; ++i) model.beta.at(i) = bits.scaled(8, kBeta.at(i));
  broadcast.ionosphere = model;
}

}  // namespace

void GpsMessage::add(const Words& subframe, Time near, gnss::BroadcastData& broadcast) {
  constexpr std::uint32_t kPreamble = 0x8B;
  const std::uint32_t number = Bits(subframe, 43).whole(3);
  if (Bits(subframe, 0).whole(8) != kPreamble || number < 1 || number > 4) return;
  if (number == 4) {
    read_ionosphere_page(subframe, broadcast);
    return;
  }
  auto& parts = gathered_[subframe.satellite];
  parts.at(number - 1) = subframe;
  if (!parts[0] || !parts[1] || !parts[2]) return;
  gnss::KeplerEphemeris e;
  e.satellite = subframe.satellite;
  const std::uint32_t issue = read_clock(*parts[0], near, e);
  if (read_orbit(*parts[1], near, e) != issue || read_plane(*parts[2], e) != issue) return;
  if (!rinex::defect_of(e).empty()) return;
  const auto same = [&](const gnss::KeplerEphemeris& k) {
    return k.satellite == e.satellite && k.toe == e.toe && k.m0 == e.m0 && k.health == e.health;
  };
  if (std::none_of(broadcast.kepler.begin(), broadcast.kepler.end(), same)) broadcast.kepler.push_back(e);
}

}  // namespace pade::io
