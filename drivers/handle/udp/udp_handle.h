// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "config/settings/settings.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_thread.h"
#include "drivers/handle/udp/udp_settings.h"

namespace hapticd::drivers::udp {

/// Limits a thread that anybody on the network can keep busy to half of a CPU, even at a real-time priority.
/// Thread: one.  Progress: wait-free.
class CpuBudget {
 public:
  /// Length of a window of work and rest. Measurements and commands are exchanged once per millisecond.
  static constexpr std::int64_t kWindowNs = 2'000'000;

  /// Returns how long to rest now; 0: not at all. `worked_ns`: CPU time of the thread so far; `now_ns`:
  /// CLOCK_MONOTONIC.
  std::int64_t restNs(std::int64_t worked_ns, std::int64_t now_ns) {
    if (now_ns - window_begin_ns_ >= kWindowNs) {
      window_begin_ns_ = now_ns;
      worked_before_ns_ = worked_ns;
      return 0;
    }
    return worked_ns - worked_before_ns_ > kWindowNs / 2 ? window_begin_ns_ + kWindowNs - now_ns : 0;
  }

 private:
  std::int64_t window_begin_ns_ = 0;
  std::int64_t worked_before_ns_ = 0;
};

}  // namespace hapticd::drivers::udp

namespace hapticd::drivers {

/// A handle on another computer, connected by the packets of protocol.md: present while a bridge there sends
/// valid states, lost 100 ms after the last one. Packets from anyone except the configured peer are rejected.
///
/// Packets from others cannot keep a CPU busy, even though the thread may have real-time priority: CpuBudget
/// makes it rest.
///
/// Errors of check() and start(): an invalid address or peer, a key file that cannot be used. An address or
/// port that is not available yet is not an error: the driver tries again every second.
class UdpHandle final : public WorkerHandle {
 public:
  UdpHandle(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
            const HandleThreadPolicy& policy = {});
};

std::unique_ptr<Handle> makeUdpHandle(const config::HandleSettings& settings,
                                      const rt::HandleScaleParameters& scale,
                                      const HandleThreadPolicy& policy);

}  // namespace hapticd::drivers
