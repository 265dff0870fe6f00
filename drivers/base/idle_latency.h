// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/base/descriptor.h"

namespace hapticd::drivers {

/// While it exists, keeps the CPUs out of sleep states with a long wake-up latency, if this process is
/// permitted to (the kernel's PM QoS interface, /dev/cpu_dma_latency).
/// Thread: any.  RT: not safe.
class IdleLatencyLimit {
 public:
  IdleLatencyLimit();

  /// Returns whether the limit is in effect.
  bool held() const noexcept { return held_; }

 private:
  base::Descriptor device_;
  bool held_ = false;
};

}  // namespace hapticd::drivers
