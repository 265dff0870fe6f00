// SPDX-License-Identifier: Apache-2.0
// Every surface shows the same list of what is wrong.

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/support/daemon_under_test.h"

namespace hapticd {
namespace {

using test::contains;
using test::Daemon;
using test::DaemonHome;

/// Numbers change from one call to the next.
std::string withoutNumbers(std::string text) {
  std::erase_if(text, [](unsigned char c) { return std::isdigit(c) != 0; });
  return text;
}

class OneList : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(daemon.answers()); }

  std::vector<std::string> inJson() {
    std::vector<std::string> texts;
    const nlohmann::json status = daemon.status();
    for (const auto& text : status.at("warnings")) texts.push_back(withoutNumbers(text));
    return texts;
  }
  /// The lines of the status that begin with "! ".
  std::vector<std::string> inText() {
    std::istringstream lines(home.control({"status", "--all"}).output);
    std::vector<std::string> texts;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("! ")) texts.push_back(withoutNumbers(line.substr(2)));
    }
    return texts;
  }
  std::string inMetrics() {
    const std::string metrics = home.control({"metrics"}).output;
    const std::string name = "\nhapticd_warnings ";
    const std::size_t at = metrics.find(name);
    return at == std::string::npos
               ? "none"
               : metrics.substr(at + name.size(), metrics.find('\n', at + 1) - at - name.size());
  }
  bool isSameEverywhere() {
    return test::becomesTrue([this] {
      const auto list = inJson();
      return inText() == list && inMetrics() == std::to_string(list.size()) && inJson() == list;
    });
  }
  bool warns(const std::string& text) {
    return test::becomesTrue([&] {
      const auto list = inJson();
      return std::ranges::any_of(
          list, [&](const std::string& line) { return line.find(text) != std::string::npos; });
    });
  }

  const DaemonHome home;
  Daemon daemon{home, std::string(test::kWallYaml) + "trace: {min_free_mb: 1000000, at_start: true}\n"};
};

TEST_F(OneList, HasWhatTheDaemonKnowsOfTracesAndPrivileges) {
  EXPECT_TRUE(warns("trace waits: "));
  EXPECT_TRUE(isSameEverywhere());
}

TEST_F(OneList, HasAForceLoopThatWasLate) {
  daemon.signal(SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // 200 periods without a tick
  daemon.signal(SIGCONT);
  EXPECT_TRUE(warns("the force loop is late: "));
  EXPECT_TRUE(isSameEverywhere());
  EXPECT_TRUE(test::becomesTrue([this] {
    return home.control({"events", "--kind", "warning"}).output.find("the force loop is late: ") !=
           std::string::npos;
  }));
}

}  // namespace
}  // namespace hapticd
