// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/descriptor.h"

namespace hapticd::drivers {

/// For its life, keeps the CPUs out of sleep states that take time to wake up from, if this process may
/// (the kernel's PM QoS interface, /dev/cpu_dma_latency).
/// Thread: any.  RT: not safe.
class IdleLatencyLimit {
 public:
  IdleLatencyLimit();

  bool held() const noexcept { return held_; }

 private:
  config::Descriptor device_;
  bool held_ = false;
};

}  // namespace hapticd::drivers
