// u-blox's binary messages: RXM-RAWX (measurements) and RXM-SFRBX (what GPS satellites send, LNAV).
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "pade/io/gnss/epoch_order.hpp"
#include "pade/io/gnss/gps_message.hpp"
#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/io/gnss/rinex_text.hpp"

namespace pade::io {
namespace {

constexpr std::size_t kFrame = 8;         // bytes of a message beside its payload
constexpr std::size_t kRawxHeader = 16;   // bytes before the measurements
constexpr std::size_t kMeasurement = 32;  // bytes of each
constexpr std::int64_t kWeekOfNanoseconds = 604800 * rinex::kNanoseconds;

/// Little-endian fields of a payload; the caller has checked its length.
class Payload {
 public:
  explicit Payload(std::string_view bytes) : bytes_(bytes) {}
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] std::uint64_t whole(std::size_t at, std::size_t width) const {
    std::uint64_t value = 0;
    for (std::size_t i = width; i-- > 0;) value = value << 8U | static_cast<unsigned char>(bytes_[at + i]);
    return value;
  }
  [[nodiscard]] unsigned byte(std::size_t at) const { return static_cast<unsigned char>(bytes_[at]); }
  [[nodiscard]] double real8(std::size_t at) const { return std::bit_cast<double>(whole(at, 8)); }
  [[nodiscard]] double real4(std::size_t at) const {
    return std::bit_cast<float>(static_cast<std::uint32_t>(whole(at, 4)));
  }

 private:
  std::string_view bytes_;
};

std::optional<gnss::SatelliteId> satellite_of(unsigned system, unsigned number) {
  if (number < 1 || number > 63) return std::nullopt;
  const auto id = static_cast<std::uint8_t>(number);
  switch (system) {
    case 0:
      return gnss::SatelliteId{gnss::System::gps, id};
    case 2:
      return gnss::SatelliteId{gnss::System::galileo, id};
    case 3:
      return gnss::SatelliteId{gnss::System::beidou, id};
    case 6:
      return gnss::SatelliteId{gnss::System::glonass, id};
    default:
      return std::nullopt;
  }
}

/// RINEX's name of a signal; '?' for one that is not known.
std::array<char, 2> code_of(gnss::System system, unsigned signal) {
  using Names = std::array<std::array<char, 2>, 9>;
  constexpr std::array<char, 2> kNone{'?', '?'};
  static constexpr std::array<Names, gnss::kSystems> kNames{{
      {{{'1', 'C'}, kNone, kNone, {'2', 'L'}, {'2', 'S'}, kNone, {'5', 'I'}, {'5', 'Q'}, kNone}},
      {{{'1', 'C'}, kNone, {'2', 'C'}, kNone, kNone, kNone, kNone, kNone, kNone}},
      {{{'1', 'C'}, {'1', 'B'}, kNone, {'5', 'I'}, {'5', 'Q'}, {'7', 'I'}, {'7', 'Q'}, kNone, kNone}},
      {{{'2', 'I'},
        {'2', 'I'},
        {'7', 'I'},
        {'7', 'I'},
        kNone,
        {'1', 'P'},
        {'1', 'D'},
        {'5', 'P'},
        {'5', 'D'}}},
  }};
  const Names& names = kNames.at(static_cast<std::size_t>(system));
  return signal < names.size() ? names.at(signal) : kNone;
}

/// How long a signal has been followed at an epoch.
struct Lock {
  unsigned milliseconds = 0;  ///< the field ends at 64500
  Time time;
};

/// Whether the signal was lost between two epochs: it is followed for a shorter time than before, or than has
/// gone by.
bool is_lost(const Lock& before, const Lock& now) {
  constexpr double kMost = 64500;
  constexpr double kExact = 0.99;  // of the time, to which the field is taken to be right
  const double gone = 1e3 * seconds_between(before.time, now.time);
  return now.milliseconds < before.milliseconds || now.milliseconds < kExact * std::min(gone, kMost);
}

/// What a GPS satellite sent, and where in the log it stands.
struct Subframe {
  std::size_t place = 0;
  GpsMessage::Words words;
};

/// Reads the messages of a log in their order.
class Log {
 public:
  Log(std::string_view name, gnss::RawLog& log) : name_(name), log_(log), order_(name, "byte", log) {}

  void read(std::string_view bytes) {
    std::size_t at = bytes.find("\xB5\x62");
    while (at != std::string_view::npos) {
      at = bytes.find("\xB5\x62", at + read_message(bytes, at));
    }
    damaged_.report(log_.remarks);
    misread_.report(log_.remarks);
    order_.finish();
    decode_subframes();
    if (foreign_messages_ > 0) {
      log_.remarks.push_back(
          fmt::format("{}: {} navigation messages of Galileo, BeiDou and GLONASS are not decoded; a RINEX "
                      "navigation file beside it gives them",
                      name_, foreign_messages_));
    }
  }

