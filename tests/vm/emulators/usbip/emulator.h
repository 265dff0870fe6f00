// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "tests/vm/emulators/usbip/connection.h"
#include "tests/vm/emulators/usbip/control_socket.h"

namespace hapticd::test::usbip {

/// The kernel's folder for the virtual host controller.
inline constexpr const char* kVhciFolder = "/sys/devices/platform/vhci_hcd.0";

/// The free high-speed ports that a `status` file of vhci_hcd lists.
std::vector<unsigned> freeHighSpeedPorts(std::string_view status);

/// Hands a connected stream socket to the kernel as a device on the first free high-speed port; returns the
/// port. The kernel holds a reference of its own from then on.
/// Errors: no vhci_hcd, no free port, refused by the kernel.
base::Result<unsigned> attachToVhci(const std::filesystem::path& vhci, int socket);

/// Unplugs the device of a port.  Errors: refused by the kernel, for example because nothing is there.
base::Result<void> detachFromVhci(const std::filesystem::path& vhci, unsigned port);

struct EmulatorOptions {
  std::filesystem::path vhci;     ///< folder of the virtual host controller
  std::filesystem::path control;  ///< path of the control socket; empty: none
};

/// A device on a port of vhci_hcd, served until somebody stops it: one loop over the kernel, the control
/// socket and the clock, so nothing is locked and requests and replies keep their order. Commands: those of
/// the device, `unplug`, `replug`, `status`.
class Emulator {
 public:
  /// `device` outlives it.
  Emulator(UsbDevice& device, EmulatorOptions options, Log log);
  ~Emulator();
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;

  /// Serves until `stop` (a file descriptor) becomes readable, then unplugs the device and removes the
  /// control socket.  Errors: the socket or the port cannot be had.
  base::Result<void> run(int stop);

 private:
  base::Result<void> plug();
  void unplug();
  void serveUntil(int stop);
  void serveHost(bool readable);
  void armTimer();
  std::string answer(std::string_view line);
  std::string status() const;

  UsbDevice& device_;
  EmulatorOptions options_;
  Log log_;
  UrbCounts counts_;
  std::unique_ptr<ControlSocket> control_;
  std::optional<Connection> connection_;
  int kernels_end_ = -1;  // of the socket; the kernel has a reference of its own
  unsigned port_ = 0;
  int timer_ = -1;
};

}  // namespace hapticd::test::usbip
