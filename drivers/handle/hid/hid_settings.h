// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "config/settings/driver_rows.h"
#include "config/settings/row_of_member.h"

namespace hapticd::drivers {

/// Vendor and product id of a HID device.
struct HidId {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;

  bool operator==(const HidId&) const = default;
};

/// Parses "vvvv:pppp", four hexadecimal digits each, as shown by lsusb.
/// Errors (without a place): another form, vendor 0000.
base::Result<HidId> hidIdFrom(std::string_view text);

/// Returns e.g. "046d:c626".
std::string textOf(const HidId& id);

enum class HidKind { controller, spacemouse };
constexpr auto wordsOf(HidKind) {
  return rt::words<HidKind>("controller", "spacemouse");
}

/// A device on USB HID.
struct HidHandleSettings {
  HidKind kind = HidKind::controller;
  std::string device = "1209:0001";  ///< vendor and product id, hexadecimal
  double full_speed_m_per_s = 0.1;   ///< of the HIP, at full deflection of a SpaceMouse
};

// Columns: as those of the table (config/settings/parameter_table.cpp).
// clang-format off
inline constexpr auto kHidHandleRows = std::to_array<config::Parameter>({
    config::row<HAPTICD_OWN_MEMBER(handle, HidHandleSettings, kind)>(
        "hid_handle.kind", config::Effect::restart, "", {}, "",
        "kind of device: a controller with hapticd's reports, or a SpaceMouse, which exerts no force"),
    config::row<HAPTICD_OWN_MEMBER(handle, HidHandleSettings, device)>(
        "hid_handle.device", config::Effect::restart, "", {}, "",
        "USB vendor and product of the handle, hexadecimal, as lsusb shows them"),
    config::row<HAPTICD_OWN_MEMBER(handle, HidHandleSettings, full_speed_m_per_s)>(
        "hid_handle.full_speed_m_per_s", config::Effect::restart, "m/s", {0.001, 1}, "",
        "speed of the HIP at full deflection of a SpaceMouse"),
});
// clang-format on

void checkHidHandle(const config::Settings& settings, std::vector<config::Conflict>& conflicts);

inline constexpr config::HandleDriver kHidHandle{
    .word = "hid",
    .help = "a do-it-yourself controller with hapticd's reports, or a SpaceMouse, which exerts no force",
    .parameters = kHidHandleRows,
    .exerts_force =
        [](const config::HandleSettings& handle) {
          return handle.of<HidHandleSettings>().kind != HidKind::spacemouse;
        },
    .check = checkHidHandle,
    .needs =
        [](const config::HandleSettings& handle) {
          return std::vector<config::Need>{
              config::HidNeed{handle.of<HidHandleSettings>().device, "hid_handle.device"}};
        }};

}  // namespace hapticd::drivers
