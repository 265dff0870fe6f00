// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/emulator.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "rt/clock.h"
#include "tests/vm/emulators/usbip/vhci_port.h"

namespace hapticd::test::usbip {

Emulator::Emulator(UsbDevice& device, EmulatorOptions options, Log log)
    : device_(device),
      options_(std::move(options)),
      log_(std::move(log)),
      timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)) {}

Emulator::~Emulator() {
  unplug();
  ::close(timer_);
}

config::Result<void> Emulator::run(int stop) {
  if (!options_.control.empty()) {
    auto control = ControlSocket::listen(options_.control);
    if (!control) return std::unexpected(control.error());
    control_ = std::move(*control);
  }
  auto plugged = plug();
  if (plugged) serveUntil(stop);
  unplug();
  control_.reset();
  return plugged;
}

config::Result<void> Emulator::plug() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return std::unexpected(config::Error{"socketpair", std::strerror(errno), ""});
  }
  const auto port = attachToVhci(options_.vhci, ends[1]);
  if (!port) {
    ::close(ends[0]);
    ::close(ends[1]);
    return std::unexpected(port.error());
  }
  kernels_end_ = ends[1];
  port_ = *port;
  connection_.emplace(ends[0], device_, counts_, log_);
  log_(fmt::format("attached to port {}", port_));
  return {};
}

void Emulator::unplug() {
  if (!connection_) return;
  if (connection_->isAlive()) {
    if (auto detached = detachFromVhci(options_.vhci, port_); !detached) log_(detached.error().text());
  }
  connection_.reset();
  ::close(kernels_end_);
  log_(fmt::format("unplugged from port {}: {} URBs, {} unlinked in time, {} too late", port_,
                   counts_.submitted, counts_.unlinked, counts_.unlinked_late));
}

void Emulator::serveUntil(int stop) {
  for (;;) {
    armTimer();
    // poll() leaves out negative descriptors
    std::array<pollfd, 4> waiting{{{stop, POLLIN, 0},
                                   {timer_, POLLIN, 0},
                                   {control_ ? control_->readable() : -1, POLLIN, 0},
                                   {connection_ ? connection_->socket() : -1, POLLIN, 0}}};
    if (::poll(waiting.data(), waiting.size(), -1) < 0 && errno != EINTR) return;
    if (waiting[0].revents != 0) return;
    if (waiting[2].revents != 0) control_->serve([this](std::string_view line) { return answer(line); });
    serveHost(waiting[3].revents != 0);
  }
}

void Emulator::serveHost(bool readable) {
  if (!connection_) return;
  if (readable) connection_->receive();
  if (connection_->isAlive()) device_.work(rt::monotonicNow_ns(), *connection_);
  if (!connection_->isAlive()) unplug();
}

/// Sets the timer to an absolute time, so that the device's clock does not drift. This revokes an earlier
/// expiry.
void Emulator::armTimer() {
  const auto due_ns = connection_ ? device_.due_ns(*connection_) : std::nullopt;
  itimerspec when{};
  if (due_ns) {
    when.it_value.tv_sec = *due_ns / 1'000'000'000;
    when.it_value.tv_nsec = *due_ns % 1'000'000'000;
  }
  ::timerfd_settime(timer_, TFD_TIMER_ABSTIME, &when, nullptr);
}

std::string Emulator::answer(std::string_view line) {
  if (line == "status") return status();
  log_("told: " + std::string(line));
  if (line == "unplug") {
    if (!connection_) return "error: it is unplugged already";
    unplug();
    return "ok";
  }
  if (line == "replug") {
    if (connection_) return "error: it is plugged in already";
    const auto plugged = plug();
    return plugged ? "ok" : "error: " + plugged.error().text();
  }
  const std::string said = device_.command(line);
  if (said == "ok") return said;
  return fmt::format("{}; allowed: unplug, replug, status, {}", said, device_.commands());
}

std::string Emulator::status() const {
  return fmt::format(
      R"({{"attached":{},"port":{},"configured":{},"urbs":{},"pending":{},"unlinked":{},"unlinked_late":{},{}}})",
      connection_.has_value(), port_, connection_ && connection_->isConfigured(), counts_.submitted,
      connection_ ? connection_->pending() : 0, counts_.unlinked, counts_.unlinked_late, device_.status());
}

}  // namespace hapticd::test::usbip
