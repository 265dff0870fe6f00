// SPDX-License-Identifier: Apache-2.0
#include "drivers/base/idle_latency.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdint>

namespace hapticd::drivers {

IdleLatencyLimit::IdleLatencyLimit() : device_(::open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC)) {
  // The kernel respects the value for as long as the descriptor is open.
  const std::int32_t longest_wakeup_us = 0;
  held_ = device_ &&
          ::write(device_.get(), &longest_wakeup_us, sizeof longest_wakeup_us) == sizeof longest_wakeup_us;
}

}  // namespace hapticd::drivers
