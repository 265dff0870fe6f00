// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "config/error.h"
#include "config/settings.h"
#include "drivers/camera/v4l2/video_devices.h"
#include "rt/words.h"
#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {

/// What a connected camera is to hapticd with its configuration.
enum class Suitability : std::uint8_t {
  used,      ///< hapticd uses it, or would
  usable,    ///< with another configuration
  unusable,  ///< it delivers no depth, needs its vendor's software, or cannot be opened
};
constexpr auto wordsOf(Suitability) {
  return rt::words<Suitability>("used", "usable", "unusable");
}

/// A camera on USB or a video device of another kind.
struct ConnectedCamera {
  Suitability suitability = Suitability::unusable;
  std::string name;       ///< of the product, or as the device calls itself
  std::string place;      ///< "/dev/video2", or "045e:02ae at 1-1.2"
  std::string driver;     ///< the driver of hapticd for it; empty: there is none
  std::string usb;        ///< its place in the tree of hubs, "1-1.2"; empty: not on USB
  std::string serial;     ///< of the USB device; may be empty
  std::string format;     ///< of its depth, "Z16"; empty: none, or not examined
  bool is_known = false;  ///< as a depth camera, by the ids of its USB device
  std::string note;       ///< why hapticd does not use it, or what to set so that it does; may be empty
};

/// The connected cameras, and the source of depth that hapticd takes with its configuration.
struct CameraList {
  std::vector<ConnectedCamera> cameras;
  std::string source;   ///< "/dev/video2", "the recording FOLDER"; empty: none of the connected cameras
  std::string problem;  ///< why there is no source, and what to do; empty: there is one
};

/// Returns the depth format of a video device, 0 for none. Errors: it cannot be opened or does not respond.
using DepthProbe = std::function<config::Result<std::uint32_t>(const drivers::VideoDevice&)>;

/// Opens video devices of this machine, which also works while another program streams from them.
config::Result<std::uint32_t> depthFormatOf(const drivers::VideoDevice& video);

/// `probe`: none where the devices belong to another machine; then the first node of a known depth camera is
/// taken for its depth.
CameraList listCameras(const Machine& machine, const config::CameraSettings& settings,
                       const DepthProbe& probe);

/// The list for people, a line for each camera and one for the source.
std::string textOf(const CameraList& list);

/// The list for programs.
std::string jsonOf(const CameraList& list);

}  // namespace hapticd::tools
