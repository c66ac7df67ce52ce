// Recordings of ground stations: a real one, whole and damaged, and ones put together here.
#include "pade/live/recordings/tlog.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/live/mavlink/codec.hpp"
#include "pade/live/mavlink/estimate_messages.hpp"
#include "pade/live/mavlink/link_messages.hpp"

#include "support/temporary_folder.hpp"

namespace pade::live {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

using Bytes = std::vector<std::uint8_t>;

const fs::path kVtol = fs::path(PADE_SOURCE_DIR) / "../shared/data/recordings/vtol.tlog";

/// The bytes of each packet, by place in the file.
std::map<std::size_t, Bytes> packets_of(const Bytes& bytes, mavlink::LinkCounts& counts) {
  std::map<std::size_t, Bytes> packets;
  counts = for_each_packet(bytes, [&](const TlogPacket& packet) {
    packets[packet.position] = {packet.frame.bytes.begin(), packet.frame.bytes.end()};
  });
  return packets;
}

class VtolRecording : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kVtol)) GTEST_SKIP() << "the recording is not there: " << kVtol;
    auto read = read_tlog(kVtol);
    ASSERT_TRUE(read) << read.error().message;
    bytes_ = std::move(*read);
  }
  Bytes bytes_;
};

TEST_F(VtolRecording, HasAllItsPackets) {
  const TlogSummary summary = summarise(bytes_);
  EXPECT_EQ(summary.counts.packets, 23894U);
  EXPECT_EQ(summary.counts.bad, 0U);
  EXPECT_EQ(summary.counts.unknown, 0U);
  EXPECT_EQ(summary.counts.gaps, 22U);
  EXPECT_EQ(summary.version, 1);
  ASSERT_TRUE(summary.autopilot);
  EXPECT_EQ(name_of(*summary.autopilot), "ArduPilot");
  EXPECT_NEAR(seconds_between(summary.first, summary.last), 208, 1);
  std::size_t total = 0;
  for (const MessageCount& message : summary.messages) total += message.count;
  EXPECT_EQ(total, 23894U);
  const auto attitude = std::find_if(summary.messages.begin(), summary.messages.end(),
                                     [](const MessageCount& m) { return m.name == "ATTITUDE"; });
  ASSERT_NE(attitude, summary.messages.end());
  EXPECT_EQ(attitude->count, 888U);
}

TEST_F(VtolRecording, TheParserOfALinkFindsTheSamePackets) {
  mavlink::LinkCounts counts;
  const auto packets = packets_of(bytes_, counts);
  // Stamps of arrival between the packets are noise to it.
  mavlink::Parser parser;
  std::size_t same = 0;
  std::size_t others = 0;
  parser.add(bytes_, [&](const mavlink::Frame& frame) {
    const auto found = packets.find(parser.position());
    const bool equal = found != packets.end() && std::equal(found->second.begin(), found->second.end(),
                                                            frame.bytes.begin(), frame.bytes.end());
    ++(equal ? same : others);
  });
  EXPECT_EQ(same, 23894U);
  EXPECT_EQ(others, 0U);
}

/// Packets accepted out of damaged bytes, and how many of them are none of the original.
struct Damage {
  std::size_t accepted = 0;
  std::size_t false_ones = 0;
};

