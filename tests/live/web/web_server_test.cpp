// The server at the other end of plain sockets.
#include "pade/live/web/web_server.hpp"

#include <atomic>
#include <chrono>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pade/io/recording/messages/message_definitions.hpp"
#include "pade/live/web/foxglove.hpp"

#include "live/web/raw_client.hpp"
#include "live/web/schema_reader.hpp"
#include "live/web/small_world.hpp"

namespace pade::live {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A generous limit for what takes milliseconds.
bool comes_true(const std::function<bool()>& condition) {
  for (int i = 0; i < 4000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

class WebServerTest : public ::testing::Test {
 protected:
  void open(WebOptions options = {}, cv::Size size = {96, 64}) {
    options.port = 0;
    world_.emplace(size);
    publisher_ = std::make_unique<Publisher>(world_->camera(), forward_mounting(), SectorOptions{}, healthy);
    auto server = WebServer::start(options, *publisher_);
    if (!server && server.error().message.find("without libwebsockets") != std::string::npos)
      GTEST_SKIP() << server.error().message;
    ASSERT_TRUE(server) << server.error().message;
    server_ = std::move(*server);
  }
  [[nodiscard]] std::string answer(const RawClient::Request& request) const {
    return RawClient(server_->port()).ask(request);
  }
  static std::string subscription(std::initializer_list<WebChannel> channels) {
    nlohmann::json list = nlohmann::json::array();
    for (const WebChannel channel : channels)
      list.push_back({{"id", 100 + static_cast<int>(channel)}, {"channelId", 1 + static_cast<int>(channel)}});
    return nlohmann::json{{"op", "subscribe"}, {"subscriptions", list}}.dump();
  }
  /// The next message of a channel, those of others left out.
  static std::string data_of(RawClient& client, WebChannel channel) {
    while (true) {
      const auto message = client.next();
      if (!message) return {};
      if (!message->binary || message->bytes.size() < kMessageHead) continue;
      if (static_cast<std::uint8_t>(message->bytes[0]) != 1) continue;
      if (static_cast<std::uint8_t>(message->bytes[1]) == 100 + static_cast<int>(channel))
        return message->bytes;
    }
  }

  std::optional<SmallWorld> world_;
  std::unique_ptr<Publisher> publisher_;
  std::unique_ptr<WebServer> server_;  // last: it uses the publisher
};

TEST_F(WebServerTest, SpeaksBothNamesAndNoOther) {
  open();
  if (IsSkipped()) return;
  for (const char* name : {"foxglove.sdk.v1", "foxglove.websocket.v1"}) {
    const std::string head = answer({.protocols = name});
    EXPECT_THAT(head, StartsWith("HTTP/1.1 101"));
    EXPECT_THAT(head, HasSubstr(fmt::format("Sec-WebSocket-Protocol: {}\r\n", name)));
    EXPECT_THAT(head, HasSubstr("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo="));  // RFC 6455, 1.3
  }
  // Of several the first that is known.
  EXPECT_THAT(answer({.protocols = "other, foxglove.websocket.v1, foxglove.sdk.v1"}),
              HasSubstr("Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n"));
  for (const char* name : {"", "other", "http", "foxglove.sdk.v2"})
    EXPECT_THAT(answer({.protocols = name}), HasSubstr(" 400 ")) << name;
  EXPECT_THAT(answer({.origin = "http://evil.example"}), HasSubstr(" 403 "));
  EXPECT_THAT(answer({.host = "evil.example"}), HasSubstr(" 403 "));
  EXPECT_TRUE(comes_true([&] { return server_->counts().refused == 6; })) << server_->counts().refused;
  EXPECT_THAT(server_->counts().last_refusal, HasSubstr("evil.example"));
}

TEST_F(WebServerTest, AsksForItsToken) {
  WebOptions options;
  options.token = "0123456789abcdef";
  open(options);
  if (IsSkipped()) return;
  EXPECT_THAT(answer({}), HasSubstr(" 401 "));
  EXPECT_THAT(answer({.path = "/?token=0123456789abcdee"}), HasSubstr(" 401 "));
  EXPECT_THAT(answer({.path = "/?token=0123456789abcdef"}), HasSubstr(" 101 "));
  EXPECT_THAT(answer({.path = "/?token=0123456789abcdef", .origin = "http://evil.example"}),
              HasSubstr(" 403 "));
  EXPECT_THAT(answer({.path = "/", .upgrade = false}), HasSubstr(" 401 "));
  EXPECT_THAT(answer({.path = "/health.json", .upgrade = false}), HasSubstr(" 401 "));
  EXPECT_THAT(answer({.path = "/?token=0123456789abcdef", .upgrade = false}),
              HasSubstr("<title>pade live</title>"));
  EXPECT_EQ(server_->url(), fmt::format("http://127.0.0.1:{}/", server_->port()));  // it goes into logs
}

TEST_F(WebServerTest, ServesThePageAndItsFiles) {
  open();
  if (IsSkipped()) return;
  EXPECT_THAT(answer({.path = "/", .upgrade = false}), AllOf(HasSubstr("page.js"), HasSubstr("view_3d.js")));
  EXPECT_THAT(answer({.path = "/page.js", .upgrade = false}), HasSubstr("text/javascript"));
  EXPECT_THAT(answer({.path = "/view_3d.js", .upgrade = false}),
              AllOf(HasSubstr("text/javascript"), HasSubstr("class View3d")));
  EXPECT_THAT(answer({.path = "/../etc/passwd", .upgrade = false}), HasSubstr(" 404 "));
  EXPECT_THAT(answer({.path = "/health.json", .host = "evil.example", .upgrade = false}), HasSubstr(" 403 "));
  std::string json;
  EXPECT_TRUE(comes_true([&] {
    json = answer({.path = "/health.json", .upgrade = false});
    return json.find("obstacle mapping active") != std::string::npos;
  })) << json;
  const auto health = nlohmann::json::parse(json.substr(json.find("\r\n\r\n") + 4));
  EXPECT_EQ(health["level"], 0);
  EXPECT_EQ(health["values"]["web_clients"], "0");
}

TEST_F(WebServerTest, ANewClientGetsTheWholeMapAndThenWhatChanges) {
  open();
  if (IsSkipped()) return;
  for (int i = 0; i < 3; ++i) world_->give(*publisher_, 3, {0.1 * i, 0, 0});
  RawClient client(server_->port());
  ASSERT_THAT(client.ask({}), HasSubstr(" 101 "));
  const auto info = client.next();
  ASSERT_TRUE(info);
  EXPECT_EQ(nlohmann::json::parse(info->bytes)["op"], "serverInfo");
  const auto advertised = client.next();
  ASSERT_TRUE(advertised);
  const auto channels = nlohmann::json::parse(advertised->bytes)["channels"];
  ASSERT_EQ(channels.size(), kWebChannels);
  EXPECT_EQ(channels[7]["topic"], "/occupied_cells_vis_array");
  EXPECT_EQ(channels[7]["schemaName"], "visualization_msgs/msg/MarkerArray");
  EXPECT_EQ(channels[7]["encoding"], "cdr");
  EXPECT_EQ(channels[7]["schemaEncoding"], "ros2msg");
  SchemaReader markers(channels[7]["schema"].get<std::string>());

  client.send_text(subscription({WebChannel::voxels}));
  const std::string whole = data_of(client, WebChannel::voxels);
  ASSERT_GT(whole.size(), kMessageHead);
  std::size_t cubes = 0;
  const Decoded all = markers.read(std::string_view(whole).substr(kMessageHead))["markers"];
  for (const Decoded& marker : all.list) cubes += marker["points"].list.size();
  EXPECT_EQ(cubes, world_->map().counts().occupied);
  EXPECT_GT(cubes, 100U);

  world_->give(*publisher_, 3, {0, 5, 0});  // elsewhere
  const std::string change = data_of(client, WebChannel::voxels);
  ASSERT_GT(change.size(), kMessageHead);
  const Decoded news = markers.read(std::string_view(change).substr(kMessageHead))["markers"];
  ASSERT_FALSE(news.list.empty());
  EXPECT_EQ(news.list[0]["action"].number, 0);  // not all anew

  client.send_text(R"({"op":"getParameters"})");
  auto status = client.next();
  while (status && status->binary) status = client.next();
  ASSERT_TRUE(status);
  EXPECT_THAT(status->bytes, HasSubstr("expected subscribe or unsubscribe"));
}

TEST_F(WebServerTest, StampsAndSubscriptionsAreThoseOfTheMessage) {
  open();
  if (IsSkipped()) return;
  RawClient client(server_->port());
  ASSERT_THAT(client.ask({}), HasSubstr(" 101 "));
  std::array<std::uint16_t, kBins> distances{};
  publisher_->take_sectors(distances, {0x0102030405060708});
  client.send_text(subscription({WebChannel::sectors}));
  const std::string message = data_of(client, WebChannel::sectors);
  ASSERT_GE(message.size(), kMessageHead);
  EXPECT_EQ(message.substr(0, kMessageHead), std::string("\1\x6e\0\0\0\x8\7\6\5\4\3\2\1", kMessageHead));
  client.send_text(R"({"op":"unsubscribe","subscriptionIds":[110]})");
  client.send_text(R"({"op":"x"})");  // when this is answered, the other is done
  while (const auto text = client.next())
    if (!text->binary && text->bytes.find("status") != std::string::npos) break;
  publisher_->take_sectors(distances, {1});
  client.send_text(subscription({WebChannel::health}));
  const auto next = client.next();
  ASSERT_TRUE(next);
  EXPECT_EQ(static_cast<int>(next->bytes[1]), 111);
}

double resident_megabytes() {
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("VmRSS:")) return std::stod(line.substr(6)) / 1024;
  return 0;
}

/// Four clients that want everything and read nothing: the mapper keeps no images for them, and when one
/// reads again it gets the newest.
TEST_F(WebServerTest, FrozenClientsCostNoMemoryAndGetTheNewestWhenTheyThaw) {
  open({}, {320, 240});
  if (IsSkipped()) return;
  // What this much of a session takes by itself.
  for (int i = 0; i < 5; ++i) world_->give(*publisher_, 3, {0.02 * i, 0, 0});
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 4; ++i) {
    clients.push_back(std::make_unique<RawClient>(server_->port(), 4096));
    ASSERT_THAT(clients.back()->ask({}), HasSubstr(" 101 "));
    clients.back()->send_text(subscription(
        {WebChannel::camera, WebChannel::depth, WebChannel::sigma, WebChannel::cloud, WebChannel::voxels}));
  }
  ASSERT_TRUE(comes_true([&] { return server_->counts().clients == 4; }));
  // Frames until the server says that they pile up for nobody: each of the clients has its message to read.
  std::size_t given = 0;
  double before = 0;
  ASSERT_TRUE(comes_true([&] {
    world_->give(*publisher_, 3, {0.1, 0, 0});
    ++given;
    if (given == 20) before = resident_megabytes();
    return given > 60 && server_->counts().dropped > 100;
  })) << server_->counts().dropped;
  EXPECT_LT(resident_megabytes() - before, 4 * 16);

  // A client that has just become free gets the next frame, not one that nobody kept: frames go on coming.
  std::atomic<bool> over{false};
  std::thread mapper([&] {
    while (!over) {
      world_->give(*publisher_, 5, {0.1, 0, 0});
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  RawClient& thawed = *clients[0];
  float seen = 0;
  for (int i = 0; i < 20 && seen != 5; ++i) {
    const std::string message = data_of(thawed, WebChannel::depth);
    EXPECT_FALSE(message.empty());
    if (message.empty()) break;
    const std::string schema = io::message_definition("sensor_msgs/Image", io::MessageEncoding::cdr);
    const Decoded depth = SchemaReader(schema).read(std::string_view(message).substr(kMessageHead));
    seen = reinterpret_cast<const float*>(depth["data"].text.data())[120 * 320 + 200];
  }
  over = true;
  mapper.join();
  EXPECT_EQ(seen, 5.0F);
  // What was passed over stays counted when they leave.
  const std::size_t dropped = server_->counts().dropped;
  clients.clear();
  EXPECT_TRUE(comes_true([&] { return server_->counts().clients == 0; }));
  EXPECT_GE(server_->counts().dropped, dropped);
}

TEST_F(WebServerTest, ClosesClientsThatSendTooMuchOrNonsense) {
  open();
  if (IsSkipped()) return;
  RawClient flood(server_->port());
  ASSERT_THAT(flood.ask({}), HasSubstr(" 101 "));
  flood.send_text(std::string(200'000, 'x'));
  EXPECT_TRUE(flood.is_closed());
  RawClient broken(server_->port());
  ASSERT_THAT(broken.ask({}), HasSubstr(" 101 "));
  broken.give("\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff");
  EXPECT_TRUE(broken.is_closed());
  RawClient noise(server_->port());
  noise.give("\x16\x03\x01\x02garbage\r\n\r\n");
  EXPECT_TRUE(noise.is_closed());
  // It goes on for others.
  EXPECT_THAT(answer({}), HasSubstr(" 101 "));
}

TEST_F(WebServerTest, EightClientsAreEnough) {
  open();
  if (IsSkipped()) return;
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 8; ++i) {
    clients.push_back(std::make_unique<RawClient>(server_->port()));
    ASSERT_THAT(clients.back()->ask({}), HasSubstr(" 101 "));
  }
  EXPECT_THAT(answer({}), HasSubstr(" 503 "));
  clients.pop_back();
  EXPECT_TRUE(comes_true([&] { return answer({}).find(" 101 ") != std::string::npos; }));
}

TEST_F(WebServerTest, APortThatIsTakenIsSaid) {
  open();
  if (IsSkipped()) return;
  WebOptions options;
  options.port = server_->port();
  const auto second = WebServer::start(options, *publisher_);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message,
              HasSubstr(fmt::format("cannot listen at 127.0.0.1 port {}", server_->port())));
}

}  // namespace
}  // namespace pade::live
