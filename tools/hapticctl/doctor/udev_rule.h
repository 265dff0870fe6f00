// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {

/// A file of udev rules that is in force.
struct RulesFile {
  std::string name;     ///< "72-hapticd.rules"; udev reads the files in the order of their names
  std::string path;     ///< without the leading slash
  bool masked = false;  ///< empty: put there to switch off one of the same name
};

/// The files that udev reads, by name: of several with one name, that of the administrator, then that of this
/// boot, then the package's. Errors: a folder of them that is there and cannot be read.
Reading<std::vector<RulesFile>> rulesFiles(const Machine& machine);

/// A rule that lets everyone use a Kinect.
struct OpenRule {
  std::string file;
  bool final = false;  ///< set so that no later rule changes it
};

/// Of a file's rules those that name a Kinect by its ids and give everyone a right to it. A rule that finds
/// it in another way is not recognised.
std::vector<OpenRule> openKinectRules(const Machine& machine, const RulesFile& file);

/// Whether a rule of the file gives a HID device to the group hapticd by its name on the HID bus.
/// `id`: HID_ID of the device's uevent, as in "0003:0000046D:0000C626".
bool givesHidDevice(const Machine& machine, const RulesFile& file, const std::string& id);

}  // namespace hapticd::tools
