// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "config/base/error.h"
#include "rt/base/parameters.h"

namespace hapticd::drivers {

/// Name of the file that describes the camera in the folder of a recording.
inline constexpr const char* kCameraFile = "camera.yaml";

/// The camera of a recording.
struct CameraDescription {
  rt::DepthModelParameters camera;  ///< near_m and far_m have their defaults
  std::optional<double> near_m;     ///< the camera itself measures nothing nearer
  std::optional<double> far_m;      ///< the camera itself measures nothing farther
  std::string serial;               ///< empty: not known

  friend bool operator==(const CameraDescription&, const CameraDescription&) = default;
};

/// Reads a file of the form that README.md describes.
/// Errors: name the line or the parameter, and the remedy. The camera then can be modelled, except that
/// near_m and far_m of a configuration may leave none of its depths.
/// Thread: any.  RT: not safe.
base::Result<CameraDescription> readCameraDescription(const std::filesystem::path& file);

/// Returns the text of such a file; numbers read back to the same bits.
std::string textOf(const CameraDescription& description);

}  // namespace hapticd::drivers
