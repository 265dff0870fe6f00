// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/phantom_omni/fire_wire.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>

#include "tools/lib/device/outside_call.h"

namespace hapticd::tools::phantom_omni {
namespace {

constexpr nodeaddr_t kDeviceAt = 0x1006000c;
constexpr nodeaddr_t kSerialAt = 0x10060010;
constexpr std::uint32_t kOmni = 0x000b9900;  // the upper 24 bits are SensAble's
constexpr nodeid_t kLocalBus = 1023 << 6;
constexpr int kMostPorts = 16;

/// A node of the kernel that this user may not open; empty: none.
std::string deniedNode() {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", ignored)) {
    const bool fire_wire = entry.path().filename().string().starts_with("fw");
    if (fire_wire && ::access(entry.path().c_str(), R_OK | W_OK) != 0) return entry.path().string();
  }
  return {};
}

/// Why there is no device, where `error` is errno of the library, or 0.
base::Error notThere(const std::string& what, int error) {
  std::string denied = deniedNode();
  if (denied.empty() && (error == EACCES || error == EPERM)) denied = "/dev/fw*";
  if (!denied.empty()) {
    return {denied, "this user may not open it",
            "permit the nodes of the card and of the device by a udev rule as in 73-vendor-handles.rules"};
  }
  return {"FireWire", error == 0 ? what : fmt::format("{}: {}", what, std::strerror(error)),
          "plug it in and switch it on; the kernel's driver is firewire-ohci"};
}

std::optional<std::uint32_t> quadletAt(raw1394_handle* handle, nodeid_t node, nodeaddr_t address) {
  quadlet_t quadlet = 0;
  const OutsideCall call("raw1394_read");
  if (raw1394_read(handle, node, address, sizeof quadlet, &quadlet) != 0) return std::nullopt;
  return ntohl(quadlet);
}

/// The serial number of the Omni at a node; nothing: it is none.
std::optional<std::string> serialAt(raw1394_handle* handle, nodeid_t node) {
  if (quadletAt(handle, node, kDeviceAt) != kOmni) return std::nullopt;
  const auto packed = quadletAt(handle, node, kSerialAt);
  return packed ? std::optional(serialText(*packed)) : std::nullopt;
}

std::optional<OmniNode> omniOnPort(raw1394_handle* handle, const std::string& serial) {
  const int nodes = raw1394_get_nodecount(handle);
  for (int i = 0; i < nodes; ++i) {
    const auto node = static_cast<nodeid_t>(kLocalBus | i);
    const auto found = serialAt(handle, node);
    if (found && (serial.empty() || *found == serial)) return OmniNode{0, node, *found};
  }
  return std::nullopt;
}

std::string nameOf(const std::string& serial) {
  return serial.empty() ? "no Phantom Omni is there"
                        : fmt::format("no Phantom Omni with serial number {} is there", serial);
}

}  // namespace

std::string serialText(std::uint32_t packed) {
  return fmt::format("{:1}{:02}{:02}{:1}{:05}", packed >> 23 & 0x7, packed >> 19 & 0xf, packed >> 14 & 0x1f,
                     packed >> 11 & 0x7, packed >> 1 & 0x3ff);
}

base::Result<FireWire> openPort(int port) {
  errno = 0;
  FireWire handle(raw1394_new_handle());
  if (!handle) return std::unexpected(notThere("cannot be used", errno));
  errno = 0;
  std::array<raw1394_portinfo, kMostPorts> ports{};
  if (raw1394_get_port_info(handle.get(), ports.data(), kMostPorts) <= port)
    return std::unexpected(notThere("there is no port", 0));
  if (raw1394_set_port(handle.get(), port) != 0)
    return std::unexpected(notThere(fmt::format("port {} cannot be opened", port), errno));
  return handle;
}

base::Result<OmniNode> findOmni(const std::string& serial) {
  errno = 0;
  const FireWire handle(raw1394_new_handle());
  if (!handle) return std::unexpected(notThere("cannot be used", errno));
  std::array<raw1394_portinfo, kMostPorts> infos{};
  const int ports = std::min(raw1394_get_port_info(handle.get(), infos.data(), kMostPorts), kMostPorts);
  if (ports <= 0) return std::unexpected(notThere("there is no port", 0));
  std::optional<base::Error> first;
  for (int port = 0; port < ports; ++port) {
    const auto opened = openPort(port);
    if (!opened) {
      if (!first) first = opened.error();
      continue;
    }
    if (auto found = omniOnPort(opened->get(), serial)) {
      found->port = port;
      return *found;
    }
  }
  return std::unexpected(first ? *first : notThere(nameOf(serial), 0));
}

base::Result<nodeid_t> nodeOf(raw1394_handle* handle, const std::string& serial) {
  const auto found = omniOnPort(handle, serial);
  if (!found) return std::unexpected(notThere(nameOf(serial), 0));
  return found->node;
}

}  // namespace hapticd::tools::phantom_omni
