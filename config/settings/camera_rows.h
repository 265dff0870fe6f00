// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "config/settings/parameter_rows.h"
#include "config/settings/parameter_table.h"

namespace hapticd::config {

/// A little more than pi, so that pi is accepted however it was rounded.
inline constexpr double kHalfTurn = 3.1416;

/// The rows of the group `camera`.
inline constexpr auto kCameraRows = [] {
  constexpr Effect kRestart = Effect::restart;
  // Columns: name, effect, unit, {minimum, maximum}, the paper's symbol, help. All rows have the same shape.
  // clang-format off
  return std::to_array<Parameter>({
    row<HAPTICD_MEMBER(camera.driver)>(
        "camera.driver", kRestart, "", {}, "",
        "source of the depth frames"),
    row<HAPTICD_MEMBER(camera.serial)>(
        "camera.serial", kRestart, "", {}, "",
        "serial number of the camera to use; empty: the first one found"),
    row<HAPTICD_MEMBER(camera.v4l2.device)>(
        "camera.device", kRestart, "", {}, "",
        "device of the driver v4l2: a name in /dev/v4l/by-id or a path such as /dev/video2; empty: by camera.serial, or the first depth camera found"),
    row<HAPTICD_MEMBER(camera.v4l2.width_px)>(
        "camera.width_px", kRestart, "px", {0, 1280}, "",
        "width of the frames, 160 or more, for the driver v4l2 and for synthetic cameras other than a Kinect v1; 0: 848, or 640 for time_of_flight"),
    row<HAPTICD_MEMBER(camera.v4l2.height_px)>(
        "camera.height_px", kRestart, "px", {0, 800}, "",
        "height of the frames, 100 or more, for the driver v4l2 and for synthetic cameras other than a Kinect v1; 0: 480, or 576 for time_of_flight"),
    row<HAPTICD_MEMBER(camera.v4l2.rate_hz)>(
        "camera.rate_hz", kRestart, "Hz", {5, 300}, "",
        "frames per second, for the driver v4l2"),
    row<HAPTICD_MEMBER(camera.v4l2.intrinsics)>(
        "camera.intrinsics", kRestart, "", {}, "",
        "intrinsics of the same cameras: those that the camera reports, or fx_px, fy_px, cx_px and cy_px"),
    row<HAPTICD_MEMBER(camera.v4l2.unit_um)>(
        "camera.unit_um", kRestart, "um", {0, 10000}, "",
        "depth unit of the same cameras; 0: 100 um where the camera can be set to it and the range allows it, otherwise its own"),
    row<HAPTICD_MEMBER(camera.v4l2.emitter)>(
        "camera.emitter", kRestart, "", {}, "",
        "projector of a stereo camera, for the driver v4l2; unchanged: left as it is"),
    row<HAPTICD_MEMBER(camera.v4l2.exposure_us)>(
        "camera.exposure_us", kRestart, "us", {0, 200000}, "",
        "exposure time, for the driver v4l2; 0: left as it is, usually automatic"),
    row<HAPTICD_MEMBER(camera.v4l2.preset)>(
        "camera.preset", kRestart, "", {0, 255}, "",
        "number of a preset of the camera, for the driver v4l2; 0: left as it is"),
    row<HAPTICD_MEMBER(camera.v4l2.sync_role)>(
        "camera.sync_role", kRestart, "", {}, "",
        "role of the camera among those that are synchronised by cable, for the driver v4l2; unchanged: left as it is"),
    row<HAPTICD_MEMBER(live.camera.latency_s)>(
        "camera.latency_s", kRestart, "s", {0, 0.2}, "",
        "time from exposure to arrival of a frame; laws that predict motion extrapolate the surface by it"),
    row<HAPTICD_MEMBER(camera.depth_law)>(
        "camera.depth_law", kRestart, "", {}, "",
        "coefficients of the depth conversion: Table I, libfreenect's, or depth_a_per_m and depth_b_per_m"),
    row<HAPTICD_MEMBER(camera.depth_model.a_per_m)>(
        "camera.depth_a_per_m", kRestart, "1/m", {-1, 1}, "a",
        "change of 1/Z per raw unit, for the depth law custom"),
    row<HAPTICD_MEMBER(camera.depth_model.b_per_m)>(
        "camera.depth_b_per_m", kRestart, "1/m", {-10, 10}, "b",
        "1/Z at the raw value 0, for the depth law custom"),
    row<HAPTICD_MEMBER(camera.depth_model.near_m)>(
        "camera.near_m", kRestart, "m", {0.07, 10}, "",
        "nearer measurements are rejected"),
    row<HAPTICD_MEMBER(camera.depth_model.far_m)>(
        "camera.far_m", kRestart, "m", {0.1, 10}, "",
        "farther measurements are rejected"),
    row<HAPTICD_MEMBER(camera.depth_model.fx_px)>(
        "camera.fx_px", kRestart, "px", {100, 2000}, "f_x",
        "focal length, horizontal"),
    row<HAPTICD_MEMBER(camera.depth_model.fy_px)>(
        "camera.fy_px", kRestart, "px", {100, 2000}, "f_y",
        "focal length, vertical"),
    row<HAPTICD_MEMBER(camera.depth_model.cx_px)>(
        "camera.cx_px", kRestart, "px", {0, 1280}, "c_x",
        "optical centre, from the left"),
    row<HAPTICD_MEMBER(camera.depth_model.cy_px)>(
        "camera.cy_px", kRestart, "px", {0, 800}, "c_y",
        "optical centre, from the top"),
    row<HAPTICD_MEMBER(camera.depth_model.noise.c0_m)>(
        "camera.noise_c0_m", kRestart, "m", {0, 0.1}, "",
        "part of the noise of Z that is the same at each depth: sigma(Z) = c0 + c1 Z + c2 Z^2; all three 0: from the camera's model"),
    row<HAPTICD_MEMBER(camera.depth_model.noise.c1)>(
        "camera.noise_c1", kRestart, "", {0, 0.1}, "",
        "part of the noise of Z that grows with the depth"),
    row<HAPTICD_MEMBER(camera.depth_model.noise.c2_per_m)>(
        "camera.noise_c2_per_m", kRestart, "1/m", {0, 0.1}, "",
        "part of the noise of Z that grows with the square of the depth, as of every camera that triangulates"),
    row<HAPTICD_MEMBER(camera.depth_model.noise.standing_share)>(
        "camera.noise_standing_share", kRestart, "", {0, 1}, "",
        "share of the noise's variance that is the same in each frame of a resting scene"),
    row<HAPTICD_MEMBER(camera.depth_model.noise.correlation_px)>(
        "camera.noise_correlation_px", kRestart, "px", {1, 32}, "",
        "distance over which the errors of neighbouring pixels are alike; a smaller one expects less noise in means over pixels"),
    row<HAPTICD_MEMBER(camera.pose.position_m.x)>(
        "camera.position_x_m", kRestart, "m", {-10, 10}, "",
        "camera's position in the world, x"),
    row<HAPTICD_MEMBER(camera.pose.position_m.y)>(
        "camera.position_y_m", kRestart, "m", {-10, 10}, "",
        "camera's position in the world, y"),
    row<HAPTICD_MEMBER(camera.pose.position_m.z)>(
        "camera.position_z_m", kRestart, "m", {-10, 10}, "",
        "camera's position in the world, z"),
    row<HAPTICD_MEMBER(camera.pose.roll_rad)>(
        "camera.roll_rad", kRestart, "rad", {-kHalfTurn, kHalfTurn}, "",
        "camera's rotation about the world's x axis, applied first"),
    row<HAPTICD_MEMBER(camera.pose.pitch_rad)>(
        "camera.pitch_rad", kRestart, "rad", {-kHalfTurn, kHalfTurn}, "",
        "camera's rotation about the world's y axis, applied second"),
    row<HAPTICD_MEMBER(camera.pose.yaw_rad)>(
        "camera.yaw_rad", kRestart, "rad", {-kHalfTurn, kHalfTurn}, "",
        "camera's rotation about the world's z axis, applied last"),
  });
  // clang-format on
}();

}  // namespace hapticd::config
