// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace hapticd::tools {

/// Processes that flood a socket of the daemon from construction to destruction: each of their connections
/// sends as many calls as go without waiting, hangs up without having read anything, and connects again. As
/// root they run as another user, else as this one.
class Flood {
 public:
  Flood(const std::string& socket, int connections);
  ~Flood();
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;

  /// Whether all processes are still running.
  bool isRunning() const;

 private:
  std::vector<pid_t> processes_;
};

}  // namespace hapticd::tools
