// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/settings/driver_rows.h"
#include "config/settings/row_of_member.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_thread.h"

namespace hapticd::drivers {

/// A Novint Falcon.
struct FalconHandleSettings {
  std::string firmware;       ///< path of the firmware image
  double force_share = 0.25;  ///< fraction of the motor counts per newton that other drivers send
};

// Columns: as those of the table (config/settings/parameter_table.cpp).
// clang-format off
inline constexpr auto kFalconHandleRows = std::to_array<config::Parameter>({
    config::row<HAPTICD_OWN_MEMBER(handle, FalconHandleSettings, firmware)>(
        "falcon_handle.firmware", config::Effect::restart, "", {}, "",
        "path of the firmware image, which is licensed by Novint and not part of hapticd"),
    config::row<HAPTICD_OWN_MEMBER(handle, FalconHandleSettings, force_share)>(
        "falcon_handle.force_share", config::Effect::restart, "", {0.01, 1}, "",
        "fraction of the motor counts per newton that other drivers send; calibrate with a scale before raising it"),
});
// clang-format on

inline constexpr config::HandleDriver kFalconHandle{
    .word = "falcon",
    .help = "a Novint Falcon, whose firmware image is Novint's and not part of hapticd",
    .parameters = kFalconHandleRows,
    .position_step_m = 4e-5,  // a count turns a thigh of 60 mm by 0.64 mrad
    .check =
        [](const config::Settings& settings, std::vector<config::Conflict>& conflicts) {
          if (settings.handle.driver != "falcon" ||
              !settings.handle.of<FalconHandleSettings>().firmware.empty())
            return;
          config::addConflict(conflicts, {"falcon_handle.firmware", "handle.driver"},
                              "is empty, and the handle.driver falcon needs it",
                              "set falcon_handle.firmware to the path of the image in Novint's driver");
        },
    .needs =
        [](const config::HandleSettings& handle) {
          return std::vector<config::Need>{
              config::FileNeed{.noun = "firmware",
                               .path = handle.of<FalconHandleSettings>().firmware,
                               .remedy = "put the device's firmware there and set falcon_handle.firmware"},
              config::UsbNeed{"Falcon", "0403", "cb48", "plug it in, and its own power supply"}};
        }};

std::unique_ptr<Handle> makeFalconHandle(const config::HandleSettings& settings,
                                         const rt::HandleScaleParameters& scale,
                                         const HandleThreadPolicy& policy);

}  // namespace hapticd::drivers
