// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/client_message.h"

#include <gtest/gtest.h>

#include <string>

namespace hapticd::tools::view {
namespace {

TEST(ClientMessage, AsksForSoManyDepthFramesASecond) {
  const auto message = parseClientMessage(R"({"type":"depth","maxHz":12.5})");
  ASSERT_TRUE(message && std::holds_alternative<DepthRate>(*message));
  EXPECT_EQ(std::get<DepthRate>(*message).max_hz, 12.5);
  EXPECT_EQ(std::get<DepthRate>(*parseClientMessage(R"({"type":"depth","maxHz":0})")).max_hz, 0);
}

TEST(ClientMessage, ReportsThatAFrameHasBeenDrawn) {
  const auto message = parseClientMessage(R"({"type":"drawn"})");
  ASSERT_TRUE(message);
  EXPECT_TRUE(std::holds_alternative<Drawn>(*message));
}

TEST(ClientMessage, IsNothingWhereItIsNoneOfTheProtocol) {
  for (const std::string& text : std::vector<std::string>{
           "", "{", "[]", "null", "1", R"("depth")", "{}", R"({"type":1})", R"({"type":"engage"})",
           R"({"type":"depth"})", R"({"type":"depth","maxHz":"30"})", R"({"type":"depth","maxHz":-1})",
           R"({"type":"depth","maxHz":1e9})", R"({"type":"depth","maxHz":1e999})",
           R"({"type":"depth","maxHz":null})", "{\"type\":\"drawn\"}\x01", "{\"type\":\"dr\xff\"}",
           std::string(4096, '['), std::string(2048, '[') + std::string(2048, ']')}) {
    EXPECT_FALSE(parseClientMessage(text)) << text;
  }
}

}  // namespace
}  // namespace hapticd::tools::view
