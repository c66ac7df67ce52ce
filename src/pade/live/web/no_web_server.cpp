// In place of web_server.cpp where libwebsockets is missing.
#include "pade/live/web/web_server.hpp"

namespace pade::live {

class WebServer::Work {};

WebServer::WebServer(std::unique_ptr<Work> work) : work_(std::move(work)) {}
WebServer::~WebServer() = default;

Result<std::unique_ptr<WebServer>> WebServer::start(const WebOptions& /*options*/, Publisher& /*publisher*/) {
  return Error{
      "--web: this program was built without libwebsockets: install libwebsockets-dev and build it again"};
}

int WebServer::port() const { return 0; }
std::string WebServer::url() const { return {}; }
WebCounts WebServer::counts() const { return {}; }

}  // namespace pade::live
