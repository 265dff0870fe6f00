// SPDX-License-Identifier: Apache-2.0
#include "tests/view_bridge/bridge_under_test.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/support/file_content.h"

namespace hapticd::test {
namespace {

std::vector<std::string> commandOf(const DaemonHome& home, const TemporaryFolder& folder,
                                   const std::vector<std::string>& options) {
  folder.write("index.html", "<!doctype html><title>the page</title>");
  folder.write("view.js", "let view;");
  std::vector<std::string> command{HAPTICD_VIEW_PROGRAM,
                                   "--socket",
                                   home.statusSocket(),
                                   "--listen",
                                   "127.0.0.1:0",
                                   "--page",
                                   folder.path().string(),
                                   "--token-file",
                                   (folder.path() / "token").string()};
  command.insert(command.end(), options.begin(), options.end());
  return command;
}

/// Of the line "hapticd-view listens at 127.0.0.1:PORT".
int portIn(const std::string& output) {
  const std::size_t begin = output.find("listens at 127.0.0.1:");
  const std::size_t end = output.find('\n', begin);
  if (begin == std::string::npos || end == std::string::npos) return 0;
  return std::stoi(output.substr(output.rfind(':', end) + 1));
}

}  // namespace

BridgeUnderTest::BridgeUnderTest(const DaemonHome& home, const std::vector<std::string>& options)
    : program_(commandOf(home, folder_, options)) {
  const bool listens =
      becomesTrue([&] { return !program_.running() || (port_ = portIn(program_.output())) != 0; });
  if (!listens || port_ == 0) {
    ADD_FAILURE() << "hapticd-view does not listen: " << program_.errors();
    return;
  }
  token_ = contentOf(folder_.path() / "token").substr(0, 32);
}

std::string BridgeUnderTest::goodFields() const {
  return "Host: 127.0.0.1:" + std::to_string(port_) + "\r\nCookie: hapticd-view=" + token_ + "\r\n";
}

std::size_t BridgeUnderTest::residentBytes() const {
  std::ifstream file("/proc/" + std::to_string(program_.pid()) + "/statm");
  std::size_t all = 0;
  std::size_t resident = 0;
  file >> all >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

bool BridgeUnderTest::logs(const std::string& text) {
  const bool logged = becomesTrue([&] { return program_.errors().find(text) != std::string::npos; });
  if (!logged) ADD_FAILURE() << "no \"" << text << "\" in: " << program_.errors();
  return logged;
}

std::string BridgeUnderTest::answerTo(const std::string& request) const {
  RawClient client(port_);
  client.send(request);
  return client.receiveAll();
}

}  // namespace hapticd::test
