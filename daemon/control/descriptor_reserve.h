// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "config/descriptor.h"

namespace hapticd::daemon {

/// Limits on the number of simultaneous connections.
struct ConnectionLimits {
  std::size_t all = 0;
  std::size_t per_user = 0;
};

/// All connections that a server keeps.
struct ServerLimits {
  ConnectionLimits read;
  ConnectionLimits control;
  std::size_t lingering = 0;  ///< that got their final reply
};

/// Returns `limits`, or less where the process may have only `descriptors` more: what is left to files and
/// devices must suffice for them, and no user may take all places.
ServerLimits limitsWithin(const ServerLimits& limits, std::size_t descriptors);

/// How many more descriptors the process may open by its limit (RLIMIT_NOFILE).
std::size_t freeDescriptors();

/// Descriptors that are kept open, to be given up when a connection must be accepted and the process may open
/// no more.  Thread: one.
class DescriptorReserve {
 public:
  /// Holds none yet.
  explicit DescriptorReserve(std::size_t size) : size_(size) {}

  std::size_t held() const noexcept { return held_.size(); }
  /// Gives one up; does nothing if none is held.
  void release() {
    if (!held_.empty()) held_.pop_back();
  }
  /// Opens as many again as the system allows.
  void refill();

 private:
  std::size_t size_;
  std::vector<config::Descriptor> held_;
};

}  // namespace hapticd::daemon
