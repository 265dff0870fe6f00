// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "drivers/camera/v4l2/video_devices.h"
#include "rt/base/words.h"
#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {

/// A depth camera by the ids of its USB device.
struct KnownCamera {
  std::uint16_t vendor;
  std::uint16_t product;  ///< kAnyProduct: all of the vendor
  const char* name;
  const char* obstacle;  ///< why hapticd cannot use it; empty: it can
};

inline constexpr std::uint16_t kAnyProduct = 0;

/// Returns the depth camera with these ids; null for other devices.
const KnownCamera* knownCamera(std::uint16_t vendor, std::uint16_t product);

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
  /// Where the settings come from: "/etc/hapticd/hapticd.yaml", "as the running hapticd uses it (SOCKET)".
  std::string configuration;
  std::string state;  ///< of the camera that a running hapticd uses: "streaming"; empty: none runs
};

/// Returns the depth format of a video device, 0 for none. Errors: it cannot be opened or does not respond.
using DepthProbe = std::function<base::Result<std::uint32_t>(const drivers::VideoDevice&)>;

/// Opens video devices of this machine, which also works while another program streams from them.
base::Result<std::uint32_t> depthFormatOf(const drivers::VideoDevice& video);

/// A video device from which a running hapticd streams, as it reports it.
struct HeldCamera {
  std::string node;    ///< "/dev/video2"; empty: none
  std::string format;  ///< "Z16"
};

/// `probe`: none where the devices belong to another machine; then the first node of a known depth camera is
/// taken for its depth. held: is not opened, and neither are the other nodes of its device.
CameraList listCameras(const Machine& machine, const config::CameraSettings& settings,
                       const DepthProbe& probe, const HeldCamera& held = {});

/// The list for people, a line for each camera and one for the source.
std::string textOf(const CameraList& list);

/// The list for programs.
std::string jsonOf(const CameraList& list);

}  // namespace hapticd::tools
