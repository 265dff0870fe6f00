// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/device/threaded_device.h"

#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"

namespace hapticd::tools {

ThreadedDevice::~ThreadedDevice() {
  exchange_.command({}, rt::monotonicNow_ns());
  stop_.raise();
  if (thread_.joinable()) thread_.join();
}

base::Result<void> ThreadedDevice::start() {
  auto thread = drivers::startThread("device", [this] { run(); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

DeviceReading ThreadedDevice::read() {
  return exchange_.newest(rt::monotonicNow_ns());
}

void ThreadedDevice::exert(const DeviceCommand& command) {
  exchange_.command(command, rt::monotonicNow_ns());
}

DeviceAbout ThreadedDevice::about() const {
  const std::lock_guard lock(about_mutex_);
  return about_;
}

void ThreadedDevice::run() {
  std::string said;
  while (!stop_.raised()) {
    DeviceSession session(exchange_, stop_, name_, [this](const DeviceAbout& about) {
      const std::lock_guard lock(about_mutex_);
      about_ = about;
    });
    const auto driven = driver_->drive(session);
    exchange_.close();
    // the same complaint each second would hide all others
    if (session.wasOpened()) said.clear();
    if (!driven && driven.error().text() != said) session.say(said = driven.error().text());
    if (session.pause(kRetry)) return;
  }
}

}  // namespace hapticd::tools
