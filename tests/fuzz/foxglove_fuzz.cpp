// Any text as what a client of the web server says: the names of protocols that it offers, and its requests.
// They are refused in words or name channels that exist; libwebsockets reads handshake and frames itself.
#include <algorithm>
#include <cstdint>
#include <string_view>

#include "pade/live/web/foxglove.hpp"

#include "expect.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (pade::live::offers_known_protocol(text)) {
    PADE_EXPECT(std::any_of(pade::live::kFoxgloveProtocols.begin(), pade::live::kFoxgloveProtocols.end(),
                            [&](const char* name) { return text.find(name) != std::string_view::npos; }));
  }
  const auto request = pade::live::read_client_request(text);
  if (!request) {
    PADE_EXPECT(!request.error().message.empty());
    const std::string answer = pade::live::complaint(request.error().message);
    PADE_EXPECT(answer.front() == '{' && answer.back() == '}');
    return 0;
  }
  for (const auto& subscription : request->subscribe)
    PADE_EXPECT(static_cast<std::size_t>(subscription.channel) < pade::live::kWebChannels);
  return 0;
}
