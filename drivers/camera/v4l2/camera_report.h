// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/settings/settings.h"
#include "drivers/camera/v4l2/pinhole.h"
#include "drivers/camera/v4l2/video_devices.h"
#include "rt/base/parameters.h"

namespace hapticd::drivers {

/// State of a stereo camera's projector.
enum class Emitter { unchanged, off, on, automatic };
constexpr auto wordsOf(Emitter) {
  return rt::words<Emitter>("unchanged", "off", "on", "auto");
}
/// Role of a camera among those whose exposures are synchronised by cable.
enum class SyncRole { unchanged, standalone, master, slave, full_slave };
constexpr auto wordsOf(SyncRole) {
  return rt::words<SyncRole>("unchanged", "standalone", "master", "slave", "full_slave");
}

/// A camera that the kernel drives, for the driver `v4l2`.
struct V4l2Settings {
  std::string device;  ///< name in /dev/v4l/by-id, or a path; empty: by serial number, or the first one found
  int rate_hz = 30;
  Emitter emitter = Emitter::unchanged;
  int exposure_us = 0;  ///< 0: unchanged
  int preset = 0;       ///< 0: unchanged
  SyncRole sync_role = SyncRole::unchanged;
};

inline constexpr std::uint16_t kRealSenseVendor = 0x8086;
inline constexpr std::uint16_t kOrbbecVendor = 0x2bc5;

/// What a camera reports of itself.
struct CameraReport {
  std::optional<Pinhole> pinhole;    ///< of the chosen mode
  std::optional<double> baseline_m;  ///< of a stereo camera
  std::optional<double> unit_m;
  std::string firmware;
  std::string serial;
  std::string problem;  ///< why something above is missing; empty: nothing is
};

/// Asks an opened camera for its calibration, and sets it as configured: depth unit, emitter, exposure,
/// preset and synchronisation. Cameras of unknown vendors are not asked. Errors: the camera is gone or does
/// not respond; it delivers disparities; a configured setting is refused.
base::Result<CameraReport> prepareCamera(const OpenDevice& device, std::uint16_t vendor,
                                         const config::CameraSettings& settings);

/// Returns the temperature of the camera's processor in degrees Celsius, if it reports one.
std::optional<double> temperatureOf(const OpenDevice& device, std::uint16_t vendor);

/// A camera's model for the core, and what the user should know of it.
struct CompletedModel {
  rt::DepthModelParameters model;
  std::string advice;
};

/// Combines the configuration and the camera's report to the model of frames of this size.
/// Errors: neither has intrinsics or a depth unit.
base::Result<CompletedModel> completedModel(const config::CameraSettings& settings,
                                            const CameraReport& report, std::uint16_t vendor);

}  // namespace hapticd::drivers
