// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/vhci_port.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usb/ch9.h>
#include <linux/usbip.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

namespace hapticd::test::usbip {
namespace {

constexpr unsigned kFirstDevice = 1U << 16 | 2U;  // bus 1, device 2 of the pretended other side

std::unexpected<config::Error> refuse(const std::filesystem::path& file, int failure) {
  const bool absent = failure == ENOENT;
  const bool forbidden = failure == EACCES || failure == EPERM;
  return std::unexpected(config::Error{file.string(), std::strerror(failure),
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

config::Result<unsigned> attachToVhci(const std::filesystem::path& vhci, int socket) {
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
  return std::unexpected(config::Error{(vhci / "status").string(), "no high-speed port is free",
                                       "end another emulator, or load vhci_hcd with more ports"});
}

config::Result<void> detachFromVhci(const std::filesystem::path& vhci, unsigned port) {
  const int failure = writeAttribute(vhci / "detach", std::to_string(port));
  if (failure != 0) return refuse(vhci / "detach", failure);
  return {};
}

}  // namespace hapticd::test::usbip
