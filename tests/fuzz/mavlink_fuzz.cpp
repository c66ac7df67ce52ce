// Any bytes as a stream of MAVLink and as a ground station's recording: packets are found whichever way the
// bytes come in pieces, and whatever is in them becomes finite measurements or none.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "pade/live/autopilot_sensors.hpp"
#include "pade/live/link/autopilot_poses.hpp"
#include "pade/live/mavlink/checksum.hpp"
#include "pade/live/mavlink/known_messages.hpp"
#include "pade/live/mavlink/parser.hpp"
#include "pade/live/recordings/tlog.hpp"

#include "expect.hpp"

namespace {

using pade::live::mavlink::Frame;
using pade::live::mavlink::Parser;
using Bytes = std::span<const std::uint8_t>;

/// The bytes as packets with right checksums, which no fuzzer gets past by chance, behind stamps as a ground
/// station writes them: a step of time, the number of a message, a length and the payload, again and again.
std::vector<std::uint8_t> framed(Bytes bytes) {
  using namespace pade::live::mavlink;  // NOLINT
  std::vector<std::uint8_t> stream;
  std::uint64_t stamp = 1'700'000'000'000'000;
  std::uint8_t sequence = 0;
  while (bytes.size() >= 4) {
    const std::uint32_t id = bytes[1] + 256U * (bytes[2] % 2U);
    const std::size_t length = std::min<std::size_t>(bytes[3], bytes.size() - 4);
    stamp += 1000U * bytes[0];
    const KnownMessage* const known = known_message(id);
    if (known != nullptr && length > 0) {
      for (unsigned shift = 64; shift > 0; shift -= 8)
        stream.push_back(static_cast<std::uint8_t>(stamp >> (shift - 8) & 0xffU));
      const std::size_t header = stream.size();
      stream.insert(stream.end(),
                    {kStart2, static_cast<std::uint8_t>(length), 0, 0, sequence++, 1, 1,
                     static_cast<std::uint8_t>(id & 0xffU), static_cast<std::uint8_t>(id >> 8U), 0});
      stream.insert(stream.end(), bytes.begin() + 4, bytes.begin() + 4 + static_cast<std::ptrdiff_t>(length));
      Checksum checksum;
      for (std::size_t i = header + 1; i < stream.size(); ++i) checksum.add(stream[i]);
      checksum.add(known->crc_extra);
      stream.push_back(static_cast<std::uint8_t>(checksum.value() & 0xffU));
      stream.push_back(static_cast<std::uint8_t>(checksum.value() >> 8U));
    }
    bytes = bytes.subspan(4 + length);
  }
  return stream;
}

/// All packets, with the bytes coming in pieces of some size.
std::vector<std::vector<std::uint8_t>> packets(Bytes bytes, std::size_t piece) {
  std::vector<std::vector<std::uint8_t>> found;
  Parser parser;
  for (std::size_t i = 0; i < bytes.size(); i += piece) {
    parser.add(bytes.subspan(i, std::min(piece, bytes.size() - i)),
               [&](const Frame& frame) { found.emplace_back(frame.bytes.begin(), frame.bytes.end()); });
  }
  PADE_EXPECT(parser.counts().packets == found.size());
  PADE_EXPECT(parser.counts().skipped_bytes <= bytes.size());
  return found;
}

void check_log(const pade::NavigationLog& log) {
  for (const auto& sample : log.imu) {
    PADE_EXPECT(sample.angular_rate.allFinite() && sample.specific_force.allFinite());
  }
  for (const auto& fix : log.gnss.fixes) PADE_EXPECT(fix.position.allFinite() && fix.covariance.allFinite());
  for (const auto& velocity : log.gnss.velocities) PADE_EXPECT(velocity.velocity.allFinite());
  for (const auto& sample : log.barometer) PADE_EXPECT(std::isfinite(sample.height));
  for (const auto& sample : log.magnetometer) PADE_EXPECT(sample.field.allFinite());
}

void read(Bytes bytes) {
  const auto whole = packets(bytes, std::max<std::size_t>(bytes.size(), 1));
  PADE_EXPECT(packets(bytes, 1) == whole);
  PADE_EXPECT(packets(bytes, 37) == whole);

  const pade::live::TlogSummary summary = pade::live::summarise(bytes);
  pade::live::SensorGatherer sensors(summary.autopilot.value_or(pade::live::Autopilot{1, 1, 3, 2}),
                                     summary.clock);
  pade::live::AutopilotPoses estimate(pade::live::PoseMessages::estimate);
  pade::live::AutopilotPoses odometry(pade::live::PoseMessages::odometry);
  pade::live::for_each_packet(bytes, [&](const pade::live::TlogPacket& packet) {
    PADE_EXPECT(packet.position + packet.frame.bytes.size() <= bytes.size());
    sensors.add(packet.frame);
    for (auto* const poses : {&estimate, &odometry}) {
      poses->add(packet.frame);
      const auto answer = poses->at(poses->newest());
      const bool valid = answer.kind == pade::live::PoseAnswer::Kind::valid;
      if (valid) PADE_EXPECT(answer.T_world_body.is_finite());
    }
  });
  if (const auto log = sensors.log("input")) check_log(*log);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  read({data, size});
  read(framed({data, size}));
  return 0;
}
