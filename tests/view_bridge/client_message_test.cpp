// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/client_message.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

// What is a request is tested by what a session makes of it (live_session_test.cpp).
namespace hapticd::tools::view {
namespace {

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
