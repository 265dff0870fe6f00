// SPDX-License-Identifier: Apache-2.0
#include "daemon/injection/fault_injector.h"

#include <limits>
#include <utility>

#include "daemon/injection/faulty_camera.h"
#include "daemon/injection/faulty_handle.h"
#include "rt/clock.h"

namespace hapticd::daemon {

void FaultInjector::start() {
  start_ns_ = rt::monotonicNow_ns();
}

bool FaultInjector::isOn(Fault fault) const noexcept {
  const std::int64_t start_ns = start_ns_.load(std::memory_order_relaxed);
  if (start_ns == 0) return false;
  const double now_s = static_cast<double>(rt::monotonicNow_ns() - start_ns) * 1e-9;
  for (const ScriptedFault& scripted : script_) {
    const double since_s = now_s - scripted.begin.count();
    if (scripted.fault == fault && since_s >= 0 && since_s < scripted.duration.count()) return true;
  }
  return false;
}

std::string FaultInjector::notice() const {
  std::string on;
  for (int number = 0; number < kFaultCount; ++number) {
    const auto fault = static_cast<Fault>(number);
    if (isOn(fault)) on += (on.empty() ? "" : ", ") + std::string(nameOf(fault));
  }
  return "faults are injected, do not hold the handle; now: " + (on.empty() ? std::string("none") : on);
}

std::unique_ptr<drivers::Camera> FaultInjector::around(std::unique_ptr<drivers::Camera> camera) {
  return std::make_unique<FaultyCamera>(std::move(camera), *this);
}

std::unique_ptr<drivers::Handle> FaultInjector::around(std::unique_ptr<drivers::Handle> handle) {
  return std::make_unique<FaultyHandle>(std::move(handle), *this);
}

}  // namespace hapticd::daemon
