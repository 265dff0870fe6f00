// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticctl/doctor/cameras.h"
#include "tools/hapticctl/doctor/examination.h"

namespace hapticd::tools {

/// A haptic handle that is connected to this machine, or the software of a vendor that drives one.
struct ConnectedHandle {
  Suitability suitability = Suitability::usable;
  std::string name;    ///< of the product, "Novint Falcon"
  std::string place;   ///< "0403:cb48 at 1-1.2", "/dev/hidraw0", "/dev/fw1"
  std::string driver;  ///< of hapticd: falcon, hid, or udp behind a bridge
  std::string note;    ///< what to do so that hapticd uses it; may be empty
  std::string bridge;  ///< its kind of haptic-bridge; empty: hapticd drives it itself
  std::string node;    ///< its device file, without the leading slash; empty: a service
};

struct HandleList {
  std::vector<ConnectedHandle> handles;
  std::string source;         ///< "hid", the driver that hapticd uses with its configuration
  std::string configuration;  ///< as CameraList::configuration
  std::string state;          ///< of the handle that a running hapticd uses: "present"; empty: none runs
};

/// The handles that the machine of `box` shows by its USB, HID and FireWire devices and by installed
/// services.
HandleList listHandles(const Examination& box);

/// The list for people, a line for each handle.
std::string textOf(const HandleList& list);

/// The list for programs.
std::string jsonOf(const HandleList& list);

}  // namespace hapticd::tools
