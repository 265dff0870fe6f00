// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/device/threaded_device.h"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <cstdio>
#include <optional>

#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"
#include "tools/lib/device/outside_call.h"

namespace hapticd::tools {

ThreadedDevice::~ThreadedDevice() {
  exchange_.command({}, rt::monotonicNow_ns());
  stop_.raise();
  if (thread_.joinable()) thread_.join();
  watch_ends_.raise();
  if (watch_thread_.joinable()) watch_thread_.join();
}

base::Result<void> ThreadedDevice::start() {
  auto thread = drivers::startThread("device", [this] { run(); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  auto watching = drivers::startThread("device-watch", [this] { watch(); });
  if (!watching) return std::unexpected(watching.error());
  watch_thread_ = std::move(*watching);
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

void ThreadedDevice::watch() {
  constexpr std::chrono::milliseconds kLook{250};
  std::optional<OutsideCall::Lasting> said;
  while (!watch_ends_.waitUntil(std::chrono::steady_clock::now() + kLook)) {
    const auto hangs = OutsideCall::hanging();
    const bool same = hangs && said && hangs->since_ns == said->since_ns;
    if (same) continue;
    const auto say = [&](const OutsideCall::Lasting& call, const char* what) {
      const std::string text = fmt::format("{} {} {:.1f} s", call.name, what,
                                           static_cast<double>(rt::monotonicNow_ns() - call.since_ns) * 1e-9);
      fmt::print(stderr, "{}: {}\n", name_, text);
      ::sd_notify(0, ("STATUS=" + text).c_str());
    };
    if (said) say(*said, "has returned after about");
    if (hangs) say(*hangs, "hangs: the device gets no new force until it returns; it has lasted for");
    said = hangs;
  }
}

}  // namespace hapticd::tools
