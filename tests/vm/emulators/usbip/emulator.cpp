// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/emulator.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usb/ch9.h>
#include <linux/usbip.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

#include "rt/base/clock.h"

namespace hapticd::test::usbip {
namespace {

constexpr unsigned kFirstDevice = 1U << 16 | 2U;  // bus 1, device 2 of the pretended other side

std::unexpected<base::Error> refuse(const std::filesystem::path& file, int failure) {
  const bool absent = failure == ENOENT;
  const bool forbidden = failure == EACCES || failure == EPERM;
  return std::unexpected(base::Error{file.string(), std::strerror(failure),
                                     absent      ? "load the kernel module: modprobe vhci_hcd"
                                     : forbidden ? "run as root"
                                                 : ""});
}

/// Writes an attribute in one write, as sysfs requires. Returns 0 or an errno.
int writeAttribute(const std::filesystem::path& file, const std::string& text) {
  const int attribute = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
  if (attribute < 0) return errno;
  const ssize_t written = ::write(attribute, text.data(), text.size());
  const int failure = written < 0 ? errno : 0;
  ::close(attribute);
  return failure;
}

}  // namespace

std::vector<unsigned> freeHighSpeedPorts(std::string_view status) {
  std::vector<unsigned> ports;
  std::istringstream lines{std::string(status)};
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    std::string hub;
    unsigned port = 0;
    int state = 0;
    if (fields >> hub >> port >> state && hub == "hs" && state == VDEV_ST_NULL) ports.push_back(port);
  }
  return ports;
}

base::Result<unsigned> attachToVhci(const std::filesystem::path& vhci, int socket) {
  std::ifstream file(vhci / "status");
  if (!file) return refuse(vhci / "status", errno);
  std::stringstream status;
  status << file.rdbuf();
  int failure = EBUSY;
  for (const unsigned port : freeHighSpeedPorts(status.str())) {
    // another emulator may be faster
    failure = writeAttribute(
        vhci / "attach", fmt::format("{} {} {} {}", port, socket, kFirstDevice + port, int{USB_SPEED_HIGH}));
    if (failure == 0) return port;
    if (failure != EBUSY && failure != EINVAL) break;
  }
  if (failure != EBUSY) return refuse(vhci / "attach", failure);
  return std::unexpected(base::Error{(vhci / "status").string(), "no high-speed port is free",
                                     "end another emulator, or load vhci_hcd with more ports"});
}

base::Result<void> detachFromVhci(const std::filesystem::path& vhci, unsigned port) {
  const int failure = writeAttribute(vhci / "detach", std::to_string(port));
  if (failure != 0) return refuse(vhci / "detach", failure);
  return {};
}

Emulator::Emulator(UsbDevice& device, EmulatorOptions options, Log log)
    : device_(device),
      options_(std::move(options)),
      log_(std::move(log)),
      timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)) {}

Emulator::~Emulator() {
  unplug();
  ::close(timer_);
}

base::Result<void> Emulator::run(int stop) {
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

base::Result<void> Emulator::plug() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return std::unexpected(base::Error{"socketpair", std::strerror(errno), ""});
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
