// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::tools {

/// While the object exists, Ctrl-C and SIGTERM do not end the process but are remembered, so that work in
/// steps can be finished properly. Only one object at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// Returns whether a signal has arrived.  Thread: any.
  bool requested() const noexcept;
};

}  // namespace hapticd::tools
