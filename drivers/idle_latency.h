// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::drivers {

/// For its life, keeps the CPUs out of sleep states that take time to wake up from, if this process may
/// (the kernel's PM QoS interface, /dev/cpu_dma_latency).
/// Thread: any.  RT: not safe.
class IdleLatencyLimit {
 public:
  IdleLatencyLimit();
  ~IdleLatencyLimit();
  IdleLatencyLimit(const IdleLatencyLimit&) = delete;
  IdleLatencyLimit& operator=(const IdleLatencyLimit&) = delete;

  bool held() const noexcept { return held_; }

 private:
  int device_;
  bool held_ = false;
};

}  // namespace hapticd::drivers
