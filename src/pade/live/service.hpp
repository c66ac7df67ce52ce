// What systemd is told of a session that it has started: ready, alive, stopping. sd_notify's protocol,
// without its library.
#pragma once

#include <string>
#include <string_view>

namespace pade::live {

/// Speaks to the service manager that started the program; says nothing where none did. One thread.
class ServiceManager {
 public:
  /// From the environment's NOTIFY_SOCKET: a path, or an abstract name that begins with @.
  ServiceManager();
  /// With that address; empty: nobody listens.
  explicit ServiceManager(std::string address);
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;
  ~ServiceManager();

  /// Somebody listens.
  [[nodiscard]] bool listens() const { return socket_ >= 0; }
  /// Everything is open.
  void ready() const { tell("READY=1"); }
  /// Fed while the session gets on; where that stops, systemd starts the program anew (WatchdogSec=).
  /// @param status  a line for `systemctl status`
  void alive(std::string_view status) const;
  /// The map is being saved.
  void stopping() const { tell("STOPPING=1"); }

 private:
  void tell(std::string_view text) const;

  std::string address_;
  int socket_ = -1;
};

}  // namespace pade::live
