// SPDX-License-Identifier: Apache-2.0
// `hapticctl view`: the address of the live picture, with and without a service that serves it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "tests/system/hapticctl/hapticctl_home.h"
#include "tests/system/support/loopback_listener.h"

namespace hapticd::test {
namespace {

constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

class HapticctlView : public testing::Test {
 protected:
  std::string tokenFile() const { return (home.path() / "token").string(); }
  void writeToken(const std::string& text) const { std::ofstream(tokenFile()) << text << '\n'; }
  std::vector<std::string> viewAt(const LoopbackListener& listener) const {
    return {"view", "--port", listener.port(), "--token-file", tokenFile()};
  }
  HapticctlHome home;
};

TEST_F(HapticctlView, PrintsTheAddressesWithTheToken) {
  const LoopbackListener listener;
  writeToken(kToken);
  const Finished shown = home.run(viewAt(listener));
  EXPECT_EQ(shown.ending, exitedWith(0)) << shown.errors;
  const std::string place = "127.0.0.1:" + listener.port() + "/?token=" + kToken;
  EXPECT_TRUE(has(shown.output, " http://" + place + "\n")) << shown.output;
  EXPECT_TRUE(has(shown.output, " ws://" + place + "\n")) << shown.output;
  EXPECT_TRUE(has(shown.output, "ssh -L " + listener.port() + ":127.0.0.1:" + listener.port()))
      << shown.output;

  std::vector<std::string> as_json = viewAt(listener);
  as_json.insert(as_json.begin(), "--json");
  const auto json = nlohmann::json::parse(home.run(as_json).output);
  EXPECT_EQ(json, (nlohmann::json{{"page", "http://" + place}, {"foxglove", "ws://" + place}}));
}

TEST_F(HapticctlView, WaitsForAServiceThatItsConnectionStarts) {
  LoopbackListener listener;
  std::thread service([&] {
    listener.accept();
    writeToken(kToken);
  });
  const Finished shown = home.run(viewAt(listener));
  service.join();
  EXPECT_EQ(shown.ending, exitedWith(0)) << shown.errors;
  EXPECT_TRUE(has(shown.output, kToken));
}

TEST_F(HapticctlView, NamesTheRemedyWhereNobodyListens) {
  LoopbackListener listener;
  const std::vector<std::string> command = viewAt(listener);
  listener.close();
  const Finished shown = home.run(command);
  EXPECT_EQ(shown.ending, exitedWith(3));
  EXPECT_TRUE(has(shown.errors, "systemctl enable --now hapticd-view.socket")) << shown.errors;
}

TEST_F(HapticctlView, NamesAFileThatHoldsNoToken) {
  const LoopbackListener listener;
  for (const char* text : {"", "0123456789ABCDEF0123456789ABCDEF"}) {
    writeToken(text);
    const Finished shown = home.run(viewAt(listener));
    EXPECT_EQ(shown.ending, exitedWith(1)) << text;
    EXPECT_TRUE(has(shown.errors, tokenFile())) << shown.errors;
    EXPECT_EQ(shown.output, "");
  }
}

TEST_F(HapticctlView, NamesTheGroupWhereTheFileMayNotBeRead) {
  if (::geteuid() != 0) GTEST_SKIP() << "takes root, to become another user";
  const LoopbackListener listener;
  writeToken(kToken);
  std::filesystem::permissions(home.path(), std::filesystem::perms(0755));
  std::filesystem::permissions(tokenFile(), std::filesystem::perms(0640));
  const Finished shown = runToEnd(home.command(viewAt(listener)), {.user = 65534});
  EXPECT_EQ(shown.ending, exitedWith(1));
  EXPECT_TRUE(has(shown.errors, "haptic-view")) << shown.errors;
}

TEST_F(HapticctlView, RefusesAPortThatThereIsNot) {
  for (const char* port : {"0", "65536", "-1", "http"})
    EXPECT_EQ(home.run({"view", "--port", port}).ending, exitedWith(2)) << port;
}

}  // namespace
}  // namespace hapticd::test
