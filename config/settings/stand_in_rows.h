// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "config/settings/parameter_rows.h"
#include "config/settings/parameter_table.h"

namespace hapticd::config {

/// The rows of what stands in for a device: the camera drivers `recorded` and `synthetic`, the handle driver
/// `simulated`, and injected faults. No box with a hand at it sets them; the README of each driver lists its
/// own.
inline constexpr auto kStandInRows = [] {
  constexpr Effect kRestart = Effect::restart;
  // Columns: as those of the table (parameter_table.cpp).
  // clang-format off
  return std::to_array<Parameter>({
    row<HAPTICD_MEMBER(camera.recording)>(
        "camera.recording", kRestart, "", {}, "",
        "folder of the recording, for the driver recorded"),
    row<HAPTICD_MEMBER(camera.loop)>(
        "camera.loop", kRestart, "", {}, "",
        "restart the recording at its end, for the driver recorded"),
    row<HAPTICD_MEMBER(camera.speed)>(
        "camera.speed", kRestart, "", {0.1, 100}, "",
        "playback speed relative to real time, for the driver recorded"),
    row<HAPTICD_MEMBER(camera.played)>(
        "synthetic.camera", kRestart, "", {}, "",
        "camera that the driver synthetic plays: a Kinect v1, a stereo camera or a time-of-flight camera"),
    row<HAPTICD_MEMBER(synthetic.scene)>(
        "synthetic.scene", kRestart, "", {}, "",
        "scene shown by the driver synthetic"),
    row<HAPTICD_MEMBER(synthetic.noise)>(
        "synthetic.noise", kRestart, "", {}, "",
        "noise of its depth: none, random rounding to raw units, that of a usual sensor, or that of a noisier one"),
    row<HAPTICD_MEMBER(synthetic.distance_m)>(
        "synthetic.distance_m", kRestart, "m", {0.1, 10}, "",
        "distance from the camera to the plane or to the sphere's centre"),
    row<HAPTICD_MEMBER(synthetic.tilt_rad)>(
        "synthetic.tilt_rad", kRestart, "rad", {-1.4, 1.4}, "",
        "tilt of the plane about the camera's x axis"),
    row<HAPTICD_MEMBER(synthetic.sphere_radius_m)>(
        "synthetic.sphere_radius_m", kRestart, "m", {0.005, 2}, "",
        "radius of the sphere"),
    row<HAPTICD_MEMBER(synthetic.motion_amplitude_m)>(
        "synthetic.motion_amplitude_m", kRestart, "m", {0, 2}, "",
        "amplitude of the moving sphere along x"),
    row<HAPTICD_MEMBER(synthetic.motion_period_s)>(
        "synthetic.motion_period_s", kRestart, "s", {0.1, 600}, "",
        "period of the moving sphere"),
    row<HAPTICD_MEMBER(synthetic.frame_rate_hz)>(
        "synthetic.frame_rate_hz", kRestart, "Hz", {1, 120}, "",
        "frames per second"),
    row<HAPTICD_MEMBER(synthetic.seed)>(
        "synthetic.seed", kRestart, "", {0, 2147483647}, "",
        "seed of the noise; the same seed gives the same noise"),
    row<HAPTICD_MEMBER(handle.simulated.script)>(
        "simulated_handle.script", kRestart, "", {}, "",
        "action of the hand on the surface; mixed: tap, stroke and lean in turn"),
    row<HAPTICD_MEMBER(handle.simulated.mass_kg)>(
        "simulated_handle.mass_kg", kRestart, "kg", {0.005, 10}, "",
        "mass of the handle"),
    row<HAPTICD_MEMBER(handle.simulated.damping_n_s_per_m)>(
        "simulated_handle.damping_n_s_per_m", kRestart, "N s/m", {0, 100}, "",
        "viscous friction of the handle"),
    row<HAPTICD_MEMBER(handle.simulated.friction_n)>(
        "simulated_handle.friction_n", kRestart, "N", {0, 5}, "",
        "dry friction of the handle, along each axis"),
    row<HAPTICD_MEMBER(handle.simulated.position_quantum_m)>(
        "simulated_handle.position_quantum_m", kRestart, "m", {0, 0.001}, "",
        "resolution of the measured position, from which the velocity is then estimated; 0: exact"),
    row<HAPTICD_MEMBER(handle.simulated.hand_stiffness_n_per_m)>(
        "simulated_handle.hand_stiffness_n_per_m", kRestart, "N/m", {1, 5000}, "",
        "stiffness of the hand's grip"),
    row<HAPTICD_MEMBER(handle.simulated.hand_damping_n_s_per_m)>(
        "simulated_handle.hand_damping_n_s_per_m", kRestart, "N s/m", {0, 100}, "",
        "damping of the hand's grip"),
    row<HAPTICD_MEMBER(handle.simulated.start_m_in_world.x)>(
        "simulated_handle.start_x_m", kRestart, "m", {-10, 10}, "",
        "start position of the hand in the world, x"),
    row<HAPTICD_MEMBER(handle.simulated.start_m_in_world.y)>(
        "simulated_handle.start_y_m", kRestart, "m", {-10, 10}, "",
        "start position of the hand in the world, y"),
    row<HAPTICD_MEMBER(handle.simulated.start_m_in_world.z)>(
        "simulated_handle.start_z_m", kRestart, "m", {-10, 10}, "",
        "start position of the hand in the world, z"),
    row<HAPTICD_MEMBER(handle.simulated.direction_in_world.x)>(
        "simulated_handle.direction_x", kRestart, "", {-1, 1}, "",
        "direction of the approach in the world, x; any length except zero"),
    row<HAPTICD_MEMBER(handle.simulated.direction_in_world.y)>(
        "simulated_handle.direction_y", kRestart, "", {-1, 1}, "",
        "direction of the approach in the world, y; any length except zero"),
    row<HAPTICD_MEMBER(handle.simulated.direction_in_world.z)>(
        "simulated_handle.direction_z", kRestart, "", {-1, 1}, "",
        "direction of the approach in the world, z; any length except zero"),
    row<HAPTICD_MEMBER(handle.simulated.travel_m)>(
        "simulated_handle.travel_m", kRestart, "m", {0.001, 5}, "",
        "distance after which the hand turns back"),
    row<HAPTICD_MEMBER(handle.simulated.speed_m_per_s)>(
        "simulated_handle.speed_m_per_s", kRestart, "m/s", {0.001, 2}, "",
        "speed of approach and retreat"),
    row<HAPTICD_MEMBER(handle.simulated.press_force_n)>(
        "simulated_handle.press_force_n", kRestart, "N", {0, 40}, "",
        "force at which the hand stops its approach"),
    row<HAPTICD_MEMBER(handle.simulated.press_s)>(
        "simulated_handle.press_s", kRestart, "s", {0, 600}, "",
        "time for which the hand strokes or leans on the surface before it retreats"),
    row<HAPTICD_MEMBER(handle.simulated.stroke_m)>(
        "simulated_handle.stroke_m", kRestart, "m", {0, 1}, "",
        "amplitude of the stroke across the direction of approach"),
    row<HAPTICD_MEMBER(handle.simulated.stroke_period_s)>(
        "simulated_handle.stroke_period_s", kRestart, "s", {0.05, 600}, "",
        "period of the stroke"),
    row<HAPTICD_MEMBER(control.allow_fault_injection)>(
        "control.allow_fault_injection", kRestart, "", {}, "",
        "allow hapticd --inject to simulate faults, for tests of a box that nobody holds"),
  });
  // clang-format on
}();

}  // namespace hapticd::config
