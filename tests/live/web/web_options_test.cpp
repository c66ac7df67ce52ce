// Who is let in, and what clients may ask for.
#include "pade/live/web/web_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/live/web/foxglove.hpp"

namespace pade::live {
namespace {

using ::testing::HasSubstr;

constexpr const char* kToken = "0123456789abcdef";

int upgrade_code(const WebRequest& request, const WebOptions& options = {}) {
  return refusal_of_upgrade(request, options).code;
}

TEST(WebGate, LoopbackNeedsNoTokenButItsOwnName) {
  for (const char* host : {"127.0.0.1:8765", "localhost:8765", "[::1]:8765", "127.0.0.1"})
    EXPECT_EQ(upgrade_code({host, "", "", "foxglove.sdk.v1"}), 0) << host;
  // A name of others that leads to this machine: their page and our server would be of one origin.
  for (const char* host : {"evil.example:8765", "127.evil.example:1", "127.0.0.1.evil.example", "",
                           "localhost.evil.example:8765", "192.168.0.7:8765"})
    EXPECT_EQ(upgrade_code({host, "", "", "foxglove.sdk.v1"}), 403) << host;
}

TEST(WebGate, PagesOfOthersAreRefusedUnlessTheyAreNamed) {
  WebOptions options;
  const WebRequest ours{"localhost:8765", "http://localhost:8765", "", "foxglove.sdk.v1"};
  WebRequest theirs = ours;
  theirs.origin = "https://app.foxglove.dev";
  EXPECT_EQ(upgrade_code(ours, options), 0);
  EXPECT_EQ(upgrade_code(theirs, options), 403);
  options.origins = "https://other.example, https://app.foxglove.dev";
  EXPECT_EQ(upgrade_code(theirs, options), 0);
  for (const char* origin :
       {"http://localhost:80", "https://localhost:8765", "null", "http://localhost:8765.evil.example"}) {
    theirs.origin = origin;
    EXPECT_EQ(upgrade_code(theirs, options), 403) << origin;
  }
}

TEST(WebGate, TheTokenIsWhole) {
  WebOptions options;
  options.token = kToken;
  WebRequest request{"192.0.2.7:8765", "http://192.0.2.7:8765", "", "foxglove.sdk.v1"};
  for (const std::string& wrong : {std::string(), std::string("0"), std::string("0123456789abcdeF"),
                                   std::string(kToken) + "0", std::string("0123456789abcde")}) {
    request.token = wrong;
    EXPECT_EQ(upgrade_code(request, options), 401) << wrong;
    EXPECT_EQ(refusal_of_request(request, options).code, 401) << wrong;
  }
  request.token = kToken;
  EXPECT_EQ(upgrade_code(request, options), 0);
  request.origin = "http://evil.example";
  EXPECT_EQ(upgrade_code(request, options), 403);
}

TEST(WebGate, OnlyBothNamesOfTheProtocolAreSpoken) {
  for (const char* known : {"foxglove.sdk.v1", "foxglove.websocket.v1", "x, foxglove.sdk.v1"})
    EXPECT_EQ(upgrade_code({"localhost", "", "", known}), 0) << known;
  for (const char* unknown : {"", "foxglove", "foxglove.sdk.v2", "foxglove.sdk.v1x", "mqtt"})
    EXPECT_EQ(upgrade_code({"localhost", "", "", unknown}), 400) << unknown;
}

TEST(WebGate, WhatComesFromTheNetworkIsQuotedShortAndPlain) {
  const std::string long_one(4000, 'x');
  const Refusal refusal =
      refusal_of_upgrade({"localhost", "http://\x1b[31m" + long_one, "", "foxglove.sdk.v1"}, {});
  EXPECT_LT(refusal.reason.size(), 120U);
  EXPECT_EQ(refusal.reason.find('\x1b'), std::string::npos);
}

TEST(WebOptions, TheNetworkNeedsAToken) {
  const struct {
    WebOptions options;
    const char* named;
  } cases[] = {
      {{8765, "0.0.0.0", "", ""}, "web.token: found none"},
      {{8765, "192.0.2.7", "", ""}, "web.token: found none"},
      {{8765, "0.0.0.0", "short", ""}, "web.token: found 5 characters"},
      {{8765, "0.0.0.0", "0123456789abcde&", ""}, "some of them other ones"},
      {{8765, "localhost", "", ""}, "web.address: found \"localhost\""},
      {{70'000, "127.0.0.1", "", ""}, "web.port"},
      {{8765, "127.0.0.1", "", "foxglove.dev"}, "web.origins: found \"foxglove.dev\""},
      {{8765, "127.0.0.1", "", "https://a.example/"}, "web.origins"},
  };
  for (const auto& c : cases) {
    const Status status = check(c.options);
    ASSERT_FALSE(status) << c.named;
    EXPECT_THAT(status.error().message, HasSubstr(c.named));
  }
  EXPECT_TRUE(check(WebOptions{}));
  EXPECT_TRUE(check(WebOptions{0, "::1", "", ""}));
  EXPECT_TRUE(check(WebOptions{8765, "0.0.0.0", kToken, "https://app.foxglove.dev http://ground:8080"}));
}

TEST(FoxgloveRequest, SubscribesAndUnsubscribes) {
  const auto request = read_client_request(
      R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1},{"id":4294967295,"channelId":12}]})");
  ASSERT_TRUE(request) << request.error().message;
  ASSERT_EQ(request->subscribe.size(), 2U);
  EXPECT_EQ(request->subscribe[0].channel, WebChannel::camera);
  EXPECT_EQ(request->subscribe[1].channel, WebChannel::health);
  EXPECT_EQ(request->subscribe[1].id, 4294967295U);
  const auto less = read_client_request(R"({"op":"unsubscribe","subscriptionIds":[7]})");
  ASSERT_TRUE(less) << less.error().message;
  EXPECT_THAT(less->unsubscribe, ::testing::ElementsAre(7U));
}

TEST(FoxgloveRequest, WhatMakesNoSenseIsNamed) {
  const struct {
    const char* text;
    const char* named;
  } cases[] = {
      {"", "JSON object"},
      {"[]", "JSON object"},
      {"{\"op\":\"subscribe\"", "JSON object"},
      {"{}", "text \"op\""},
      {R"({"op":3})", "text \"op\""},
      {R"({"op":"getParameters"})", "found op \"getParameters\""},
      {R"({"op":"subscribe"})", "list \"subscriptions\""},
      {R"({"op":"subscribe","subscriptions":{}})", "list \"subscriptions\""},
      {R"({"op":"subscribe","subscriptions":[7]})", "id and channelId"},
      {R"({"op":"subscribe","subscriptions":[{"id":1}]})", "id and channelId"},
      {R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})", "id and channelId"},
      {R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})", "id and channelId"},
      {R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":13}]})", "found channelId 13"},
      {R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":0}]})", "found channelId 0"},
      {R"({"op":"unsubscribe","subscriptionIds":["1"]})", "whole numbers"},
      {"{\"op\":\"\xff\"}", "JSON object"},
  };
  for (const auto& c : cases) {
    const auto request = read_client_request(c.text);
    ASSERT_FALSE(request) << c.text;
    EXPECT_THAT(request.error().message, HasSubstr(c.named)) << c.text;
  }
  EXPECT_FALSE(read_client_request(std::string(60'000, '[')));
}

}  // namespace
}  // namespace pade::live
