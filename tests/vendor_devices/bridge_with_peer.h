// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/support/program.h"
#include "tests/vendor_devices/peer.h"

namespace hapticd::test {

/// A haptic-bridge and its peer.
class BridgeWithPeer {
 public:
  Peer& peer() { return peer_; }
  Program& program() { return *program_; }

  /// Starts the program for a kind of device, without limits of its own.
  void launch(const std::string& kind, const std::vector<std::string>& more,
              const std::vector<std::string>& environment) {
    std::vector<std::string> command{HAPTIC_BRIDGE_PROGRAM, kind,          "--peer",
                                     peer_.address(),       "--max-force", "100"};
    command.insert(command.end(), more.begin(), more.end());
    program_.emplace(command, ProgramOptions{.environment = environment});
  }
  bool says(const std::string& text) {
    return becomesTrue([&] { return program_->errors().find(text) != std::string::npos; });
  }
  int timesSaid(const std::string& text) {
    const std::string all = program_->errors();
    int times = 0;
    for (std::size_t at = all.find(text); at != all.npos; at = all.find(text, at + 1)) ++times;
    return times;
  }
  /// Waits for that many more states.
  bool passStates(std::uint64_t count) {
    const std::uint64_t until = peer_.states() + count;
    return becomesTrue([&] { return peer_.states() >= until; });
  }
  template <typename Condition>
  bool stateBecomes(Condition condition) {
    return becomesTrue([&] { return condition(peer_.state()); });
  }

 private:
  Peer peer_;
  std::optional<Program> program_;
};

}  // namespace hapticd::test
