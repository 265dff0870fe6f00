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
  // Columns: the member, unit, {minimum, maximum}, the paper's symbol, help. All rows have the same shape.
  // clang-format off
  return std::to_array<Parameter>({
    HAPTICD_PARAMETER(camera.driver, "", {}, "",
        "source of the depth frames"),
    HAPTICD_PARAMETER(camera.serial, "", {}, "",
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
    HAPTICD_PARAMETER(camera.latency_s, "s", {0, 0.2}, "",
        "time from exposure to arrival of a frame; laws that predict motion extrapolate the surface by it"),
    HAPTICD_PARAMETER(camera.depth_law, "", {}, "",
        "coefficients of the depth conversion: Table I, libfreenect's, or depth_a_per_m and depth_b_per_m"),
    HAPTICD_PARAMETER(camera.depth_a_per_m, "1/m", {-1, 1}, "a",
        "change of 1/Z per raw unit, for the depth law custom"),
    HAPTICD_PARAMETER(camera.depth_b_per_m, "1/m", {-10, 10}, "b",
        "1/Z at the raw value 0, for the depth law custom"),
    HAPTICD_PARAMETER(camera.near_m, "m", {0.07, 10}, "",
        "nearer measurements are rejected"),
    HAPTICD_PARAMETER(camera.far_m, "m", {0.1, 10}, "",
        "farther measurements are rejected"),
    HAPTICD_PARAMETER(camera.fx_px, "px", {100, 2000}, "f_x",
        "focal length, horizontal"),
    HAPTICD_PARAMETER(camera.fy_px, "px", {100, 2000}, "f_y",
        "focal length, vertical"),
    HAPTICD_PARAMETER(camera.cx_px, "px", {0, 1280}, "c_x",
        "optical centre, from the left"),
    HAPTICD_PARAMETER(camera.cy_px, "px", {0, 800}, "c_y",
        "optical centre, from the top"),
    HAPTICD_PARAMETER(camera.noise_c0_m, "m", {0, 0.1}, "",
        "part of the noise of Z that is the same at each depth: sigma(Z) = c0 + c1 Z + c2 Z^2; all three 0: from the camera's model"),
    HAPTICD_PARAMETER(camera.noise_c1, "", {0, 0.1}, "",
        "part of the noise of Z that grows with the depth"),
    HAPTICD_PARAMETER(camera.noise_c2_per_m, "1/m", {0, 0.1}, "",
        "part of the noise of Z that grows with the square of the depth, as of every camera that triangulates"),
    HAPTICD_PARAMETER(camera.noise_standing_share, "", {0, 1}, "",
        "share of the noise's variance that is the same in each frame of a resting scene"),
    HAPTICD_PARAMETER(camera.noise_correlation_px, "px", {1, 32}, "",
        "distance over which the errors of neighbouring pixels are alike; a smaller one expects less noise in means over pixels"),
    HAPTICD_PARAMETER(camera.position_x_m, "m", {-10, 10}, "",
        "camera's position in the world, x"),
    HAPTICD_PARAMETER(camera.position_y_m, "m", {-10, 10}, "",
        "camera's position in the world, y"),
    HAPTICD_PARAMETER(camera.position_z_m, "m", {-10, 10}, "",
        "camera's position in the world, z"),
    HAPTICD_PARAMETER(camera.roll_rad, "rad", {-kHalfTurn, kHalfTurn}, "",
        "camera's rotation about the world's x axis, applied first"),
    HAPTICD_PARAMETER(camera.pitch_rad, "rad", {-kHalfTurn, kHalfTurn}, "",
        "camera's rotation about the world's y axis, applied second"),
    HAPTICD_PARAMETER(camera.yaw_rad, "rad", {-kHalfTurn, kHalfTurn}, "",
        "camera's rotation about the world's z axis, applied last"),
  });
  // clang-format on
}();

}  // namespace hapticd::config
