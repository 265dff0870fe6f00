#pragma once

#include "daemon/control/descriptor.h"

namespace hapticd::daemon {

/// For its life, keeps the CPUs out of sleep states that take time to wake up from, if this process may
/// (the kernel's PM QoS interface, /dev/cpu_dma_latency).
class IdleLatencyLimit {
 public:
  IdleLatencyLimit();

  bool held() const noexcept { return static_cast<bool>(device_); }

 private:
  Descriptor device_;
};

}  // namespace hapticd::daemon
