#include "pade/live/link/port.hpp"

#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

namespace pade::live {
namespace {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  [[nodiscard]] int get() const { return number_; }
  [[nodiscard]] bool open() const { return number_ >= 0; }

 private:
  int number_;
};

void wait_for_bytes(const Descriptor& descriptor, int milliseconds) {
  pollfd asked{descriptor.get(), POLLIN, 0};  // a negative number only waits
  ::poll(&asked, 1, milliseconds);
}

class UdpPort : public Port {
 public:
  explicit UdpPort(Descriptor socket) : socket_(std::move(socket)) {}

  void wait(int milliseconds) override { wait_for_bytes(socket_, milliseconds); }
  std::size_t read(std::span<std::uint8_t> bytes) override {
    socklen_t length = sizeof(sender_);
    const ssize_t count = ::recvfrom(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT,
                                     reinterpret_cast<sockaddr*>(&sender_), &length);
    return count > 0 ? static_cast<std::size_t>(count) : 0;
  }
  void answer_sender() override {
    peer_ = sender_;
    known_ = true;
  }
  bool write(std::span<const std::uint8_t> bytes) override {
    if (!known_) return false;
    const ssize_t count = ::sendto(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT,
                                   reinterpret_cast<const sockaddr*>(&peer_), sizeof(peer_));
    return count == static_cast<ssize_t>(bytes.size());
  }

 private:
  Descriptor socket_;
  sockaddr_in sender_{};  // of what was read last
  sockaddr_in peer_{};
  bool known_ = false;
};

struct Speed {
  int baud;
  speed_t code;
};
constexpr Speed kSpeeds[] = {{9600, B9600},       {19200, B19200},     {38400, B38400},
                             {57600, B57600},     {115200, B115200},   {230400, B230400},
                             {460800, B460800},   {500000, B500000},   {921600, B921600},
                             {1000000, B1000000}, {1500000, B1500000}, {2000000, B2000000}};

Descriptor open_line(const std::string& device, speed_t speed) {
  Descriptor line(::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  termios settings{};
  // Two programs on one line would each get half of the bytes.
  if (!line.open() || ::tcgetattr(line.get(), &settings) != 0 || ::ioctl(line.get(), TIOCEXCL) != 0)
    return Descriptor();
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB);
  ::cfsetispeed(&settings, speed);
  ::cfsetospeed(&settings, speed);
  if (::tcsetattr(line.get(), TCSANOW, &settings) != 0) return Descriptor();
  return line;
}

class SerialPort : public Port {
 public:
  SerialPort(Descriptor line, std::string device, speed_t speed)
      : line_(std::move(line)), device_(std::move(device)), speed_(speed) {}

  void wait(int milliseconds) override {
    // A line without its other end is always ready, and would be asked without pause.
    pollfd asked{line_.get(), POLLIN, 0};
    if (::poll(&asked, 1, milliseconds) > 0 && (asked.revents & POLLIN) == 0)
      ::poll(nullptr, 0, milliseconds);
  }
  std::size_t read(std::span<std::uint8_t> bytes) override {
    if (!line_.open() && !reopen()) return 0;
    const ssize_t count = ::read(line_.get(), bytes.data(), bytes.size());
    if (count > 0) return static_cast<std::size_t>(count);
    if (count == 0 || (errno != EAGAIN && errno != EINTR)) line_ = Descriptor();
    return 0;
  }
  bool write(std::span<const std::uint8_t> bytes) override {
    if (!line_.open()) return false;
    const ssize_t count = ::write(line_.get(), bytes.data(), bytes.size());
    if (count < 0 && errno != EAGAIN && errno != EINTR) line_ = Descriptor();
    return count == static_cast<ssize_t>(bytes.size());
  }

 private:
  bool reopen() {
    constexpr auto kPause = std::chrono::milliseconds(500);
    const auto now = std::chrono::steady_clock::now();
    if (now - tried_ < kPause) return false;
    tried_ = now;
    line_ = open_line(device_, speed_);
    return line_.open();
  }

  Descriptor line_;
  std::string device_;
  speed_t speed_;
  std::chrono::steady_clock::time_point tried_;
};

class NoPort : public Port {
 public:
  void wait(int milliseconds) override { ::poll(nullptr, 0, milliseconds); }
  std::size_t read(std::span<std::uint8_t> /*bytes*/) override { return 0; }
  bool write(std::span<const std::uint8_t> /*bytes*/) override { return true; }
};

}  // namespace

Result<std::unique_ptr<Port>> open_udp(int port) {
  Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  if (!socket.open() ||
      ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return Error{fmt::format("udp:{}: {}, expected a port that is free", port, std::strerror(errno))};
  }
  return std::unique_ptr<Port>(std::make_unique<UdpPort>(std::move(socket)));
}

Result<std::unique_ptr<Port>> open_serial(const std::string& device, int baud) {
  for (const Speed& speed : kSpeeds) {
    if (speed.baud != baud) continue;
    Descriptor line = open_line(device, speed.code);
    if (!line.open()) {
      return Error{fmt::format("{}: {}, expected a serial line", device, std::strerror(errno))};
    }
    return std::unique_ptr<Port>(std::make_unique<SerialPort>(std::move(line), device, speed.code));
  }
  return Error{fmt::format("link.baud: found {}, expected a usual speed from 9600 to 2000000", baud)};
}

Result<std::unique_ptr<Port>> open_port(const std::string& name, int baud) {
  constexpr std::string_view kUdp = "udp:";
  if (name.starts_with("/")) return open_serial(name, baud);
  if (name == no_port) return std::unique_ptr<Port>(std::make_unique<NoPort>());
  if (name.starts_with(kUdp)) {
    int port = 0;
    const char* const end = name.data() + name.size();
    const auto [stop, code] = std::from_chars(name.data() + kUdp.size(), end, port);
    if (code == std::errc() && stop == end && port > 0 && port < 65536) return open_udp(port);
  }
  return Error{fmt::format(
      "link.port: found \"{}\", expected udp:PORT, a device such as /dev/ttyAMA0, or none", name)};
}

}  // namespace pade::live
