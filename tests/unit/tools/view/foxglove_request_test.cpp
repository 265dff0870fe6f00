// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "tools/hapticd-view/foxglove/client_request.h"

namespace hapticd::tools::view {
namespace {

TEST(FoxgloveRequest, SubscriptionsAndTheirEndsAreRead) {
  const auto subscribe = parseFoxgloveRequest(
      R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1},{"id":0,"channelId":9}]})");
  ASSERT_TRUE(subscribe) << subscribe.error();
  const auto& items = std::get<Subscribe>(*subscribe).items;
  ASSERT_EQ(items.size(), 2U);
  EXPECT_EQ(items[0].subscription, 7U);
  EXPECT_EQ(items[0].channel, 1U);
  EXPECT_EQ(items[1].subscription, 0U);
  const auto unsubscribe = parseFoxgloveRequest(R"({"op":"unsubscribe","subscriptionIds":[7,4294967295]})");
  ASSERT_TRUE(unsubscribe) << unsubscribe.error();
  EXPECT_EQ(std::get<Unsubscribe>(*unsubscribe).subscriptions, (std::vector<std::uint32_t>{7, 4294967295U}));
}

TEST(FoxgloveRequest, ParametersAreAskedForByNameAndNumberOfTheRequest) {
  const auto some = parseFoxgloveRequest(R"({"op":"getParameters","parameterNames":["a"],"id":"x"})");
  ASSERT_TRUE(some);
  EXPECT_EQ(std::get<GetParameters>(*some).names, std::vector<std::string>{"a"});
  EXPECT_EQ(std::get<GetParameters>(*some).id, "x");
  const auto all = parseFoxgloveRequest(R"({"op":"getParameters","parameterNames":[]})");
  ASSERT_TRUE(all);
  EXPECT_TRUE(std::get<GetParameters>(*all).names.empty());
  EXPECT_FALSE(std::get<GetParameters>(*all).id);
}

TEST(FoxgloveRequest, UnknownOperationsAreIgnoredAndThoseThatWouldChangeTheBoxRefused) {
  for (const char* op : {"subscribeConnectionGraph", "subscribeParameterUpdates", "fetchAsset", "x", ""}) {
    const auto request = parseFoxgloveRequest(std::string(R"({"op":")") + op + "\"}");
    ASSERT_TRUE(request) << op;
    EXPECT_TRUE(std::holds_alternative<Ignored>(*request)) << op;
  }
  for (const char* op : {"setParameters", "advertise"}) {
    const auto request = parseFoxgloveRequest(std::string(R"({"op":")") + op + "\"}");
    ASSERT_TRUE(request) << op;
    EXPECT_EQ(std::get<Refused>(*request).operation, op);
  }
}

TEST(FoxgloveRequest, WhatIsNoRequestIsAnError) {
  for (const char* text :
       {"", "{", "null", "[]", "7", R"({"op":7})", "{}", R"({"op":"subscribe","subscriptions":[{"id":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[3]})", R"({"op":"unsubscribe","subscriptionIds":["1"]})",
        R"({"op":"getParameters","parameterNames":[1]})", "\xff\xfe"}) {
    EXPECT_FALSE(parseFoxgloveRequest(text)) << text;
  }
}

}  // namespace
}  // namespace hapticd::tools::view
