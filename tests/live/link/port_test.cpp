// UDP peers that come and go, and serial lines that are pulled out.
#include "pade/live/link/port.hpp"

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include "support/temporary_folder.hpp"

namespace pade::live {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kPort = 24'571;

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

/// Reads until something comes.
std::string heard(Port& port, std::chrono::milliseconds longest = std::chrono::seconds(2)) {
  const auto end = std::chrono::steady_clock::now() + longest;
  std::vector<std::uint8_t> bytes(100);
  while (std::chrono::steady_clock::now() < end) {
    port.wait(10);
    const std::size_t count = port.read(bytes);
    if (count > 0) return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)};
  }
  return {};
}

bool write_text(Port& port, const std::string& text) {
  return port.write(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

TEST(UdpPort, AnswersTheSenderThatIsChosenAndNobodyElse) {
  const auto port = open_udp(kPort);
  ASSERT_TRUE(port) << port.error().message;
  EXPECT_FALSE(write_text(**port, "nobody"));
  for (int peer = 0; peer < 20; ++peer) {  // each from a port of its own
    const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
    const sockaddr_in to = loopback(kPort);
    ASSERT_EQ(::sendto(socket, "hello", 5, 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to)), 5);
    EXPECT_EQ(heard(**port), "hello");
    (*port)->answer_sender();
    const int stranger = ::socket(AF_INET, SOCK_DGRAM, 0);
    ASSERT_EQ(::sendto(stranger, "me", 2, 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to)), 2);
    EXPECT_EQ(heard(**port), "me");
    ::close(stranger);
    EXPECT_TRUE(write_text(**port, "answer"));
    char answer[10] = {};
    EXPECT_EQ(::recv(socket, answer, sizeof(answer), 0), 6);
    EXPECT_STREQ(answer, "answer");
    ::close(socket);
  }
}

TEST(UdpPort, APortThatIsTakenIsRefused) {
  const auto first = open_udp(kPort + 1);
  ASSERT_TRUE(first);
  const auto second = open_udp(kPort + 1);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("udp:24572"));
}

/// A line that ends in a file name, as an adapter for serial lines has it.
class Adapter {
 public:
  explicit Adapter(fs::path name) : name_(std::move(name)) { plug_in(); }
  ~Adapter() { pull_out(); }
  Adapter(const Adapter&) = delete;
  Adapter& operator=(const Adapter&) = delete;
  void plug_in() {
    master_ = ::posix_openpt(O_RDWR | O_NOCTTY);
    ::grantpt(master_);
    ::unlockpt(master_);
    termios settings{};
    ::tcgetattr(master_, &settings);
    ::cfmakeraw(&settings);
    ::tcsetattr(master_, TCSANOW, &settings);
    fs::create_symlink(::ptsname(master_), name_);
  }
  void pull_out() {
    if (master_ < 0) return;
    ::close(master_);
    master_ = -1;
    fs::remove(name_);
  }
  [[nodiscard]] int master() const { return master_; }

 private:
  fs::path name_;
  int master_ = -1;
};

TEST(SerialPort, IsOpenedAgainAfterItWasPulledOut) {
  const test::TemporaryFolder folder;
  Adapter adapter(folder / "ttyTest");
  const auto port = open_serial((folder / "ttyTest").string(), 921600);
  ASSERT_TRUE(port) << port.error().message;
  for (int round = 0; round < 3; ++round) {
    const auto start = std::chrono::steady_clock::now();
    std::string got;
    while (got.empty() && std::chrono::steady_clock::now() - start < std::chrono::seconds(5)) {
      ASSERT_EQ(::write(adapter.master(), "hello", 5), 5);
      got = heard(**port);
    }
    EXPECT_THAT(got, HasSubstr("hello"));
    EXPECT_LE(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
    EXPECT_TRUE(write_text(**port, "answer"));
    char answer[10] = {};
    EXPECT_EQ(::read(adapter.master(), answer, sizeof(answer)), 6);
    adapter.pull_out();
    EXPECT_EQ(heard(**port, std::chrono::milliseconds(100)), "");
    EXPECT_FALSE(write_text(**port, "nobody"));
    adapter.plug_in();
  }
}

TEST(OpenPort, NamesThatAreNoneAreRefused) {
  for (const char* const name : {"", "udp:", "udp:0", "udp:99999", "udp:14x", "tcp:14", "ttyS0"}) {
    const auto port = open_port(name, 57600);
    ASSERT_FALSE(port) << name;
    EXPECT_THAT(port.error().message, HasSubstr("expected udp:PORT, a device"));
  }
  EXPECT_THAT(open_port("/dev/none", 57600).error().message, HasSubstr("/dev/none"));
  EXPECT_THAT(open_port("/dev/null", 12345).error().message, HasSubstr("link.baud"));
  EXPECT_THAT(open_port("/dev/null", 57600).error().message, HasSubstr("expected a serial line"));
}

}  // namespace
}  // namespace pade::live
