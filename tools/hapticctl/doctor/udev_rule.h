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
  bool masked = false;  ///< empty, which switches off a file of the same name
};

/// The files that udev reads, sorted by name. Of several with one name it reads that of the administrator,
/// else that of this boot, else that of a package. Errors: a folder of rules that cannot be read.
Reading<std::vector<RulesFile>> rulesFiles(const Machine& machine);

/// A rule that lets everyone use a Kinect.
struct OpenRule {
  std::string file;
  bool final = false;  ///< set with ":=", so that no later rule changes it
};

/// The rules of a file that name a Kinect by its ids and let everyone use it. A rule that matches it in
/// another way is not recognised.
std::vector<OpenRule> openKinectRules(const Machine& machine, const RulesFile& file);

/// Whether a rule of the file gives a HID device to the group hapticd by its name on the HID bus.
/// `id`: HID_ID of the device's uevent, as in "0003:0000046D:0000C626". `is_handle`: the configuration names
/// the device, which a rule may ask a program.
bool givesHidDevice(const Machine& machine, const RulesFile& file, const std::string& id, bool is_handle);

}  // namespace hapticd::tools
