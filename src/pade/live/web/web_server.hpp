// The page and Foxglove's protocol over HTTP and WebSocket, in a thread of its own.
#pragma once

#include <memory>
#include <string>

#include "pade/core/result.hpp"
#include "pade/live/web/publisher.hpp"
#include "pade/live/web/session_health.hpp"
#include "pade/live/web/web_options.hpp"

namespace pade::live {

/// Serves "/" (the page), "/health.json", and WebSockets at any path. As long as it lives; the publisher must
/// outlive it. Any thread.
///
/// A client that reads nothing holds one message, of which at most 64 kB wait in the library and 256 kB in
/// the kernel; of all that comes meanwhile it gets the newest when it reads again. At most eight WebSockets
/// at a time; more are refused (503).
class WebServer {
 public:
  /// Errors: the program was built without libwebsockets; the address cannot be listened at.
  /// @param options  that check() accepts
  static Result<std::unique_ptr<WebServer>> start(const WebOptions& options, Publisher& publisher);
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;
  ~WebServer();

  /// That it listens at.
  [[nodiscard]] int port() const;
  /// "http://127.0.0.1:8765/"; a token is not told.
  [[nodiscard]] std::string url() const;
  [[nodiscard]] WebCounts counts() const;

 private:
  class Work;
  explicit WebServer(std::unique_ptr<Work> work);
  std::unique_ptr<Work> work_;
};

}  // namespace pade::live
