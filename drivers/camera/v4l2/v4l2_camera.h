// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "config/settings/depth_cameras.h"
#include "config/settings/driver_rows.h"
#include "config/settings/row_of_member.h"
#include "drivers/camera/camera_worker.h"
#include "drivers/camera/v4l2/camera_report.h"
#include "drivers/camera/v4l2/video_devices.h"

namespace hapticd::drivers {

/// Driver of depth cameras that the kernel drives (formats Z16 and Y16), without a vendor's library. While
/// the camera is absent or lost, the driver searches for it once a second. stop() waits at most 3 s for
/// a thread that waits in the kernel for a camera's answer; the thread then ends by itself.
class V4l2Camera final : public WorkerCamera {
 public:
  explicit V4l2Camera(const config::CameraSettings& settings,
                      std::shared_ptr<SystemCalls> calls = std::make_shared<KernelCalls>(),
                      std::filesystem::path root = "/");
};

// Columns: as those of the table (config/settings/parameter_table.cpp).
// clang-format off
inline constexpr auto kV4l2Rows = std::to_array<config::Parameter>({
    config::row<HAPTICD_OWN_MEMBER(camera, V4l2Settings, device)>(
        "camera.device", config::Effect::restart, "", {}, "",
        "device of the driver v4l2: a name in /dev/v4l/by-id or a path such as /dev/video2; empty: by camera.serial, or the first depth camera found"),
    config::row<HAPTICD_OWN_MEMBER(camera, V4l2Settings, rate_hz)>(
        "camera.rate_hz", config::Effect::restart, "Hz", {5, 300}, "",
        "frames per second, for the driver v4l2"),
    config::row<HAPTICD_OWN_MEMBER(camera, V4l2Settings, emitter)>(
        "camera.emitter", config::Effect::restart, "", {}, "",
        "projector of a stereo camera, for the driver v4l2; unchanged: left as it is"),
    config::row<HAPTICD_OWN_MEMBER(camera, V4l2Settings, exposure_us)>(
        "camera.exposure_us", config::Effect::restart, "us", {0, 200000}, "",
        "exposure time, for the driver v4l2; 0: left as it is, usually automatic"),
    config::row<HAPTICD_OWN_MEMBER(camera, V4l2Settings, preset)>(
        "camera.preset", config::Effect::restart, "", {0, 255}, "",
        "number of a preset of the camera, for the driver v4l2; 0: left as it is"),
    config::row<HAPTICD_OWN_MEMBER(camera, V4l2Settings, sync_role)>(
        "camera.sync_role", config::Effect::restart, "", {}, "",
        "role of the camera among those that are synchronised by cable, for the driver v4l2; unchanged: left as it is"),
});
// clang-format on

/// Returns the camera as far as the configuration determines it; the driver completes it with what the camera
/// reports.
inline rt::DepthModelParameters configuredModel(const config::CameraSettings& camera) {
  const config::FrameSize size = config::sizeOf(camera, config::kStereoSize);
  rt::DepthModelParameters model = camera.configuredDepthModel();
  model.width_px = size.width_px;
  model.height_px = size.height_px;
  model.law = rt::DepthLawKind::linear;
  if (camera.unit_um > 0) model.unit_m = camera.unit_um * 1e-6;
  model.raw_no_measurement = 0;
  model.raw_values = 65536;
  model.principle = rt::DepthPrinciple::active_stereo;
  return model;
}

inline constexpr config::CameraDriver kV4l2Camera{
    .word = "v4l2",
    .help =
        "a depth camera that the kernel drives: RealSense D400, Orbbec Gemini 330 and others with Z16 or Y16",
    .parameters = kV4l2Rows,
    .depth_model =
        [](const config::CameraSettings& camera) { return std::optional(configuredModel(camera)); },
    .unit_is_open = [](const config::CameraSettings& camera) { return camera.unit_um == 0; },
    .rate_hz =
        [](const config::CameraSettings& camera) {
          return static_cast<double>(camera.of<V4l2Settings>().rate_hz);
        }};

std::unique_ptr<Camera> makeV4l2Camera(const config::CameraSettings& settings);

}  // namespace hapticd::drivers
