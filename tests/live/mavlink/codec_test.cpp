// Layout and checksum against the published numbers, packets against bytes put together by hand.
#include "pade/live/mavlink/codec.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "pade/live/mavlink/known_messages.hpp"
#include "pade/live/mavlink/parser.hpp"

#include "live/mavlink/all_messages.hpp"

namespace pade::live::mavlink {
namespace {

template <class Message>
constexpr bool is(std::uint32_t id, std::size_t base, std::size_t extension, std::uint8_t crc_extra) {
  constexpr MessageLayout layout = layout_of<Message>();
  return Message::kId == id && layout.base_length == base && layout.length == base + extension &&
         layout.crc_extra == crc_extra;
}

// Number, payload, extension and CRC_EXTRA as the generated headers of MAVLink have them.
static_assert(is<Heartbeat>(0, 9, 0, 50));
static_assert(is<SystemTime>(2, 12, 0, 137));
static_assert(is<GpsRawInt>(24, 30, 22, 24));
static_assert(is<ScaledImu>(26, 22, 2, 170));
static_assert(is<RawImu>(27, 26, 3, 144));
static_assert(is<ScaledPressure>(29, 14, 2, 115));
static_assert(is<Attitude>(30, 28, 0, 39));
static_assert(is<AttitudeQuaternion>(31, 32, 16, 246));
static_assert(is<LocalPositionNed>(32, 28, 0, 185));
static_assert(is<GlobalPositionInt>(33, 28, 0, 104));
static_assert(is<GpsGlobalOrigin>(49, 12, 8, 39));
static_assert(is<CommandLong>(76, 33, 0, 152));
static_assert(is<CommandAck>(77, 3, 7, 143));
static_assert(is<HighresImu>(105, 62, 1, 93));
static_assert(is<Timesync>(111, 16, 2, 34));
static_assert(is<CameraTrigger>(112, 12, 0, 174));
static_assert(is<StatusText>(253, 51, 3, 83));
static_assert(is<CameraImageCaptured>(263, 255, 0, 133));
static_assert(is<ObstacleDistance>(330, 158, 9, 23));
static_assert(is<Odometry>(331, 230, 3, 91));
static_assert(is<OnboardComputerStatus>(390, 238, 2, 156));
static_assert(is<ObstacleDistance3d>(11037, 28, 0, 130));

/// Fills the bytes of all fields at random.
struct Scramble {
  std::mt19937& random;
  template <class T>
  void operator()(std::string_view /*name*/, T& value, Extension /*tag*/ = {}) const {
    std::array<std::uint8_t, sizeof(T)> bytes;
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    std::memcpy(&value, bytes.data(), sizeof(T));
  }
};

/// All fields as bytes, in the order of the definition.
struct FieldBytes {
  std::vector<std::uint8_t> out;
  template <class T>
  void operator()(std::string_view /*name*/, const T& value, Extension /*tag*/ = {}) {
    const auto* const first = reinterpret_cast<const std::uint8_t*>(&value);
    out.insert(out.end(), first, first + sizeof(T));
  }
};

template <class Message>
std::vector<std::uint8_t> bytes_of(const Message& message) {
  FieldBytes bytes;
  Message::visit(message, bytes);
  return bytes.out;
}

TEST(MavlinkLayout, IsThatOfTheTableOfAllMessages) {
  int count = 0;
  for_each_message(AllMessages{}, [&]<class Message>(const Message&) {
    constexpr MessageLayout layout = layout_of<Message>();
    const KnownMessage* const known = known_message(Message::kId);
    ASSERT_NE(known, nullptr) << Message::kName;
    EXPECT_EQ(known->crc_extra, layout.crc_extra) << Message::kName;
    EXPECT_EQ(known->base_length, layout.base_length) << Message::kName;
    EXPECT_EQ(known->length, layout.length) << Message::kName;
    EXPECT_EQ(known->name, Message::kName);
    ++count;
  });
  EXPECT_EQ(count, 22);
  EXPECT_EQ(known_message(3), nullptr);
  EXPECT_EQ(known_message(0xffffff), nullptr);
}

TEST(MavlinkChecksum, IsThatOfThePublishedCheckWord) {
  Checksum checksum;
  for (const char letter : std::string_view("123456789")) checksum.add(static_cast<std::uint8_t>(letter));
  EXPECT_EQ(checksum.value(), 0x6f91);  // CRC-16/MCRF4XX
}

TEST(MavlinkCodec, WritesAHeartbeatAsThePublishedBytes) {
  // Put together by hand: custom_mode first, since it is the widest, then the bytes in their order; the last
  // byte, mavlink_version, is not zero, so nothing is left out.
  Sender sender{1, kAvoidanceComponent, 7};
  const Packet packet = pack(Heartbeat{18, 8, 0x10, 0x04030201, 4, 3}, sender);
  const std::vector<std::uint8_t> expected = {0xfd, 9, 0, 0, 7,  1, 196,  0, 0, 0,
                                              1,    2, 3, 4, 18, 8, 0x10, 4, 3};
  ASSERT_EQ(packet.length, expected.size() + 2);
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), packet.bytes.begin()));
  EXPECT_EQ(sender.sequence, 8);
}

