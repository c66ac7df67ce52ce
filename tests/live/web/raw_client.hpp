// A WebSocket client in a hundred lines over a plain socket: another reading of RFC 6455 than the server's,
// and one that can stop reading.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace pade::live {

/// A connection to a port of this machine.
class RawClient {
 public:
  /// What it asks for; empty fields are left out.
  struct Request {
    std::string path = "/";
    std::string protocols = "foxglove.sdk.v1";
    std::string origin{};
    std::string host{};
    bool upgrade = true;
  };
  struct Message {
    bool binary = false;
    std::string bytes;
  };

  explicit RawClient(int port, int receive_buffer = 0) {
    socket_ = ::socket(AF_INET, SOCK_STREAM, 0);
    if (receive_buffer > 0)
      (void)::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof(receive_buffer));
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0;
  }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  ~RawClient() { ::close(socket_); }

  [[nodiscard]] bool connected() const { return connected_; }

  /// The answer's head, and of one that is no WebSocket its body. Empty: none came.
  std::string ask(const Request& request) {
    std::string text = fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\n", request.path,
                                   request.host.empty() ? "127.0.0.1:1" : request.host);
    if (request.upgrade)
      text +=
          "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
          "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    if (request.upgrade && !request.protocols.empty())
      text += fmt::format("Sec-WebSocket-Protocol: {}\r\n", request.protocols);
    if (!request.origin.empty()) text += fmt::format("Origin: {}\r\n", request.origin);
    give(text + "\r\n");
    while (come_.find("\r\n\r\n") == std::string::npos)
      if (!wait()) return std::exchange(come_, {});
    const std::size_t end = come_.find("\r\n\r\n") + 4;
    std::string head = come_.substr(0, end);
    come_.erase(0, end);
    if (head.find(" 101 ") != std::string::npos) return head;
    const std::size_t length = head.find("content-length: ");
    const std::size_t body = length == std::string::npos ? 0 : std::stoul(head.substr(length + 16));
    while (come_.size() < body && wait()) {
    }
    return head + std::exchange(come_, {});
  }

  /// As one masked frame.
  void send_text(std::string_view text) { give(frame_of(1, text)); }
  void give(std::string_view bytes) { (void)!::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  static std::string frame_of(unsigned operation, std::string_view payload, bool last = true) {
    std::string frame(1, static_cast<char>(operation | (last ? 0x80U : 0U)));
    if (payload.size() < 126) {
      frame += static_cast<char>(0x80U | payload.size());
    } else {
      frame += static_cast<char>(0x80U | 127U);
      for (int shift = 56; shift >= 0; shift -= 8) frame += static_cast<char>(payload.size() >> shift);
    }
    const std::array<char, 4> mask = {0x12, 0x34, 0x56, 0x78};
    frame.append(mask.data(), mask.size());
    for (std::size_t i = 0; i < payload.size(); ++i) frame += static_cast<char>(payload[i] ^ mask[i % 4]);
    return frame;
  }

  /// The next whole message; none if it does not come in a generous time, or the server has closed.
  std::optional<Message> next() {
    Message message;
    bool begun = false;
    while (true) {
      while (come_.size() < 2)
        if (!wait()) return std::nullopt;
      const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(come_[i]); };
      const unsigned operation = byte(0) & 15U;
      std::size_t head = 2;
      std::uint64_t length = byte(1) & 127U;
      if (length >= 126) head = length == 126 ? 4 : 10;
      while (come_.size() < head)
        if (!wait()) return std::nullopt;
      if (head > 2) {
        length = 0;
        for (std::size_t i = 2; i < head; ++i) length = length << 8 | byte(i);
      }
      while (come_.size() < head + length)
        if (!wait()) return std::nullopt;
      const bool last = (byte(0) & 128U) != 0;
      if (operation <= 2) {
        if ((operation != 0) == begun) return std::nullopt;  // against the protocol
        if (operation != 0) message.binary = operation == 2;
        begun = true;
        message.bytes.append(come_, head, length);
      }
      come_.erase(0, head + length);
      if (operation == 8) {
        closed_ = true;
        return std::nullopt;
      }
      if (operation <= 2 && last) return message;
    }
  }
  /// The server ends the connection, or says that it will: true once it has.
  bool is_closed() {
    while (!closed_ && next()) {
    }
    return closed_;
  }

 private:
  /// More bytes; false: none come any more.
  bool wait() {
    constexpr int kLong = 20'000;  // ms
    pollfd entry{socket_, POLLIN, 0};
    if (::poll(&entry, 1, kLong) != 1) return false;
    std::array<char, 65'536> bytes;
    const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), 0);
    closed_ = count <= 0;
    if (closed_) return false;
    come_.append(bytes.data(), static_cast<std::size_t>(count));
    return true;
  }

  int socket_ = -1;
  bool connected_ = false;
  bool closed_ = false;
  std::string come_;
};

}  // namespace pade::live
