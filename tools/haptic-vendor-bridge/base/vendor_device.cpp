// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-vendor-bridge/base/vendor_device.h"

#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"

namespace hapticd::tools {

VendorDevice::~VendorDevice() {
  exchange_.command({}, rt::monotonicNow_ns());
  stop_.raise();
  if (thread_.joinable()) thread_.join();
}

base::Result<void> VendorDevice::start() {
  auto thread = drivers::startThread("device", [this] { run(); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

DeviceReading VendorDevice::read() {
  return exchange_.newest(rt::monotonicNow_ns());
}

void VendorDevice::exert(const DeviceCommand& command) {
  exchange_.command(command, rt::monotonicNow_ns());
}

void VendorDevice::run() {
  std::string said;
  DeviceSession session(exchange_, stop_, name_);
  while (!session.ends()) {
    const auto driven = driver_->drive(session);
    exchange_.close();
    if (session.takeOpened()) said.clear();
    // the same complaint each second would hide all others
    if (!driven && driven.error().text() != said) session.say(said = driven.error().text());
    if (driven) said.clear();
    if (session.pause(kRetry)) return;
  }
}

}  // namespace hapticd::tools