TEST(MavlinkCodec, ReadsAPacketOfMavlink1) {
  // ATTITUDE, the first of a real recording of ArduPilot but for values made round here; the checksum is
  // computed below bit by bit.
  std::vector<std::uint8_t> bytes = {0xfe, 28, 5, 1, 1, 30, 0xe8, 3, 0, 0};
  for (const float value : {0.5F, -0.25F, 2.0F, 0.0F, 1.0F, -8.0F}) {
    const auto* const first = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), first, first + 4);
  }
  std::vector<std::uint8_t> guarded(bytes.begin() + 1, bytes.end());
  guarded.push_back(39);
  unsigned crc = 0xffff;
  for (const std::uint8_t byte : guarded) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? crc >> 1U ^ 0x8408U : crc >> 1U;
  }
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xffU));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8U));
  const Look seen = look(bytes);
  ASSERT_EQ(seen.found, Found::frame);
  EXPECT_EQ(seen.frame.version, 1);
  const auto attitude = unpack<Attitude>(seen.frame);
  ASSERT_TRUE(attitude);
  EXPECT_EQ(attitude->time_boot_ms, 1000U);
  EXPECT_EQ(attitude->roll, 0.5F);
  EXPECT_EQ(attitude->yaw, 2.0F);
  EXPECT_EQ(attitude->yawspeed, -8.0F);
  EXPECT_FALSE(unpack<Heartbeat>(seen.frame));
}

TEST(MavlinkCodec, EveryFieldOfEveryMessageComesBack) {
  std::mt19937 random(5);
  for_each_message(AllMessages{}, [&]<class Message>(Message message) {
    for (int round = 0; round < 200; ++round) {
      Message::visit(message, Scramble{random});
      Sender sender{static_cast<std::uint8_t>(random()), 3, static_cast<std::uint8_t>(round)};
      const Packet packet = pack(message, sender);
      const Look seen = look(packet.span());
      ASSERT_EQ(seen.found, Found::frame) << Message::kName;
      ASSERT_EQ(seen.length, packet.length);
      const auto back = unpack<Message>(seen.frame);
      ASSERT_TRUE(back);
      ASSERT_EQ(bytes_of(*back), bytes_of(message)) << Message::kName;
    }
  });
}

TEST(MavlinkCodec, LeavesOutZerosAtTheEndAndPutsThemBack) {
  Sender sender;
  EXPECT_EQ(pack(Timesync{}, sender).length, 10U + 1U + 2U);  // one byte always stays
  const Packet question = pack(Timesync{0, 258}, sender);
  EXPECT_EQ(question.length, 10U + 10U + 2U);  // tc1, and two bytes of ts1
  const auto back = unpack<Timesync>(look(question.span()).frame);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->ts1, 258);
  EXPECT_EQ(back->target_component, 0);
}

TEST(MavlinkCodec, TakesAPacketWhoseZerosWereNotLeftOut) {
  // Of another library, which sends the extension's zeros.
  std::vector<std::uint8_t> bytes = {0xfd, 18, 0, 0, 0, 1, 1, 111, 0, 0};
  bytes.resize(28);
  bytes[10] = 9;
  Checksum checksum;
  for (std::size_t i = 1; i < bytes.size(); ++i) checksum.add(bytes[i]);
  checksum.add(34);
  bytes.push_back(static_cast<std::uint8_t>(checksum.value() & 0xffU));
  bytes.push_back(static_cast<std::uint8_t>(static_cast<unsigned>(checksum.value()) >> 8U));
  const Look seen = look(bytes);
  ASSERT_EQ(seen.found, Found::frame);
  EXPECT_EQ(unpack<Timesync>(seen.frame)->tc1, 9);
}

}  // namespace
}  // namespace pade::live::mavlink
