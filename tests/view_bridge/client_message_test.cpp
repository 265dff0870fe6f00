// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/client_message.h"

#include <gtest/gtest.h>

#include <string>

namespace hapticd::tools::view {
namespace {

template <typename Request>
const Request* playback(const std::optional<ClientMessage>& message) {
  const auto* request = message ? std::get_if<PlaybackRequest>(&*message) : nullptr;
  return request != nullptr ? std::get_if<Request>(request) : nullptr;
}

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

TEST(ClientMessage, ControlsThePlaybackOfARecording) {
  EXPECT_NE(playback<Play>(parseClientMessage(R"({"type":"play"})")), nullptr);
  EXPECT_NE(playback<Pause>(parseClientMessage(R"({"type":"pause","more":1})")), nullptr);
  const auto seek = parseClientMessage(R"({"type":"seek","s":3.25})");
  ASSERT_NE(playback<Seek>(seek), nullptr);
  EXPECT_EQ(playback<Seek>(seek)->s, 3.25);
  const auto step = parseClientMessage(R"({"type":"step","frames":-2})");
  ASSERT_NE(playback<Step>(step), nullptr);
  EXPECT_EQ(playback<Step>(step)->frames, -2);
  const auto speed = parseClientMessage(R"({"type":"factor","factor":0.5})");
  ASSERT_NE(playback<Speed>(speed), nullptr);
  EXPECT_EQ(playback<Speed>(speed)->factor, 0.5);
}

TEST(ClientMessage, IsNothingWhereItIsNoneOfTheProtocol) {
  for (const char* text : {"",
                           "{",
                           "[]",
                           "null",
                           "1",
                           R"("depth")",
                           "{}",
                           R"({"type":1})",
                           R"({"type":"engage"})",
                           R"({"type":"depth"})",
                           R"({"type":"depth","maxHz":"30"})",
                           R"({"type":"depth","maxHz":-1})",
                           R"({"type":"depth","maxHz":1e9})",
                           R"({"type":"depth","maxHz":null})",
                           R"({"type":"seek"})",
                           R"({"type":"seek","s":-0.1})",
                           R"({"type":"seek","s":1e300})",
                           R"({"type":"seek","s":1e999})",
                           R"({"type":"step","frames":0.5})",
                           R"({"type":"step","frames":1e12})",
                           R"({"type":"factor","factor":0})",
                           R"({"type":"factor","factor":101})",
                           "{\"type\":\"play\"}\x01",
                           "{\"type\":\"pl\xff\"}"}) {
    EXPECT_FALSE(parseClientMessage(text)) << text;
  }
}

TEST(ClientMessage, OfTheLargestDepthIsRefusedWithoutHarm) {
  EXPECT_FALSE(parseClientMessage(std::string(4096, '[')));
  EXPECT_FALSE(parseClientMessage(std::string(2048, '[') + std::string(2048, ']')));
}

}  // namespace
}  // namespace hapticd::tools::view