TEST_F(VtolRecording, DamagedBytesGiveNoFalsePackets) {
  mavlink::LinkCounts counts;
  const auto packets = packets_of(bytes_, counts);
  Damage file, link;
  const auto judge = [&](Damage& damage, std::size_t position, const mavlink::Frame& frame) {
    ++damage.accepted;
    const auto found = packets.find(position);
    const bool equal = found != packets.end() && std::equal(found->second.begin(), found->second.end(),
                                                            frame.bytes.begin(), frame.bytes.end());
    damage.false_ones += equal ? 0 : 1;
  };
  constexpr int kRounds = 10;
  std::size_t whole = 0;
  for (unsigned seed = 1; seed <= kRounds; ++seed) {
    std::mt19937 random(seed);
    Bytes damaged = bytes_;
    for (std::uint8_t& byte : damaged) {
      if (random() % 100 == 0) byte = static_cast<std::uint8_t>(byte ^ (1 + random() % 255));
    }
    for (const auto& [position, packet] : packets) {
      const auto first = damaged.begin() + static_cast<std::ptrdiff_t>(position);
      whole += std::equal(packet.begin(), packet.end(), first) ? 1U : 0U;
    }
    for_each_packet(damaged, [&](const TlogPacket& p) { judge(file, p.position, p.frame); });
    mavlink::Parser parser;
    parser.add(damaged, [&](const mavlink::Frame& frame) { judge(link, parser.position(), frame); });
  }
  for (const Damage& damage : {file, link}) {
    RecordProperty("accepted", static_cast<int>(damage.accepted));
    RecordProperty("false", static_cast<int>(damage.false_ones));
    EXPECT_GT(damage.accepted, 100'000U);
    EXPECT_LE(damage.false_ones * 100'000, 5 * damage.accepted);
    // Hardly any whole packet is lost behind a damaged one.
    EXPECT_GE(static_cast<double>(damage.accepted), 0.999 * static_cast<double>(whole));
  }
}

TEST_F(VtolRecording, SaysThatItsImuIsTooSlow) {
  const auto log = read_tlog_sensors(kVtol);
  ASSERT_FALSE(log);
  EXPECT_THAT(log.error().message, HasSubstr("the IMU is missing at a usable rate: found 79"));
  EXPECT_THAT(log.error().message, HasSubstr("MAV_CMD_SET_MESSAGE_INTERVAL"));
}

/// A recording in the making.
class Recording {
 public:
  template <class Message>
  void add(const Message& message, mavlink::Sender& sender) {
    const mavlink::Packet packet = pack(message, sender);
    const std::uint64_t arrival = 1'700'000'000'000'000U + 1000 * bytes_.size();
    for (int shift = 56; shift >= 0; shift -= 8)
      bytes_.push_back(static_cast<std::uint8_t>(arrival >> shift));
    const auto span = packet.span();
    bytes_.insert(bytes_.end(), span.begin(), span.end());
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }
  Bytes& bytes() { return bytes_; }

 private:
  Bytes bytes_;
};

TEST(Tlog, WhoFliesIsWhoSendsMostHeartbeatsOfAnAutopilot) {
  Recording recording;
  mavlink::Sender station{255, 190, 0}, other{2, 1, 0}, autopilot{7, 1, 0};
  for (int i = 0; i < 9; ++i) {
    for (int k = 0; k < 3; ++k) recording.add(mavlink::Heartbeat{6, 8, 0, 0, 4, 3}, station);
    recording.add(mavlink::Heartbeat{2, 12, 0, 0, 4, 3}, autopilot);
  }
  recording.add(mavlink::Heartbeat{2, 3, 0, 0, 4, 3}, other);
  const TlogSummary summary = summarise(recording.bytes());
  ASSERT_TRUE(summary.autopilot);
  EXPECT_EQ(summary.autopilot->system, 7);
  EXPECT_EQ(name_of(*summary.autopilot), "PX4");
  EXPECT_EQ(summary.version, 2);
}

TEST(Tlog, AMessageThatNobodyKnowsIsPassedOver) {
  Recording recording;
  mavlink::Sender sender;
  recording.add(mavlink::Heartbeat{}, sender);
  const std::size_t second = recording.bytes().size();
  recording.add(mavlink::Heartbeat{}, sender);
  recording.bytes()[second + 8 + 9] = 0x77;  // of its number
  recording.add(mavlink::Heartbeat{}, sender);
  const TlogSummary summary = summarise(recording.bytes());
  EXPECT_EQ(summary.counts.packets, 2U);
  EXPECT_EQ(summary.counts.unknown, 1U);
  EXPECT_EQ(summary.counts.bad, 0U);
  EXPECT_EQ(summary.counts.gaps, 0U);
}

TEST(Tlog, APacketCutOffAtTheEndIsBadAndTheRestWhole) {
  Recording recording;
  mavlink::Sender sender;
  for (int i = 0; i < 3; ++i) recording.add(mavlink::Attitude{1, 2, 3, 4, 5, 6, 7}, sender);
  recording.bytes().resize(recording.bytes().size() - 1);
  const TlogSummary summary = summarise(recording.bytes());
  EXPECT_EQ(summary.counts.packets, 2U);
  EXPECT_EQ(summary.counts.bad, 1U);
}

TEST(Tlog, WhatIsNoneIsRefused) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "notes.tlog";
  std::ofstream(file) << "no packets in here, not one";
  const auto none = read_tlog(file);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("found no packet of MAVLink in its 27 bytes"));
  const auto missing = read_tlog(folder.path() / "absent.tlog");
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("absent.tlog"));
  Recording recording;
  mavlink::Sender station{255, 190, 0};
  recording.add(mavlink::Heartbeat{6, 8, 0, 0, 4, 3}, station);
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(recording.bytes().data()),
             static_cast<std::streamsize>(recording.bytes().size()));
  const auto nobody = read_tlog_sensors(file);
  ASSERT_FALSE(nobody);
  EXPECT_THAT(nobody.error().message, HasSubstr("the autopilot is missing"));
}

}  // namespace
}  // namespace pade::live
