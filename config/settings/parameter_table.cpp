// SPDX-License-Identifier: Apache-2.0
#include "config/settings/parameter_table.h"

#include <algorithm>
#include <array>

#include "config/base/value_text.h"
#include "config/settings/camera_rows.h"
#include "config/settings/parameter_rows.h"
#include "config/settings/stand_in_rows.h"

namespace hapticd::config {
namespace {

constexpr Effect kRestart = Effect::restart;
using enum Looser;

// Columns: the member, unit, {minimum, maximum}, the paper's symbol, help, and of limits which value is
// looser. All rows have the same shape.
// clang-format off
constexpr auto kRowsBeforeCamera = std::to_array<Parameter>({
    HAPTICD_PARAMETER(live.force.law, "", {}, "",
        "how depth becomes force; auto: the cheapest law and filter within force.max_error_n"),
    HAPTICD_PARAMETER(live.force.max_error_n, "N", {0, 10}, "",
        "largest force error of the law chosen by auto; 0: 7 % of safety.max_force_n, just noticeable to a hand"),
    orAutomatic(HAPTICD_PARAMETER(live.force.stiffness_n_per_m, "N/m", {0, 5000}, "k_s",
        "stiffness of the spring of each point, or of the spring to the proxy; auto: as stiff as is stable and calm")),
    ofAutomatic(HAPTICD_PARAMETER(live.force.stiffness_ceiling_n_per_m, "N/m", {1, 5000}, "",
        "largest stiffness that the automatic choice of force.stiffness_n_per_m may take", higher)),
    HAPTICD_PARAMETER(live.force.radius_m, "m", {0.005, 0.1}, "D_thresh",
        "points within this distance of the HIP act on it"),
    HAPTICD_PARAMETER(live.force.min_points, "", {1, 1000}, "N_min",
        "with fewer points within the radius there is no force"),
    HAPTICD_PARAMETER(live.force.max_points, "", {1, 1000}, "N_max",
        "with more points within the radius only the nearest count"),
    HAPTICD_PARAMETER(live.contact.friction, "", {0, 2}, "",
        "Coulomb friction coefficient of the laws proxy and surface; 0: the proxy slides freely"),
    HAPTICD_PARAMETER(live.contact.damping_n_s_per_m, "N s/m", {0, 50}, "",
        "damping along the surface normal in the laws proxy and surface"),
    HAPTICD_PARAMETER(live.contact.proxy_radius_m, "m", {0.002, 0.03}, "",
        "radius of the smallest patch that the law proxy treats as a plane; finer features are rounded off"),
    HAPTICD_PARAMETER(live.surface.fusion_frames, "", {1, 64}, "",
        "number of frames averaged for a surface at rest; 1: only the newest"),
    HAPTICD_PARAMETER(live.surface.shell_m, "m", {0.02, 0.2}, "",
        "thickness of the solid behind the visible surface; beyond it: what was last seen there, otherwise free"),
    HAPTICD_PARAMETER(live.filter.temporal_frames, "", {1, 100}, "",
        "number of frames averaged for a pixel at rest; 1: off"),
    HAPTICD_PARAMETER(live.filter.hold_frames, "", {0, 30}, "",
        "number of frames for which a pixel without measurement keeps its last value; 0: off"),
    HAPTICD_PARAMETER(live.filter.spatial_radius_px, "px", {0, 4}, "",
        "radius of the edge-preserving spatial mean; 0: off"),
    HAPTICD_PARAMETER(live.blend.duration_s, "s", {0, 0.5}, "",
        "time over which a change of frame, law or parameters is blended in; half of it is added latency"),
    HAPTICD_PARAMETER(live.proximity.warning_m, "m", {0, 0.1}, "",
        "width of the band before a forbidden region in which status and LEDs warn; 0: none", lower),
    HAPTICD_PARAMETER(live.safety.max_force_n, "N", {0, 40}, "",
        "largest commanded force", higher),
    HAPTICD_PARAMETER(live.safety.max_slew_n_per_s, "N/s", {1, 20000}, "",
        "fastest change of the commanded force", higher),
    HAPTICD_PARAMETER(live.safety.engage_ramp_s, "s", {0.01, 10}, "",
        "time over which the force ramps up after engaging", lower),
    HAPTICD_PARAMETER(live.safety.engage_inside, "", {}, "",
        "engage even if the HIP is already in contact, without this being part of the request", higher),
    HAPTICD_PARAMETER(live.safety.depth_timeout_s, "s", {0.05, 5}, "",
        "depth older than this is stale: the force goes to zero", higher),
    HAPTICD_PARAMETER(live.safety.depth_ramp_s, "s", {0.01, 5}, "",
        "time over which the force goes to zero when the depth is stale", higher),
    HAPTICD_PARAMETER(live.safety.handle_timeout_s, "s", {0.002, 1}, "",
        "handle measurements older than this are stale: the force goes to zero within 3 ticks", higher),
    HAPTICD_PARAMETER(live.safety.continuous_force_n, "N", {0.1, 40}, "",
        "force that the device can exert indefinitely; more is allowed only until it has warmed up", higher),
    HAPTICD_PARAMETER(live.safety.thermal_time_s, "s", {0.1, 600}, "",
        "time constant of the device's heating", higher),
    HAPTICD_PARAMETER(live.safety.force_filter_hz, "Hz", {0, 500}, "",
        "cut-off frequency of the low-pass filter of the force; 0: off", higher_or_zero),
    HAPTICD_PARAMETER(live.safety.passivity_control, "", {}, "",
        "damp the hand when the handle has given it more energy than it got", lower),
    HAPTICD_PARAMETER(live.safety.stiffness_limit, "", {}, "",
        "action when the stiffness exceeds what is stable with the loop's delay and the device", lower),
    HAPTICD_PARAMETER(live.safety.contact_damping, "", {}, "",
        "automatic: damp contact as the loop's delay requires; off: only by contact.damping_n_s_per_m", lower),
    HAPTICD_PARAMETER(live.safety.overrun_burst, "", {1, 65}, "",
        "number of late ticks among the last 64 at which the force goes to zero for a second; 65: never", higher),
    HAPTICD_PARAMETER(live.safety.workspace_radius_m, "m", {0.01, 20}, "",
        "largest distance of the HIP from the world's origin; beyond it there is no force", higher),
    HAPTICD_PARAMETER(live.safety.max_handle_speed_m_per_s, "m/s", {0, 100}, "",
        "faster motion of the hand is treated as a fault of the handle; 0: no limit", higher_or_zero),
});

constexpr auto kRowsAfterCamera = std::to_array<Parameter>({
    HAPTICD_PARAMETER(grid.point_capacity, "", {1024, 1024000}, "",
        "largest number of points in a scene, for the extent reach"),
    HAPTICD_PARAMETER(loop.rate_hz, "Hz", {100, 4000}, "",
        "ticks per second"),
    HAPTICD_PARAMETER(loop.cpu, "", {-1, 1023}, "",
        "CPU that the force thread is pinned to; -1: an isolated one, otherwise the last one available"),
    HAPTICD_PARAMETER(loop.priority, "", {1, 98}, "",
        "SCHED_FIFO priority of the force thread; 99 is reserved for the kernel"),
    HAPTICD_PARAMETER(handle.driver, "", {}, "",
        "driver of the haptic handle"),
    HAPTICD_PARAMETER(handle.serial, "", {}, "",
        "serial number of the handle to use; empty: the first one found"),
    HAPTICD_PARAMETER(handle.motion_scale, "", {0.05, 20}, "",
        "displacement of the HIP per displacement of the hand"),
    HAPTICD_PARAMETER(handle.force_scale, "", {0.01, 10}, "",
        "newtons at the hand per newton of the law"),
    HAPTICD_PARAMETER(handle.device_damping_n_s_per_m, "N s/m", {0, 100}, "",
        "viscous damping of the device alone, which passivity control relies on"),
    HAPTICD_PARAMETER(handle.device_mass_kg, "kg", {0, 20}, "",
        "moving mass of the device alone at the hand, which limits the stiffness; 0: that of the driver's lightest device"),
    HAPTICD_PARAMETER(handle.damping_n_s_per_m, "N s/m", {0.01, 100}, "",
        "damping of the device in the lightest grip that must be stable"),
    HAPTICD_PARAMETER(handle.position_x_m, "m", {-10, 10}, "",
        "position of the handle's origin in the world, x"),
    HAPTICD_PARAMETER(handle.position_y_m, "m", {-10, 10}, "",
        "position of the handle's origin in the world, y"),
    HAPTICD_PARAMETER(handle.position_z_m, "m", {-10, 10}, "",
        "position of the handle's origin in the world, z"),
    HAPTICD_PARAMETER(handle.roll_rad, "rad", {-kHalfTurn, kHalfTurn}, "",
        "handle's rotation about the world's x axis, applied first"),
    HAPTICD_PARAMETER(handle.pitch_rad, "rad", {-kHalfTurn, kHalfTurn}, "",
        "handle's rotation about the world's y axis, applied second"),
    HAPTICD_PARAMETER(handle.yaw_rad, "rad", {-kHalfTurn, kHalfTurn}, "",
        "handle's rotation about the world's z axis, applied last"),
    HAPTICD_PARAMETER(handle.clutch_button, "", {-1, 31}, "",
        "while this button is held the handle moves and the HIP does not; -1: no clutch"),
    HAPTICD_PARAMETER(handle.resolution_m, "m", {1e-6, 0.005}, "",
        "smallest motion of the hand above the device's noise; used to estimate the velocity"),
    HAPTICD_PARAMETER(handle.device_latency_s, "s", {0, 0.1}, "",
        "time by which the device exerts a command later, or measures its position earlier, than its driver can tell; added to "
        "the delay that stiffness limit and contact damping follow from"),
    HAPTICD_PARAMETER(handle.measure_latency, "", {}, "",
        "drivers udp and falcon: measure how late forces act with a knock of 0.5 N for 0.16 s when the box first engages, and "
        "reckon with what the driver cannot tell"),
    row<HAPTICD_MEMBER(handle.udp.address)>(
        "udp_handle.address", kRestart, "", {}, "",
        "IPv4 address of this computer at which it receives packets"),
    row<HAPTICD_MEMBER(handle.udp.port)>(
        "udp_handle.port", kRestart, "", {1, 65535}, "",
        "UDP port of this computer"),
    row<HAPTICD_MEMBER(handle.udp.peer)>(
        "udp_handle.peer", kRestart, "", {}, "",
        "IPv4 address of the device's computer, or address:port; packets from others are rejected"),
    row<HAPTICD_MEMBER(handle.udp.key_file)>(
        "udp_handle.key_file", kRestart, "", {}, "",
        "file with the key shared by both computers; empty: packets are not authenticated"),
    row<HAPTICD_MEMBER(handle.hid.kind)>(
        "hid_handle.kind", kRestart, "", {}, "",
        "kind of device: a controller with hapticd's reports, or a SpaceMouse, which exerts no force"),
    row<HAPTICD_MEMBER(handle.hid.device)>(
        "hid_handle.device", kRestart, "", {}, "",
        "USB vendor and product of the handle, hexadecimal, as lsusb shows them"),
    row<HAPTICD_MEMBER(handle.hid.full_speed_m_per_s)>(
        "hid_handle.full_speed_m_per_s", kRestart, "m/s", {0.001, 1}, "",
        "speed of the HIP at full deflection of a SpaceMouse"),
    row<HAPTICD_MEMBER(handle.falcon.firmware)>(
        "falcon_handle.firmware", kRestart, "", {}, "",
        "path of the firmware image, which is licensed by Novint and not part of hapticd"),
    row<HAPTICD_MEMBER(handle.falcon.force_share)>(
        "falcon_handle.force_share", kRestart, "", {0.01, 1}, "",
        "fraction of the motor counts per newton that other drivers send; calibrate with a scale before raising it"),
    row<HAPTICD_MEMBER(leds.driver)>(
        "leds.driver", kRestart, "", {}, "",
        "driver of the LEDs"),
    row<HAPTICD_MEMBER(leds.chip)>(
        "leds.chip", kRestart, "", {}, "",
        "the GPIO chip of all LEDs: its label (pinctrl-rp1), name (gpiochip0) or path; gpiodetect lists them"),
    row<HAPTICD_MEMBER(leds.power_line)>(
        "leds.power_line", kRestart, "", {}, "",
        "line of the power LED: blinks slowly at the start, on while hapticd runs"),
    row<HAPTICD_MEMBER(leds.camera_line)>(
        "leds.camera_line", kRestart, "", {}, "",
        "line of the camera LED: on while it streams, two flashes for damaged frames, blinks fast when lost"),
    row<HAPTICD_MEMBER(leds.contact_line)>(
        "leds.contact_line", kRestart, "", {}, "",
        "line of the contact LED: on while in contact, blinks slowly while engaged without contact"),
    row<HAPTICD_MEMBER(leds.fault_line)>(
        "leds.fault_line", kRestart, "", {}, "",
        "line of the fault LED: blinks slowly for a warning, two flashes while holding, blinks fast when faulted"),
    HAPTICD_PARAMETER(control.status_socket, "", {}, "",
        "path of the read-only status socket"),
    HAPTICD_PARAMETER(control.control_socket, "", {}, "",
        "path of the control socket"),
    HAPTICD_PARAMETER(control.depth_for_everyone, "", {}, "",
        "let every local user read the depth image, not only the groups haptic and haptic-view"),
    HAPTICD_PARAMETER(control.engage_at_start, "", {}, "",
        "engage as soon as the loop runs, without waiting for a command"),
    HAPTICD_PARAMETER(state.folder, "", {}, "",
        "folder of traces, profiles and the registration"),
    HAPTICD_PARAMETER(trace.at_start, "", {}, "",
        "write a trace from the start, without waiting for a command"),
    HAPTICD_PARAMETER(trace.depth, "", {}, "",
        "record raw depth in each trace (about 2 MB/s), so that haptic-replay --trace can recompute its forces"),
    HAPTICD_PARAMETER(trace.scene, "", {}, "",
        "what traces hold for the 3D picture in Foxglove or Lichtblick; scene: HIP, proxy, force and camera, 30 times a second; cloud: with depth, the points within reach too"),
    HAPTICD_PARAMETER(trace.compression, "", {}, "",
        "compression of the chunks of a trace"),
    HAPTICD_PARAMETER(trace.max_file_mb, "MB", {1, 100'000}, "",
        "size including depth at which a trace continues in another file; limited to a quarter of trace.max_folder_mb if that is set"),
    HAPTICD_PARAMETER(trace.max_folder_mb, "MB", {0, 1e8}, "",
        "size of the folder above which the oldest finished traces are deleted, except those marked to be kept, dumps of the flight recorder and the newest one; 0: nothing is deleted"),
    HAPTICD_PARAMETER(trace.min_free_mb, "MB", {0, 1e6}, "",
        "free space on the disk below which nothing is written"),
    HAPTICD_PARAMETER(trace.flight_recorder_s, "s", {0, 60}, "",
        "duration of the newest ticks kept in memory, written on a fault or by hapticctl trace dump; 0: none"),
});
// clang-format on

template <std::size_t... kCounts>
constexpr auto joined(const std::array<Parameter, kCounts>&... parts) {
  std::array<Parameter, (kCounts + ...)> all{};
  auto end = all.begin();
  ((end = std::ranges::copy(parts, end).out), ...);
  return all;
}

constexpr auto kAll = joined(kRowsBeforeCamera, kCameraRows, kRowsAfterCamera, kStandInRows);

}  // namespace

std::span<const Parameter> parameterTable() {
  return allParameters().first(kAll.size() - kStandInRows.size());
}

std::span<const Parameter> standInParameters() {
  return allParameters().last(kStandInRows.size());
}

std::span<const Parameter> allParameters() {
  return kAll;
}

std::vector<std::string_view> parameterGroups() {
  std::vector<std::string_view> groups;
  for (const Parameter& parameter : allParameters()) {
    if (std::ranges::find(groups, parameter.group()) == groups.end()) groups.push_back(parameter.group());
  }
  return groups;
}

const Parameter* findParameter(std::string_view name) {
  const auto found = std::ranges::find(kAll, name, &Parameter::name);
  return found == kAll.end() ? nullptr : &*found;
}

base::Error unknownParameter(std::string_view name) {
  std::array<std::string_view, kAll.size()> names;
  std::ranges::transform(kAll, names.begin(), &Parameter::name);
  const std::string guess = base::didYouMean(name, names);
  return {.where = base::inQuotes(name),
          .what = "there is no parameter of this name",
          .remedy = guess.empty() ? "hapticd.yaml lists all parameters" : guess};
}

base::Result<void> setFromText(Settings& settings, std::string_view name_and_value) {
  const std::size_t equals = name_and_value.find('=');
  if (equals == std::string_view::npos) {
    return std::unexpected(
        base::Error{base::inQuotes(name_and_value), "has no value", "write it as group.name=value"});
  }
  const std::string_view name = name_and_value.substr(0, equals);
  const Parameter* parameter = findParameter(name);
  if (parameter == nullptr) return std::unexpected(unknownParameter(name));
  const base::Result<Value> value = parameter->parse(name_and_value.substr(equals + 1));
  if (!value) return std::unexpected(value.error());
  parameter->set(settings, *value);
  return {};
}

}  // namespace hapticd::config
