// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "config/settings/settings.h"
#include "tools/hapticctl/doctor/examination.h"
#include "tools/hapticctl/doctor/findings.h"

namespace hapticd::tools {

// Each check examines one thing and returns at least one finding, whatever it can or cannot read.

// kernel_checks.cpp
Findings checkKernel(const Examination& box);
Findings checkClock(const Examination& box);
Findings checkThrottling(const Examination& box);
Findings checkMemory(const Examination& box);

// cpu_checks.cpp
Findings checkIsolation(const Examination& box);
Findings checkCpuKind(const Examination& box);
Findings checkInterrupts(const Examination& box);
Findings checkSibling(const Examination& box);
Findings checkGovernor(const Examination& box);
Findings checkIdleStates(const Examination& box);
Findings checkCpuQuota(const Examination& box);

// service_checks.cpp
Findings checkLimits(const Examination& box);
Findings checkAccounts(const Examination& box);
Findings checkCaller(const Examination& box);

// device_checks.cpp
Findings checkUdevRules(const Examination& box);
Findings checkOtherRules(const Examination& box);
Findings checkHid(const Examination& box);

// gpio_check.cpp
Findings checkGpio(const Examination& box);

// camera_check.cpp
Findings checkKinect(const Examination& box);
Findings checkCameras(const Examination& box);

// handle_check.cpp
Findings checkHandle(const Examination& box);

// vendor_handle_check.cpp
Findings checkVendorHandles(const Examination& box);

// storage_check.cpp
Findings checkTraces(const Examination& box);
Findings checkGnuplot(const Examination& box);
Findings checkStorage(const Examination& box);

// service_checks.cpp
Findings checkService(const Examination& box);
Findings checkConfiguration(const Examination& box);
Findings checkDaemon(const Examination& box);

/// The findings of all checks, in the order in which they are shown.
Findings examine(const Examination& box);

/// The memory that hapticd takes, and locks where that is permitted, by what it depends on; in bytes. Sizes
/// of structures and buffers times what the configuration says, and for what lies between them figures that
/// were measured on the running daemon; daemon_memory_test compares the sum with the daemon for several
/// configurations.
struct MemoryNeed {
  std::uint64_t program = 0;  ///< code, libraries, heap, drivers; rings of ticks
  std::uint64_t stacks = 0;   ///< of the threads: locked as a whole
  std::uint64_t points = 0;   ///< grid.point_capacity
  std::uint64_t frames = 0;   ///< depth frames and what is kept of each pixel
  std::uint64_t ticks = 0;    ///< trace.flight_recorder_s
  std::uint64_t depth = 0;    ///< frames that wait for their compression and for the disk, with trace.depth

  std::uint64_t total() const { return program + stacks + points + frames + ticks + depth; }
};

MemoryNeed memoryNeed(const config::Settings& settings);

}  // namespace hapticd::tools
