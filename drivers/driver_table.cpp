// SPDX-License-Identifier: Apache-2.0
// What the drivers state of themselves, for programs with parameters but without devices: nothing here refers
// to the functions that make the drivers, which need the libraries of the devices.
#include "drivers/driver_table.h"

namespace hapticd::config {
namespace {

template <const auto& kRows>
constexpr auto kDriversOf = [] {
  std::array<decltype(kRows.front().driver), kRows.size()> drivers{};
  for (std::size_t row = 0; row < kRows.size(); ++row) drivers[row] = kRows[row].driver;
  return drivers;
}();

}  // namespace

std::span<const CameraDriver> cameraDrivers() {
  return kDriversOf<drivers::kCameras>;
}

std::span<const HandleDriver> handleDrivers() {
  return kDriversOf<drivers::kHandles>;
}

}  // namespace hapticd::config