 private:
  /// By how many bytes to go on: the message, or two if it is none.
  std::size_t read_message(std::string_view bytes, std::size_t at) {
    if (bytes.size() - at < kFrame) return 2;
    const Payload head(bytes.substr(at, 6));
    const std::size_t length = head.whole(4, 2);
    if (bytes.size() - at < length + kFrame) {
      if (head.byte(2) == 2)
        damaged_.add(fmt::format("{}: the message at byte {} is cut off or damaged, left out", name_, at));
      return 2;
    }
    unsigned a = 0, b = 0;
    for (std::size_t i = at + 2; i < at + 6 + length; ++i) {
      a = (a + static_cast<unsigned char>(bytes[i])) & 0xFFU;
      b = (b + a) & 0xFFU;
    }
    const Payload check(bytes.substr(at + 6 + length, 2));
    if (check.byte(0) != a || check.byte(1) != b) {
      damaged_.add(fmt::format(
          "{}: the message at byte {} has the checksum {:02x}{:02x}, expected {:02x}{:02x}; it is left out",
          name_, at, check.byte(0), check.byte(1), a, b));
      return 2;
    }
    const Payload payload(bytes.substr(at + 6, length));
    if (head.byte(2) == 0x02 && head.byte(3) == 0x15) read_measurements(payload, at);
    if (head.byte(2) == 0x02 && head.byte(3) == 0x13) read_subframe(payload, at);
    return length + kFrame;
  }

  void read_measurements(const Payload& p, std::size_t at) {
    const std::size_t count = p.size() >= kRawxHeader ? p.byte(11) : 0;
    const double of_week = p.size() >= kRawxHeader ? p.real8(0) : -1;
    const std::size_t week = p.size() >= kRawxHeader ? p.whole(8, 2) : 0;
    constexpr std::size_t kLastWeek = 7000;  // of the year 2114
    if (p.size() < kRawxHeader + count * kMeasurement || !(of_week >= 0 && of_week < 604801) ||
        week > kLastWeek) {
      misread_.add(fmt::format(
          "{}: RXM-RAWX at byte {} has {} bytes, week {} and time of week {}, expected {} bytes and a time "
          "before 2115; it is left out",
          name_, at, p.size(), week, of_week, kRawxHeader + count * kMeasurement));
      return;
    }
    gnss::Epoch epoch;
    epoch.time.nanoseconds = static_cast<std::int64_t>(week) * kWeekOfNanoseconds +
                             static_cast<std::int64_t>(std::llround(of_week * 1e9));
    for (std::size_t i = 0; i < count; ++i) add_signal(p, kRawxHeader + i * kMeasurement, epoch);
    order_.add(std::move(epoch), at);
  }

  void add_signal(const Payload& p, std::size_t at, gnss::Epoch& epoch) {
    const auto satellite = satellite_of(p.byte(at + 20), p.byte(at + 21));
    if (!satellite) return;
    gnss::Signal signal;
    signal.satellite = *satellite;
    signal.code = code_of(satellite->system, p.byte(at + 22));
    const auto same = [&](const auto& s) { return s.satellite == *satellite && s.code == signal.code; };
    if (signal.code[0] == '?' || std::any_of(epoch.signals.begin(), epoch.signals.end(), same)) return;
    const unsigned tracked = p.byte(at + 30);
    const double range = p.real8(at), phase = p.real8(at + 8), doppler = p.real4(at + 16);
    if ((tracked & 1U) != 0 && std::isfinite(range)) signal.pseudorange = range;
    if ((tracked & 2U) != 0 && std::isfinite(phase) && phase != 0) signal.carrier = phase;
    if (std::isfinite(doppler)) signal.doppler = doppler;
    signal.cn0 = p.byte(at + 26);
    signal.half_cycle = (tracked & 4U) == 0;
    const auto locked = static_cast<unsigned>(p.whole(at + 24, 2));
    auto [before, first] = locked_.try_emplace({*satellite, signal.code}, Lock{locked, epoch.time});
    signal.lost_lock = locked == 0 || (!first && is_lost(before->second, {locked, epoch.time}));
    before->second = {locked, epoch.time};
    epoch.signals.push_back(signal);
  }

  void read_subframe(const Payload& p, std::size_t at) {
    if (p.size() < 8) return;
    const std::size_t words = p.byte(4);
    const auto satellite = satellite_of(p.byte(0), p.byte(1));
    if (!satellite || p.size() < 8 + 4 * words) return;
    if (satellite->system != gnss::System::gps) {
      ++foreign_messages_;
      return;
    }
    if (words != 10 || p.byte(2) != 0) return;  // of L2C
    GpsMessage::Words subframe{*satellite, {}};
    for (std::size_t i = 0; i < 10; ++i) {
      subframe.data.at(i) = static_cast<std::uint32_t>(p.whole(8 + 4 * i, 4) >> 6U) & 0xFFFFFFU;
    }
    subframes_.push_back({at, subframe});
  }

  /// Once it is known which epochs stay: they say which week it is.
  void decode_subframes() {
    const std::vector<std::size_t>& places = order_.places();
    if (places.empty()) return;
    const std::size_t first = log_.epochs.size() - places.size();
    std::size_t next = 1;
    for (const Subframe& subframe : subframes_) {
      while (next < places.size() && places[next] < subframe.place) ++next;
      message_.add(subframe.words, log_.epochs[first + next - 1].time, log_.broadcast);
    }
  }

  std::string_view name_;
  gnss::RawLog& log_;
  GpsMessage message_;
  std::vector<Subframe> subframes_;
  std::map<std::pair<gnss::SatelliteId, std::array<char, 2>>, Lock> locked_;
  EpochOrder order_;
  rinex::Tally damaged_, misread_;
  std::size_t foreign_messages_ = 0;
};

}  // namespace

Status parse_ubx(std::string_view bytes, std::string_view name, gnss::RawLog& log) {
  const std::size_t before = log.epochs.size();
  Log(name, log).read(bytes);
  if (log.epochs.size() > before) return {};
  return Error{fmt::format("{}: found no usable RXM-RAWX message{}", name,
                           log.remarks.empty() ? "" : "; " + log.remarks.back())};
}

}  // namespace pade::io
