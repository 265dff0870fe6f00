// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "config/error.h"

namespace hapticd::test::usbip {

/// The kernel's folder for the virtual host controller.
inline constexpr const char* kVhciFolder = "/sys/devices/platform/vhci_hcd.0";

/// The free high-speed ports that a `status` file of vhci_hcd lists.
std::vector<unsigned> freeHighSpeedPorts(std::string_view status);

/// Hands a connected stream socket to the kernel as a device on the first free high-speed port; returns the
/// port. The kernel holds a reference of its own from then on.
/// Errors: no vhci_hcd, no free port, refused by the kernel.
config::Result<unsigned> attachToVhci(const std::filesystem::path& vhci, int socket);

/// Unplugs the device of a port.  Errors: refused by the kernel, for example because nothing is there.
config::Result<void> detachFromVhci(const std::filesystem::path& vhci, unsigned port);

}  // namespace hapticd::test::usbip
