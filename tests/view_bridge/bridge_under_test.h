// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/view_bridge/web_socket_peer.h"

namespace hapticd::test {

/// hapticd-view, running beside the box of a DaemonHome, with a page and a token of its own.
class BridgeUnderTest {
 public:
  explicit BridgeUnderTest(const DaemonHome& home, const std::vector<std::string>& options = {});

  /// The port that it listens at; 0 (and a failed test): it does not.
  int port() const { return port_; }
  const std::string& token() const { return token_; }
  /// "/live?token=..."
  std::string liveTarget() const { return "/live?token=" + token_; }
  /// "Host: 127.0.0.1:PORT\r\nCookie: hapticd-view=...\r\n"
  std::string goodFields() const;
  Program& program() { return program_; }
  /// What it holds in memory, bytes.
  std::size_t residentBytes() const;
  /// Waits until it has logged that.
  bool logs(const std::string& text);

  /// The whole answer to a request.
  std::string answerTo(const std::string& request) const;

 private:
  TemporaryFolder folder_;
  Program program_;
  int port_ = 0;
  std::string token_;
};

}  // namespace hapticd::test
