#include "pade/live/web/foxglove.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/core/version.hpp"
#include "pade/io/recording/messages/message_definitions.hpp"
#include "pade/io/text.hpp"

namespace pade::live {
namespace {

using Json = nlohmann::json;

/// "sensor_msgs/Image" as ROS 2 has it.
std::string ros2_name(std::string_view type) {
  const std::size_t slash = type.find('/');
  return fmt::format("{}/msg/{}", type.substr(0, slash), type.substr(slash + 1));
}

std::optional<std::uint32_t> whole_number(const Json& value) {
  if (!value.is_number_unsigned()) return std::nullopt;
  const auto number = value.get<std::uint64_t>();
  if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

std::optional<std::uint32_t> field_number(const Json& object, const char* name) {
  if (!object.is_object()) return std::nullopt;
  const auto found = object.find(name);
  return found == object.end() ? std::nullopt : whole_number(*found);
}

Result<ClientRequest> read_subscriptions(const Json& list) {
  ClientRequest request;
  for (const Json& entry : list) {
    const auto id = field_number(entry, "id");
    const auto channel = field_number(entry, "channelId");
    if (!id || !channel) return Error{"subscribe: expected whole numbers id and channelId"};
    if (*channel < 1 || *channel > kWebChannels)
      return Error{fmt::format("subscribe: found channelId {}, expected 1 to {}", *channel, kWebChannels)};
    request.subscribe.push_back({*id, static_cast<WebChannel>(*channel - 1)});
  }
  return request;
}

Result<ClientRequest> read_unsubscriptions(const Json& list) {
  ClientRequest request;
  for (const Json& entry : list) {
    const auto id = whole_number(entry);
    if (!id) return Error{"unsubscribe: expected whole numbers"};
    request.unsubscribe.push_back(*id);
  }
  return request;
}

/// Bytes that are no UTF-8 come from clients only in what is quoted back to them.
std::string shown(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

bool offers_known_protocol(std::string_view offered) {
  const auto names = io::split_fields(offered);
  return std::any_of(names.begin(), names.end(), [](std::string_view name) {
    return std::find(kFoxgloveProtocols.begin(), kFoxgloveProtocols.end(), name) != kFoxgloveProtocols.end();
  });
}

std::string server_info() {
  return shown({{"op", "serverInfo"},
                {"name", fmt::format("pade live {}", version)},
                {"capabilities", Json::array()},
                {"supportedEncodings", Json::array()},
                {"metadata", Json::object()}});
}

std::string advertisement() {
  Json channels = Json::array();
  for (std::size_t i = 0; i < kWebChannels; ++i) {
    const WebChannelInfo& info = web_channels[i];
    channels.push_back({{"id", i + 1},
                        {"topic", std::string(info.topic)},
                        {"encoding", "cdr"},
                        {"schemaName", ros2_name(info.type)},
                        {"schemaEncoding", "ros2msg"},
                        {"schema", io::message_definition(info.type, io::MessageEncoding::cdr)}});
  }
  return shown({{"op", "advertise"}, {"channels", std::move(channels)}});
}

std::string complaint(std::string_view message) {
  constexpr int kError = 2;
  return shown({{"op", "status"}, {"level", kError}, {"message", std::string(message)}});
}

Result<ClientRequest> read_client_request(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return Error{"expected a JSON object"};
  const auto op = json.find("op");
  if (op == json.end() || !op->is_string()) return Error{"expected a text \"op\""};
  const auto list_of = [&](const char* name) -> const Json* {
    const auto found = json.find(name);
    return found != json.end() && found->is_array() ? &*found : nullptr;
  };
  if (*op == "subscribe") {
    const Json* const list = list_of("subscriptions");
    if (list == nullptr) return Error{"subscribe: expected a list \"subscriptions\""};
    return read_subscriptions(*list);
  }
  if (*op == "unsubscribe") {
    const Json* const list = list_of("subscriptionIds");
    if (list == nullptr) return Error{"unsubscribe: expected a list \"subscriptionIds\""};
    return read_unsubscriptions(*list);
  }
  return Error{fmt::format("found op {}, expected subscribe or unsubscribe", shown(*op))};
}

std::array<std::uint8_t, kMessageHead> message_head(std::uint32_t subscription, Time time) {
  constexpr std::uint8_t kMessageData = 1;
  std::array<std::uint8_t, kMessageHead> head{kMessageData};
  for (std::size_t i = 0; i < 4; ++i) head[1 + i] = static_cast<std::uint8_t>(subscription >> (8 * i));
  const auto nanoseconds = static_cast<std::uint64_t>(time.nanoseconds);
  for (std::size_t i = 0; i < 8; ++i) head[5 + i] = static_cast<std::uint8_t>(nanoseconds >> (8 * i));
  return head;
}

}  // namespace pade::live
