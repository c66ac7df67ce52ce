#include "pade/live/service.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace pade::live {
namespace {

std::string address_of_environment() {
  const char* address = std::getenv("NOTIFY_SOCKET");
  return address == nullptr ? std::string() : std::string(address);
}

}  // namespace

ServiceManager::ServiceManager() : ServiceManager(address_of_environment()) {}

ServiceManager::ServiceManager(std::string address) : address_(std::move(address)) {
  const bool is_address = address_.starts_with('/') || address_.starts_with('@');
  if (!is_address || address_.size() >= sizeof(sockaddr_un::sun_path)) return;
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
}

ServiceManager::~ServiceManager() {
  if (socket_ >= 0) ::close(socket_);
}

void ServiceManager::alive(std::string_view status) const {
  tell(fmt::format("WATCHDOG=1\nSTATUS={}", status.substr(0, status.find('\n'))));
}

void ServiceManager::tell(std::string_view text) const {
  if (socket_ < 0) return;
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  std::copy(address_.begin(), address_.end(), std::begin(to.sun_path));
  if (to.sun_path[0] == '@') to.sun_path[0] = '\0';
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
  // A manager that is gone or busy costs a message: the next one follows in a second.
  (void)::sendto(
      socket_, text.data(), text.size(), MSG_NOSIGNAL,
      reinterpret_cast<const sockaddr*>(&to),  // NOLINT(cppcoreguidelines-pro-type-reinterpret-cast)
      length);
}

}  // namespace pade::live
