// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/base/vec3.h"

namespace hapticd::tools {

/// A movement that the person made, or a push of the device, along one of the person's axes: x to the right,
/// y up, z towards the person.
struct CheckedAxis {
  rt::Vec3 moved_m;               ///< by the person, in the device's axes
  rt::Vec3 pushed_m;              ///< by the device's force, in the device's axes
  bool yields = false;            ///< the handle went where the force pointed
  std::optional<bool> confirmed;  ///< whether the person says so; nothing: was not asked
};

/// Along which axes forces act, as pushes in several orientations of the tool show it.
enum class ForceAxes {
  unknown,  ///< it was not turned
  as_commanded,
  turned,  ///< those of the tool are taken for those of the device, or the reverse
  unclear,
};

/// What the check found of a device; its log is this in JSON.
struct CheckReport {
  std::string version;  ///< of the program
  std::string kind;     ///< of the device, such as force-dimension
  std::string model;
  std::string serial;
  double max_force_n = 0;
  bool measures_orientation = false;
  bool measures_gripper = false;
  double stated_latency_ms = 0;  ///< by the driver
  std::array<CheckedAxis, 3> axes;
  std::array<double, 9> rotation_world_handle{};  ///< row by row, from the movements; zero: not found
  ForceAxes force_axes = ForceAxes::unknown;
  std::optional<double> latency_ms;   ///< from a force until the handle accelerates
  std::optional<double> dead_man_ms;  ///< from the last command until the force ended
  std::vector<std::string> problems;  ///< whole sentences; empty: nothing was found wrong
};

/// The log: one JSON object, whose numbers that are not known are null.
std::string logOf(const CheckReport& report);

/// Reads a log.  Errors: it is not JSON, not of this program, or a member is missing or of another type; the
/// error names it.
base::Result<CheckReport> reportIn(std::string_view log);

/// The report for people, with the settings of the handle's pose that follow from it.
std::string textOf(const CheckReport& report);

/// The angles roll, pitch and yaw in radians of rt::rotationOf() that give a rotation, row by row.
std::array<double, 3> anglesOf(const std::array<double, 9>& rotation);

}  // namespace hapticd::tools
