// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::tools {

/// For its life, Ctrl-C and SIGTERM do not end the process but are remembered, so that whoever works in steps
/// can put things in order first. One at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// Thread: any.
  bool requested() const noexcept;
};

}  // namespace hapticd::tools
