// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "config/base/error.h"
#include "config/settings/parameter_table.h"
#include "config/settings/settings.h"

/// What a camera or handle driver states of itself: all that the rest of the program needs to know of it.
/// Each driver states it in its folder; drivers/driver_table.h is the table. A function that a driver leaves
/// out is that of a driver to which nothing special applies.
namespace hapticd::config {

/// A violated rule between parameters whose individual values are all in range.
struct Conflict {
  /// Names of the parameters that the rule involves, the most likely cause first.
  std::vector<std::string_view> parameters;
  base::Error error;  ///< where: the first parameter
};

/// Adds a violated rule; the first of its parameters is the place of the error.
inline void addConflict(std::vector<Conflict>& conflicts, std::vector<std::string_view> parameters,
                        std::string what, std::string remedy) {
  base::Error error{std::string(parameters.front()), std::move(what), std::move(remedy)};
  conflicts.push_back({std::move(parameters), std::move(error)});
}

/// A file that a driver reads.
struct FileNeed {
  std::string noun;  ///< "firmware"
  std::string path;  ///< empty: none is configured
  std::string remedy;
  bool optional = false;  ///< the driver works if none is configured
  bool secret = false;    ///< nobody but the daemon may read it
};
/// A UDP port of this computer.
struct PortNeed {
  int port;
  std::string_view parameter;
};
/// A HID device.
struct HidNeed {
  std::string device;  ///< "046d:c626"
  std::string_view parameter;
};
/// A device that is driven through libusb.
struct UsbNeed {
  std::string_view name;
  std::string_view vendor;  ///< four hexadecimal digits
  std::string_view product;
  std::string remedy;
};
/// Something of this computer that a driver needs; `hapticctl doctor` has a check for each kind.
using Need = std::variant<FileNeed, PortNeed, HidNeed, UsbNeed>;

/// Rate of a camera whose rate is not configured.
inline constexpr double kUsualFrames_hz = 30;

/// A camera driver. Without `depth_model` the camera delivers the raw disparities of a Kinect v1.
struct CameraDriver {
  std::string_view word;  ///< as in camera.driver
  std::string_view help;  ///< one line for users: the source of the frames, without a full stop
  std::span<const Parameter> parameters = {};
  bool stands_in = false;  ///< for a device: its parameters are for tests and demonstrations
  /// Returns the camera as far as the configuration determines it, if it delivers depth.
  std::optional<rt::DepthModelParameters> (*depth_model)(const CameraSettings&) = [](const CameraSettings&) {
    return std::optional<rt::DepthModelParameters>();
  };
  /// Whether the camera's own depth unit is known only when it has been opened.
  bool (*unit_is_open)(const CameraSettings&) = [](const CameraSettings&) { return false; };
  /// Frames per second.
  double (*rate_hz)(const CameraSettings&) = [](const CameraSettings&) { return kUsualFrames_hz; };
  /// Adds what is wrong with the settings, also while another driver is chosen.
  void (*check)(const Settings&, std::vector<Conflict>&) = [](const Settings&, std::vector<Conflict>&) {};
  /// Returns what the frames come from, for people; empty: a camera that is connected.
  std::string (*source)(const CameraSettings&) = [](const CameraSettings&) { return std::string(); };
};

/// A handle driver.
struct HandleDriver {
  std::string_view word;  ///< as in handle.driver
  std::string_view help;  ///< one line for users: the device, without a full stop
  std::span<const Parameter> parameters = {};
  bool stands_in = false;  ///< for a device: its parameters are for tests and demonstrations
  /// Whether a person may lead its simulated hand through the control API; never with a real device.
  bool (*follows_person)(const HandleSettings&) = [](const HandleSettings&) { return false; };
  /// Whether the device exerts forces; its thread then has real-time priority.
  bool (*exerts_force)(const HandleSettings&) = [](const HandleSettings&) { return true; };
  /// Step of the positions that the device measures, which the driver's thread interpolates; 0: unknown or
  /// none.
  double position_step_m = 0;
  /// Mass of the lightest device behind the driver, at the hand; that of the lightest desktop styluses
  /// (Phantom Omni) where any device may be behind it.
  double (*device_mass_kg)(const HandleSettings&) = [](const HandleSettings&) { return 0.045; };
  /// Adds what is wrong with the settings, also while another driver is chosen.
  void (*check)(const Settings&, std::vector<Conflict>&) = [](const Settings&, std::vector<Conflict>&) {};
  /// Returns what is allowed but probably unintended.
  std::optional<base::Error> (*warning)(const HandleSettings&) = [](const HandleSettings&) {
    return std::optional<base::Error>();
  };
  /// What the driver needs of this computer, for `hapticctl doctor`; empty: there is no device.
  std::vector<Need> (*needs)(const HandleSettings&) = [](const HandleSettings&) {
    return std::vector<Need>();
  };
};

/// The rows of drivers/driver_table.h, in its order. They are defined there, and CMake links them to
/// whatever links this library.
std::span<const CameraDriver> cameraDrivers();
std::span<const HandleDriver> handleDrivers();

/// Returns the row of the chosen driver, which must be one of the table.
const CameraDriver& driverOf(const CameraSettings& settings);
const HandleDriver& driverOf(const HandleSettings& settings);

}  // namespace hapticd::config

/// The accessor of a member of a driver's own settings for row(), as HAPTICD_MEMBER: of `camera` or `handle`.
#define HAPTICD_OWN_MEMBER(device, Own, path)       \
  [](auto& settings) -> auto& {                     \
    return settings.device.template of<Own>().path; \
  }
