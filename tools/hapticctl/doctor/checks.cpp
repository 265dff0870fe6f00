// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/checks.h"

#include <algorithm>
#include <array>

#include "rt/base/realtime_thread.h"
#include "rt/loop/loop_state.h"

namespace hapticd::tools {

Findings examine(const Examination& box) {
  static constexpr std::array kChecks{
      checkKernel,   checkClock,    checkThrottling,    checkIsolation, checkCpuKind,       checkInterrupts,
      checkSibling,  checkGovernor, checkIdleStates,    checkCpuQuota,  checkMemory,        checkLimits,
      checkAccounts, checkCaller,   checkConfiguration, checkUdevRules, checkOtherRules,    checkKinect,
      checkCameras,  checkHid,      checkGpio,          checkHandle,    checkVendorHandles, checkTraces,
      checkStorage,  checkGnuplot,  checkService,       checkDaemon};
  Findings all;
  for (const auto check : kChecks) {
    for (Finding& finding : check(box)) all.push_back(std::move(finding));
  }
  return all;
}

namespace {

constexpr std::uint64_t kMib = 1U << 20U;

// measured with the synthetic camera, see daemon_memory_test: what the daemon maps, against the size of the
// images and grid.point_capacity
constexpr std::uint64_t kProgram = 65 * kMib;
constexpr std::uint64_t kPerPoint = 145;
constexpr std::uint64_t kPerPixel = 90;

/// Camera, handle, scene, force, trace and the limit of its folder.
constexpr std::uint64_t kThreads = 6;

// of the recorder of raw depth
constexpr std::uint64_t kFramesWaiting = 8;
constexpr std::uint64_t kBytesPerPixel = 2;
constexpr std::uint64_t kCompressedWaiting = 36 * kMib;

}  // namespace

MemoryNeed memoryNeed(const config::Settings& settings) {
  const rt::DepthModelParameters camera = settings.camera.effectiveDepthModel();
  const std::uint64_t pixels = static_cast<std::uint64_t>(std::max(camera.width_px, 0)) *
                               static_cast<std::uint64_t>(std::max(camera.height_px, 0));
  const auto points = static_cast<std::uint64_t>(settings.grid.point_capacity);
  const bool has_leds = settings.leds.driver != config::LedDriver::none;
  const bool depth = settings.trace.depth;
  MemoryNeed need;
  need.program = kProgram;
  need.stacks = (kThreads + (has_leds ? 1 : 0) + (depth ? 1 : 0)) * rt::kThreadStackBytes;
  need.points = points * kPerPoint;
  need.frames = pixels * kPerPixel;
  need.ticks =
      static_cast<std::uint64_t>(settings.trace.flight_recorder_s * settings.loop.rate_hz) * sizeof(rt::Tick);
  if (depth) need.depth = kFramesWaiting * pixels * kBytesPerPixel + kCompressedWaiting;
  return need;
}

}  // namespace hapticd::tools
