// Where bytes of MAVLink come from and go to: a UDP socket or a serial line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "pade/core/result.hpp"

namespace pade::live {

/// A way to the autopilot. Reading and writing never wait; one thread.
class Port {
 public:
  Port() = default;
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  virtual ~Port() = default;

  /// Waits until there is something to read, at most so long, ms.
  virtual void wait(int milliseconds) = 0;
  /// What has come, as much as fits; 0 if nothing has. A line that was closed is opened again here.
  virtual std::size_t read(std::span<std::uint8_t> bytes) = 0;
  /// What read() gave last came from the one who gets what is written from now on, where several may send.
  virtual void answer_sender() {}
  /// False if the bytes could not be sent, now or at all.
  virtual bool write(std::span<const std::uint8_t> bytes) = 0;
};

/// Listens at a UDP port, to anybody, and sends to whom answer_sender() chose last (whose address may change
/// at any time); before that nothing can be sent. Error: the port is taken.
Result<std::unique_ptr<Port>> open_udp(int port);
/// A serial line, 8 bits without parity. Closed (the cable pulled out), it is tried anew twice a second.
/// While it is open no other program opens it. Error: it cannot be opened, or it has no such speed.
Result<std::unique_ptr<Port>> open_serial(const std::string& device, int baud);
/// Without an autopilot: nothing comes, and nobody gets what is written.
inline constexpr std::string_view no_port = "none";
/// "udp:14540", a device such as "/dev/ttyAMA0", or no_port. Errors: those above; none of the three.
Result<std::unique_ptr<Port>> open_port(const std::string& name, int baud);

}  // namespace pade::live
