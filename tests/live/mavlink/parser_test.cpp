// Streams that begin anywhere, come in pieces and are damaged.
#include "pade/live/mavlink/parser.hpp"

#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "pade/live/mavlink/codec.hpp"
#include "pade/live/mavlink/estimate_messages.hpp"
#include "pade/live/mavlink/link_messages.hpp"

namespace pade::live::mavlink {
namespace {

using StreamBytes = std::vector<std::uint8_t>;

void append(StreamBytes& stream, std::span<const std::uint8_t> bytes) {
  stream.insert(stream.end(), bytes.begin(), bytes.end());
}

Packet attitude(std::uint32_t i, Sender& sender) {
  return pack(Attitude{i, 0.001F * static_cast<float>(i), -1, 2, 0, 0, 1}, sender);
}

/// The milliseconds of all attitudes in a stream that comes in pieces of at most `piece` bytes.
std::vector<std::uint32_t> stamps(const StreamBytes& stream, std::size_t piece, Parser& parser) {
  std::vector<std::uint32_t> found;
  for (std::size_t i = 0; i < stream.size(); i += piece) {
    const std::size_t count = std::min(piece, stream.size() - i);
    parser.add(std::span(stream).subspan(i, count), [&](const Frame& frame) {
      if (const auto message = unpack<Attitude>(frame)) found.push_back(message->time_boot_ms);
    });
  }
  return found;
}

TEST(MavlinkParser, FindsAllPacketsHoweverTheBytesComeInPieces) {
  StreamBytes stream = {1, 2, 0xfd, 0xfe, 3};  // somebody else's
  Sender sender;
  for (std::uint32_t i = 0; i < 300; ++i) append(stream, attitude(i, sender).span());
  for (const std::size_t piece : {1, 2, 7, 41, 280, 5000, 100000}) {
    Parser parser;
    const auto found = stamps(stream, piece, parser);
    ASSERT_EQ(found.size(), 300U) << piece;
    for (std::uint32_t i = 0; i < 300; ++i) ASSERT_EQ(found[i], i);
    EXPECT_EQ(parser.counts().packets, 300U);
    EXPECT_EQ(parser.counts().gaps, 0U);
    EXPECT_EQ(parser.counts().skipped_bytes, 5U);
  }
}

TEST(MavlinkParser, DeliversAPacketWithItsLastByte) {
  Sender sender;
  const Packet packet = attitude(5, sender);
  Parser parser;
  int count = 0;
  const auto take = [&](const Frame&) { ++count; };
  parser.add(packet.span().first(packet.length - 1), take);
  EXPECT_EQ(count, 0);
  parser.add(packet.span().last(1), take);
  EXPECT_EQ(count, 1);
}

TEST(MavlinkParser, TakesSignedPacketsAndRefusesFlagsThatItDoesNotKnow) {
  Sender sender;
  Packet packet = attitude(5, sender);
  const auto with_flag = [&](std::uint8_t flag, std::size_t signature) {
    StreamBytes bytes(packet.bytes.begin(),
                      packet.bytes.begin() + static_cast<std::ptrdiff_t>(packet.length));
    bytes[2] = flag;
    Checksum checksum;
    for (std::size_t i = 1; i + 2 < bytes.size(); ++i) checksum.add(bytes[i]);
    checksum.add(layout_of<Attitude>().crc_extra);
    bytes[bytes.size() - 2] = static_cast<std::uint8_t>(checksum.value() & 0xffU);
    bytes[bytes.size() - 1] = static_cast<std::uint8_t>(static_cast<unsigned>(checksum.value()) >> 8U);
    bytes.resize(bytes.size() + signature, 0xfd);
    return bytes;
  };
  StreamBytes stream = with_flag(1, 13);
  append(stream, packet.span());
  Parser parser;
  EXPECT_EQ(stamps(stream, 1000, parser), (std::vector<std::uint32_t>{5, 5}));
  EXPECT_EQ(parser.counts().skipped_bytes, 0U);
  EXPECT_TRUE(look(with_flag(1, 13)).frame.is_signed);
  EXPECT_EQ(look(with_flag(2, 0)).found, Found::nothing);
}

TEST(MavlinkParser, CountsGapsSenderBySender) {
  Sender autopilot{1, 1, 250};
  Sender gimbal{1, 154, 0};
  StreamBytes stream;
  const auto send = [&](Sender& sender) { append(stream, pack(Heartbeat{}, sender).span()); };
  for (int i = 0; i < 10; ++i) {  // over the end of the 8 bits
    send(autopilot);
    send(gimbal);
  }
  autopilot.sequence = static_cast<std::uint8_t>(autopilot.sequence + 3);
  send(autopilot);
  send(gimbal);
  Parser parser;
  parser.add(stream, [](const Frame&) {});
  EXPECT_EQ(parser.counts().packets, 22U);
  EXPECT_EQ(parser.counts().gaps, 1U);
  EXPECT_EQ(parser.counts().lost, 3U);
}

TEST(MavlinkParser, AnUnknownMessageIsNoGap) {
  Sender sender;
  StreamBytes stream;
  append(stream, pack(Heartbeat{}, sender).span());
  Packet unknown = pack(Heartbeat{2, 3, 4, 5, 6, 7}, sender);
  unknown.bytes[9] = 0x55;
  append(stream, unknown.span());
  append(stream, pack(Heartbeat{}, sender).span());
  Parser parser;
  parser.add(stream, [](const Frame&) {});
  EXPECT_EQ(parser.counts().packets, 2U);
  EXPECT_EQ(parser.counts().unknown, 1U);
  EXPECT_EQ(parser.counts().gaps, 0U);
}

TEST(MavlinkParser, ALengthThatTheMessageCannotHaveIsRefusedAtOnce) {
  constexpr std::uint8_t kLength = 28;  // of ATTITUDE
  EXPECT_EQ(look(StreamBytes{0xfe, kLength, 0, 1, 1, 30}).found, Found::incomplete);
  EXPECT_EQ(look(StreamBytes{0xfe, kLength - 1, 0, 1, 1, 30}).found, Found::nothing);
  EXPECT_EQ(look(StreamBytes{0xfd, kLength - 1, 0, 0, 0, 1, 1, 30, 0, 0}).found, Found::incomplete);
  EXPECT_EQ(look(StreamBytes{0xfd, kLength + 1, 0, 0, 0, 1, 1, 30, 0, 0}).found, Found::nothing);
}

TEST(MavlinkParser, NoiseNeverHoldsItUp) {
  // After any bytes at all, at most the longest packet is waited for in vain.
  std::mt19937 random(3);
  Parser parser;
  Sender sender;
  for (int round = 0; round < 2000; ++round) {
    StreamBytes noise(random() % 600);
    for (std::uint8_t& byte : noise) {
      byte = static_cast<std::uint8_t>(random() % 3 == 0 ? 0xfd + random() % 2 : random());
    }
    parser.add(noise, [](const Frame&) {});
    bool back = false;
    std::size_t sent = 0;
    while (!back && sent < kLongestFrame + 80) {
      const Packet packet = attitude(static_cast<std::uint32_t>(round), sender);
      sent += packet.length;
      parser.add(packet.span(), [&](const Frame& frame) { back = back || frame.id == Attitude::kId; });
    }
    ASSERT_TRUE(back) << round;
  }
}

}  // namespace
}  // namespace pade::live::mavlink
