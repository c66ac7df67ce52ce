// Any text is either refused or gives raw GNSS that can be played: no state, position or residual that is
// used is other than finite. One target for each reader: PADE_READER is its name, set by the build.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/navigation/gnss/raw_run.hpp"

#include "expect.hpp"

namespace {

using pade::gnss::RawLog;

void play(const RawLog& log) {
  for (const auto& epoch : pade::gnss::run_raw(log, {}).epochs) {
    for (const auto& view : epoch.satellites) {
      if (view.use == pade::gnss::Use::used) PADE_EXPECT(std::isfinite(view.range_residual));
    }
    PADE_EXPECT(!epoch.position || epoch.position->position.allFinite());
    PADE_EXPECT(!epoch.velocity || epoch.velocity->velocity.allFinite());
    PADE_EXPECT(!epoch.step || epoch.step->step.allFinite());
  }
}

/// An epoch that sees every satellite of the messages at the time of the first.
void see_all(RawLog& log) {
  pade::gnss::Epoch epoch;
  const auto add = [&](const auto& ephemeris) {
    if (epoch.signals.empty()) epoch.time = ephemeris.toe;
    pade::gnss::Signal signal;
    signal.satellite = ephemeris.satellite;
    signal.code = {ephemeris.satellite.system == pade::gnss::System::beidou ? '2' : '1', 'C'};
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

void observations(std::string_view text) {
  RawLog log;
  if (!pade::io::parse_rinex_observations(text, "obs", log)) return;
  PADE_EXPECT(!log.epochs.empty());
  for (std::size_t i = 1; i < log.epochs.size(); ++i)
    PADE_EXPECT(log.epochs[i - 1].time < log.epochs[i].time);
  play(log);
}

void navigation(std::string_view text) {
  RawLog log;
  if (!pade::io::parse_rinex_navigation(text, "nav", log)) return;
  see_all(log);
  play(log);
}

/// The bytes as messages with the right marks and checksums, which no fuzzer gets past by chance: a kind, two
/// bytes of length, and the payload, again and again.
std::string framed(std::string_view text) {
  std::string stream;
  while (text.size() >= 3) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const std::size_t length = std::min<std::size_t>(byte(1) + 256U * (byte(2) % 8U), text.size() - 3);
    std::string body = {'\x02', byte(0) % 2 == 0 ? '\x15' : '\x13'};  // RXM-RAWX, RXM-SFRBX
    body += static_cast<char>(length & 255U);
    body += static_cast<char>(length >> 8U);
    body += text.substr(3, length);
    unsigned char a = 0, b = 0;
    for (const char c : body) {
      a = static_cast<unsigned char>(a + static_cast<unsigned char>(c));
      b = static_cast<unsigned char>(b + a);
    }
    stream += "\xb5\x62";
    stream += body;
    stream += static_cast<char>(a);
    stream += static_cast<char>(b);
    text.remove_prefix(3 + length);
  }
  return stream;
}

void ubx(std::string_view text) {
  for (const std::string& bytes : {std::string(text), framed(text)}) {
    RawLog log;
    if (pade::io::parse_ubx(bytes, "ubx", log)) play(log);
  }
}

void known_ranges(std::string_view text) {
  RawLog log;
  if (pade::io::parse_known_ranges(text, "ranges", log)) play(log);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  PADE_READER(std::string_view(reinterpret_cast<const char*>(data), size));
  return 0;
}
