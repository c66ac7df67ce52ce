// Who may see a session over the network, and where it listens.
#pragma once

#include <string>
#include <string_view>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::live {

/// Options of WebServer.
struct WebOptions {
  int port = 8765;                    ///< TCP; 0: any that is free
  std::string address = "127.0.0.1";  ///< that it listens at; 0.0.0.0: all of this machine
  std::string token;                  ///< that clients must name; empty: none, which only loopback may have
  std::string origins;                ///< of pages of others that may connect, apart by spaces

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("port", self.port, "TCP; 0 = any that is free");
    field("address", self.address, "that it listens at; 0.0.0.0 = all of this machine");
    field("token", self.token,
          "that clients must name (?token=); empty = none, which only loopback may have");
    field("origins", self.origins,
          "of pages of others that may connect, apart by spaces: https://app.foxglove.dev");
  }
};
/// Refuses what makes no sense, or would let the network in without a token.
Status check(const WebOptions& options);

/// What a request says of itself; empty where it does not.
struct WebRequest {
  std::string host;       ///< Host
  std::string origin;     ///< Origin: of the page that asks
  std::string token;      ///< of the query
  std::string protocols;  ///< Sec-WebSocket-Protocol, apart by commas
};

/// Why a request is refused.
struct Refusal {
  int code = 0;  ///< of HTTP; 0: it is not refused
  std::string reason;
};

/// A page, or a file of numbers.
Refusal refusal_of_request(const WebRequest& request, const WebOptions& options);
/// A WebSocket: as above, and it must offer a protocol that we speak, and come from no page of others.
Refusal refusal_of_upgrade(const WebRequest& request, const WebOptions& options);

}  // namespace pade::live
