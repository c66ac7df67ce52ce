// The protocol of Foxglove: what server and client say to each other beside the messages themselves.
// https://github.com/foxglove/ws-protocol
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/live/web/channels.hpp"

namespace pade::live {

/// Both names of the protocol: of clients of today, and of those before 2025.
inline constexpr std::array<const char*, 2> kFoxgloveProtocols = {"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// @param offered  Sec-WebSocket-Protocol: names apart by commas
bool offers_known_protocol(std::string_view offered);

/// serverInfo.
std::string server_info();
/// advertise, of all channels: the number of a channel is its place in web_channels plus one.
std::string advertisement();
/// status, an error.
std::string complaint(std::string_view message);

/// What a client wants.
struct ClientRequest {
  struct Subscription {
    std::uint32_t id = 0;  ///< that the client has given it
    WebChannel channel = WebChannel::camera;
  };
  std::vector<Subscription> subscribe;
  std::vector<std::uint32_t> unsubscribe;  ///< ids
};
/// Errors: not JSON, not an object with "op", a channel that does not exist. What we do not do (parameters,
/// services, messages of clients) is an error too.
Result<ClientRequest> read_client_request(std::string_view text);

/// Bytes before a message: operation, subscription, time.
inline constexpr std::size_t kMessageHead = 13;
std::array<std::uint8_t, kMessageHead> message_head(std::uint32_t subscription, Time time);

}  // namespace pade::live
