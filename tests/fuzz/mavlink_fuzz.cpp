// Any bytes as a stream of MAVLink and as a ground station's recording: packets are found whichever way the
// bytes come in pieces, and whatever is in them becomes finite measurements or none.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "pade/live/autopilot_sensors.hpp"
#include "pade/live/link/autopilot_poses.hpp"
#include "pade/live/mavlink/parser.hpp"
#include "pade/live/recordings/tlog.hpp"

#include "expect.hpp"

namespace {

using pade::live::mavlink::Frame;
using pade::live::mavlink::Parser;
using Bytes = std::span<const std::uint8_t>;

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

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, size);
  const auto whole = packets(bytes, std::max<std::size_t>(size, 1));
  PADE_EXPECT(packets(bytes, 1) == whole);
  PADE_EXPECT(packets(bytes, 37) == whole);

  const pade::live::TlogSummary summary = pade::live::summarise(bytes);
  pade::live::SensorGatherer sensors(summary.autopilot.value_or(pade::live::Autopilot{1, 1, 3, 2}),
                                     summary.clock);
  pade::live::AutopilotPoses estimate(pade::live::PoseMessages::estimate);
  pade::live::AutopilotPoses odometry(pade::live::PoseMessages::odometry);
  pade::live::for_each_packet(bytes, [&](const pade::live::TlogPacket& packet) {
    PADE_EXPECT(packet.position + packet.frame.bytes.size() <= size);
    sensors.add(packet.frame);
    for (auto* const poses : {&estimate, &odometry}) {
      poses->add(packet.frame);
      const auto answer = poses->at(poses->newest());
      const bool valid = answer.kind == pade::live::PoseAnswer::Kind::valid;
      if (valid) PADE_EXPECT(answer.T_world_body.is_finite());
    }
  });
  if (const auto log = sensors.log("input")) check_log(*log);
  return 0;
}
