#include "pade/live/web/web_options.hpp"

#include <algorithm>
#include <array>

#include <arpa/inet.h>
#include <fmt/format.h>

#include "pade/core/option_check.hpp"
#include "pade/io/text.hpp"
#include "pade/live/web/foxglove.hpp"

namespace pade::live {
namespace {

constexpr std::size_t kLeastToken = 16;  // characters

/// Of "name:port" and "[address]:port".
std::string_view name_of_host(std::string_view host) {
  if (host.starts_with('[')) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.rfind(':'));
}

bool is_loopback_address(const std::string& address) {
  constexpr unsigned char kNet = 127;
  std::array<unsigned char, sizeof(in_addr)> binary{};
  return address == "::1" || (::inet_pton(AF_INET, address.c_str(), binary.data()) == 1 && binary[0] == kNet);
}

bool is_loopback_name(std::string_view name) {
  return name == "localhost" || name == "[::1]" || is_loopback_address(std::string(name));
}

bool is_address(const std::string& address) {
  std::array<unsigned char, sizeof(in6_addr)> binary{};
  return ::inet_pton(AF_INET, address.c_str(), binary.data()) == 1 ||
         ::inet_pton(AF_INET6, address.c_str(), binary.data()) == 1;
}

/// In a time that does not tell how much of it is right.
bool same_token(std::string_view found, std::string_view expected) {
  unsigned difference = found.size() == expected.size() ? 0 : 1;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const char other = i < found.size() ? found[i] : '\0';
    difference |= static_cast<unsigned char>(other) ^ static_cast<unsigned char>(expected[i]);
  }
  return difference == 0;
}

bool is_token_character(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_';
}

}  // namespace

Status check(const WebOptions& options) {
  const OptionRange ranges[] = {{"web.port", static_cast<double>(options.port), 0, 65535}};
  if (const Status status = check_ranges(ranges); !status) return status;
  if (!is_address(options.address))
    return Error{fmt::format("web.address: found \"{}\", expected an address such as 127.0.0.1 or 0.0.0.0",
                             options.address)};
  if (options.token.empty() && !is_loopback_address(options.address))
    return Error{fmt::format(
        "web.token: found none, expected one since web.address {} can be reached from other machines",
        options.address)};
  const bool plain = std::all_of(options.token.begin(), options.token.end(), is_token_character);
  if (!options.token.empty() && (!plain || options.token.size() < kLeastToken))
    return Error{
        fmt::format("web.token: found {} characters{}, expected at least {} of letters, digits, - and _",
                    options.token.size(), plain ? "" : ", some of them other ones", kLeastToken)};
  for (const std::string_view origin : io::split_fields(options.origins)) {
    const bool known = origin.find("://") != std::string_view::npos && !origin.ends_with('/');
    if (!origin.empty() && !known)
      return Error{fmt::format(
          "web.origins: found \"{}\", expected scheme and host such as https://app.foxglove.dev", origin)};
  }
  return {};
}

Refusal refusal_of_request(const WebRequest& request, const WebOptions& options) {
  if (!options.token.empty() && !same_token(request.token, options.token))
    return {401, request.token.empty() ? "no token: add ?token=... to the address" : "the token is wrong"};
  // A name of others that leads here would make a page of theirs one of ours.
  if (options.token.empty() && !is_loopback_name(name_of_host(request.host)))
    return {403, fmt::format("Host {} is not this machine itself", io::in_quotes(request.host))};
  return {};
}

Refusal refusal_of_upgrade(const WebRequest& request, const WebOptions& options) {
  if (Refusal refusal = refusal_of_request(request, options); refusal.code != 0) return refusal;
  const auto allowed = io::split_fields(options.origins);
  const bool ours = request.origin.empty() || request.origin == fmt::format("http://{}", request.host) ||
                    std::find(allowed.begin(), allowed.end(), request.origin) != allowed.end();
  if (!ours) return {403, fmt::format("Origin {} is not among web.origins", io::in_quotes(request.origin))};
  if (!offers_known_protocol(request.protocols))
    return {400, fmt::format("Sec-WebSocket-Protocol {}, expected {} or {}", io::in_quotes(request.protocols),
                             kFoxgloveProtocols[0], kFoxgloveProtocols[1])};
  return {};
}

}  // namespace pade::live
