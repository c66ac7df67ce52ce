// Our packets in the hands of an independent program: node-mavlink, from npm. scripts/mavlink-oracle fetches
// it and runs this; without it the test is skipped.
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pade/live/mavlink/codec.hpp"

#include "live/mavlink/all_messages.hpp"
#include "support/temporary_folder.hpp"

namespace pade::live::mavlink {
namespace {

/// Any value of a field; text of letters, shorter than its place.
struct Fill {
  std::mt19937_64& random;
  template <class T>
  T any() const {
    if constexpr (std::is_floating_point_v<T>) {
      return static_cast<T>(std::uniform_real_distribution<double>(-1000, 1000)(random));
    } else {
      // Often short, so that zeros at the end of a packet are left out.
      return random() % 3 == 0 ? T{0} : static_cast<T>(random());
    }
  }
  template <class T>
  void operator()(std::string_view /*name*/, T& value, Extension /*tag*/ = {}) const {
    value = any<T>();
  }
  template <class T, std::size_t n>
  void operator()(std::string_view /*name*/, std::array<T, n>& values, Extension /*tag*/ = {}) const {
    const std::size_t letters = random() % n;
    for (std::size_t i = 0; i < n; ++i) {
      if constexpr (std::is_same_v<T, char>) {
        values[i] = i < letters ? static_cast<char>('A' + random() % 26) : '\0';
      } else {
        values[i] = any<T>();
      }
    }
  }
};

/// "name": value pairs, whole numbers in quotes because those of 64 bits do not fit a number of JSON.
struct Json {
  std::string text;
  template <class T>
  static std::string shown(T value) {
    if constexpr (std::is_floating_point_v<T>) return fmt::format("{:.9g}", static_cast<double>(value));
    return fmt::format("\"{}\"", +value);
  }
  void add(std::string_view name, const std::string& value) {
    text += fmt::format("{}\"{}\":{}", text.empty() ? "" : ",", name, value);
  }
  template <class T>
  void operator()(std::string_view name, const T& value, Extension /*tag*/ = {}) {
    add(name, shown(value));
  }
  template <class T, std::size_t n>
  void operator()(std::string_view name, const std::array<T, n>& values, Extension /*tag*/ = {}) {
    if constexpr (std::is_same_v<T, char>) {
      add(name, fmt::format("\"{}\"", values.data()));
    } else {
      std::string list;
      for (const T& value : values) list += (list.empty() ? "" : ",") + shown(value);
      add(name, "[" + list + "]");
    }
  }
};

TEST(NodeMavlink, ReadsEveryFieldOfOurPackets) {
  const char* const modules = std::getenv("PADE_NODE_MODULES");
  if (modules == nullptr) GTEST_SKIP() << "PADE_NODE_MODULES is not set: run scripts/mavlink-oracle";
  const test::TemporaryFolder folder;
  std::ofstream packets(folder / "packets.bin", std::ios::binary);
  std::ofstream expected(folder / "expected.jsonl");
  std::mt19937_64 random(11);
  Sender sender{9, 196, 0};
  for (int round = 0; round < 100; ++round) {
    for_each_message(AllMessages{}, [&]<class Message>(Message message) {
      Message::visit(message, Fill{random});
      const Packet packet = pack(message, sender);
      packets.write(reinterpret_cast<const char*>(packet.bytes.data()),
                    static_cast<std::streamsize>(packet.length));
      Json json;
      Message::visit(message, json);
      expected << fmt::format("{{\"id\":{},\"fields\":{{{}}}}}\n", Message::kId, json.text);
    });
  }
  packets.close();
  expected.close();
  const std::string command = fmt::format("NODE_PATH='{}' node '{}/tests/live/mavlink/node_mavlink.js' '{}'",
                                          modules, PADE_SOURCE_DIR, folder.path().string());
  EXPECT_EQ(std::system(command.c_str()), 0);
}

}  // namespace
}  // namespace pade::live::mavlink
