// SPDX-License-Identifier: Apache-2.0
#include "config/settings/parameter_table.h"

#include <algorithm>
#include <array>

#include "config/base/nearest_names.h"
#include "config/base/value_text.h"
#include "config/settings/driver_rows.h"
#include "config/settings/parameter_rows.h"

namespace hapticd::config {
namespace {

constexpr Effect kLive = Effect::live;
constexpr Effect kRestart = Effect::restart;
using enum Looser;

/// A little more than pi, so that pi is accepted however it was rounded.
constexpr double kHalfTurn = 3.1416;

// Columns: name, effect, unit, {minimum, maximum}, the paper's symbol, help, and of limits which value is
// looser. All rows have the same shape.
// clang-format off
constexpr auto kForceToSafety = std::to_array<Parameter>({
    row<HAPTICD_MEMBER(force.law)>(
        "force.law", kLive, "", {}, "",
        "how depth becomes force; auto: the cheapest law and filter within force.max_error_n"),
    row<HAPTICD_MEMBER(force.max_error_n)>(
        "force.max_error_n", kLive, "N", {0, 10}, "",
        "largest force error of the law chosen by auto; 0: 7 % of safety.max_force_n, just noticeable to a hand"),
    stiffnessRow(
        "force.stiffness_n_per_m", {0, 5000},
        "stiffness of the spring of each point, or of the spring to the proxy; auto: as stiff as is stable and calm"),
    stiffnessCeilingRow(
        "force.stiffness_ceiling_n_per_m", {1, 5000},
        "largest stiffness that the automatic choice of force.stiffness_n_per_m may take"),
    row<HAPTICD_MEMBER(live.springs.radius_m)>(
        "force.radius_m", kLive, "m", {0.005, 0.1}, "D_thresh",
        "points within this distance of the HIP act on it"),
    row<HAPTICD_MEMBER(live.springs.min_points)>(
        "force.min_points", kLive, "", {1, 1000}, "N_min",
        "with fewer points within the radius there is no force"),
    row<HAPTICD_MEMBER(live.springs.max_points)>(
        "force.max_points", kLive, "", {1, 1000}, "N_max",
        "with more points within the radius only the nearest count"),
    row<HAPTICD_MEMBER(live.contact.friction)>(
        "contact.friction", kLive, "", {0, 2}, "",
        "Coulomb friction coefficient of the laws proxy and surface; 0: the proxy slides freely"),
    row<HAPTICD_MEMBER(live.contact.damping_n_s_per_m)>(
        "contact.damping_n_s_per_m", kLive, "N s/m", {0, 50}, "",
        "damping along the surface normal in the laws proxy and surface"),
    row<HAPTICD_MEMBER(live.contact.proxy_radius_m)>(
        "contact.proxy_radius_m", kLive, "m", {0.002, 0.03}, "",
        "radius of the smallest patch that the law proxy treats as a plane; finer features are rounded off"),
    row<HAPTICD_MEMBER(live.surface.fusion_frames)>(
        "surface.fusion_frames", kLive, "", {1, 64}, "",
        "number of frames averaged for a surface at rest; 1: only the newest"),
    row<HAPTICD_MEMBER(live.surface.shell_m)>(
        "surface.shell_m", kLive, "m", {0.02, 0.2}, "",
        "thickness of the solid behind the visible surface; beyond it: what was last seen there, otherwise free"),
    row<HAPTICD_MEMBER(live.filter.temporal_frames)>(
        "filter.temporal_frames", kLive, "", {1, 100}, "",
        "number of frames averaged for a pixel at rest; 1: off"),
    row<HAPTICD_MEMBER(live.filter.hold_frames)>(
        "filter.hold_frames", kLive, "", {0, 30}, "",
        "number of frames for which a pixel without measurement keeps its last value; 0: off"),
    row<HAPTICD_MEMBER(live.filter.spatial_radius_px)>(
        "filter.spatial_radius_px", kLive, "px", {0, 4}, "",
        "radius of the edge-preserving spatial mean; 0: off"),
    row<HAPTICD_MEMBER(live.blend.duration_s)>(
        "blend.duration_s", kLive, "s", {0, 0.5}, "",
        "time over which a change of frame, law or parameters is blended in; half of it is added latency"),
    row<HAPTICD_MEMBER(proximity.warning_m)>(
        "proximity.warning_m", kLive, "m", {0, 0.1}, "",
        "width of the band before a forbidden region in which status and LEDs warn; 0: none", lower),
    row<HAPTICD_MEMBER(live.safety.max_force_n)>(
        "safety.max_force_n", kLive, "N", {0, 40}, "",
        "largest commanded force", higher),
    row<HAPTICD_MEMBER(live.safety.max_slew_n_per_s)>(
        "safety.max_slew_n_per_s", kLive, "N/s", {1, 20000}, "",
        "fastest change of the commanded force", higher),
    row<HAPTICD_MEMBER(live.safety.engage_ramp_s)>(
        "safety.engage_ramp_s", kLive, "s", {0.01, 10}, "",
        "time over which the force ramps up after engaging", lower),
    row<HAPTICD_MEMBER(live.safety.engage_inside)>(
        "safety.engage_inside", kLive, "", {}, "",
        "engage even if the HIP is already in contact, without this being part of the request", higher),
    row<HAPTICD_MEMBER(live.safety.depth_timeout_s)>(
        "safety.depth_timeout_s", kLive, "s", {0.05, 5}, "",
        "depth older than this is stale: the force goes to zero", higher),
    row<HAPTICD_MEMBER(live.safety.depth_ramp_s)>(
        "safety.depth_ramp_s", kLive, "s", {0.01, 5}, "",
        "time over which the force goes to zero when the depth is stale", higher),
    row<HAPTICD_MEMBER(live.safety.handle_timeout_s)>(
        "safety.handle_timeout_s", kLive, "s", {0.002, 1}, "",
        "handle measurements older than this are stale: the force goes to zero within 3 ticks", higher),
    row<HAPTICD_MEMBER(live.safety.continuous_force_n)>(
        "safety.continuous_force_n", kLive, "N", {0.1, 40}, "",
        "force that the device can exert indefinitely; more is allowed only until it has warmed up", higher),
    row<HAPTICD_MEMBER(live.safety.thermal_time_s)>(
        "safety.thermal_time_s", kLive, "s", {0.1, 600}, "",
        "time constant of the device's heating", higher),
    row<HAPTICD_MEMBER(live.safety.force_filter_hz)>(
        "safety.force_filter_hz", kLive, "Hz", {0, 500}, "",
        "cut-off frequency of the low-pass filter of the force; 0: off", higher_or_zero),
    row<HAPTICD_MEMBER(live.safety.passivity_control)>(
        "safety.passivity_control", kLive, "", {}, "",
        "damp the hand when the handle has given it more energy than it got", lower),
    row<HAPTICD_MEMBER(live.safety.stiffness_limit)>(
        "safety.stiffness_limit", kLive, "", {}, "",
        "action when the stiffness exceeds what is stable with the loop's delay and the device", lower),
    row<HAPTICD_MEMBER(live.safety.contact_damping)>(
        "safety.contact_damping", kLive, "", {}, "",
        "automatic: damp contact as the loop's delay requires; off: only by contact.damping_n_s_per_m", lower),
    row<HAPTICD_MEMBER(live.safety.overrun_burst)>(
        "safety.overrun_burst", kLive, "", {1, 65}, "",
        "number of late ticks among the last 64 at which the force goes to zero for a second; 65: never", higher),
    row<HAPTICD_MEMBER(live.safety.workspace_radius_m)>(
        "safety.workspace_radius_m", kLive, "m", {0.01, 20}, "",
        "largest distance of the HIP from the world's origin; beyond it there is no force", higher),
    row<HAPTICD_MEMBER(live.safety.max_handle_speed_m_per_s)>(
        "safety.max_handle_speed_m_per_s", kLive, "m/s", {0, 100}, "",
        "faster motion of the hand is treated as a fault of the handle; 0: no limit", higher_or_zero),
});

constexpr auto kCameraDriverRows = std::to_array<Parameter>({
    row<HAPTICD_MEMBER(camera.driver)>(
        "camera.driver", kRestart, "", {}, "",
        "source of the depth frames"),
    row<HAPTICD_MEMBER(camera.serial)>(
        "camera.serial", kRestart, "", {}, "",
        "serial number of the camera to use; empty: the first one found"),
});

constexpr auto kCameraRows = std::to_array<Parameter>({
    row<HAPTICD_MEMBER(camera.format.width_px)>(
        "camera.width_px", kRestart, "px", {0, 1280}, "",
        "width of the frames, 160 or more, for the driver v4l2 and for synthetic cameras other than a Kinect v1; 0: 848, or 640 for time_of_flight"),
    row<HAPTICD_MEMBER(camera.format.height_px)>(
        "camera.height_px", kRestart, "px", {0, 800}, "",
        "height of the frames, 100 or more, for the driver v4l2 and for synthetic cameras other than a Kinect v1; 0: 480, or 576 for time_of_flight"),
    row<HAPTICD_MEMBER(camera.format.intrinsics)>(
        "camera.intrinsics", kRestart, "", {}, "",
        "intrinsics of the same cameras: those that the camera reports, or fx_px, fy_px, cx_px and cy_px"),
    row<HAPTICD_MEMBER(camera.format.unit_um)>(
        "camera.unit_um", kRestart, "um", {0, 10000}, "",
        "depth unit of the same cameras; 0: 100 um where the camera can be set to it and the range allows it, otherwise its own"),
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

constexpr auto kGridToHandle = std::to_array<Parameter>({
    row<HAPTICD_MEMBER(grid.point_capacity)>(
        "grid.point_capacity", kRestart, "", {1024, 1024000}, "",
        "largest number of points in a scene, for the extent reach"),
    row<HAPTICD_MEMBER(loop.rate_hz)>(
        "loop.rate_hz", kRestart, "Hz", {100, 4000}, "",
        "ticks per second"),
    row<HAPTICD_MEMBER(loop.cpu)>(
        "loop.cpu", kRestart, "", {-1, 1023}, "",
        "CPU that the force thread is pinned to; -1: an isolated one, otherwise the last one available"),
    row<HAPTICD_MEMBER(loop.priority)>(
        "loop.priority", kRestart, "", {1, 98}, "",
        "SCHED_FIFO priority of the force thread; 99 is reserved for the kernel"),
    row<HAPTICD_MEMBER(handle.driver)>(
        "handle.driver", kRestart, "", {}, "",
        "driver of the haptic handle"),
    row<HAPTICD_MEMBER(handle.serial)>(
        "handle.serial", kRestart, "", {}, "",
        "serial number of the handle to use; empty: the first one found"),
    row<HAPTICD_MEMBER(live.handle.motion_scale)>(
        "handle.motion_scale", kRestart, "", {0.05, 20}, "",
        "displacement of the HIP per displacement of the hand"),
    row<HAPTICD_MEMBER(live.handle.force_scale)>(
        "handle.force_scale", kRestart, "", {0.01, 10}, "",
        "newtons at the hand per newton of the law"),
    row<HAPTICD_MEMBER(live.handle.device_damping_n_s_per_m)>(
        "handle.device_damping_n_s_per_m", kRestart, "N s/m", {0, 100}, "",
        "viscous damping of the device alone, which passivity control relies on"),
    row<HAPTICD_MEMBER(handle.device_mass_kg)>(
        "handle.device_mass_kg", kRestart, "kg", {0, 20}, "",
        "moving mass of the device alone at the hand, which limits the stiffness; 0: that of the driver's lightest device"),
    row<HAPTICD_MEMBER(live.handle.damping_n_s_per_m)>(
        "handle.damping_n_s_per_m", kRestart, "N s/m", {0.01, 100}, "",
        "damping of the device in the lightest grip that must be stable"),
    row<HAPTICD_MEMBER(handle.pose.position_m.x)>(
        "handle.position_x_m", kRestart, "m", {-10, 10}, "",
        "position of the handle's origin in the world, x"),
    row<HAPTICD_MEMBER(handle.pose.position_m.y)>(
        "handle.position_y_m", kRestart, "m", {-10, 10}, "",
        "position of the handle's origin in the world, y"),
    row<HAPTICD_MEMBER(handle.pose.position_m.z)>(
        "handle.position_z_m", kRestart, "m", {-10, 10}, "",
        "position of the handle's origin in the world, z"),
    row<HAPTICD_MEMBER(handle.pose.roll_rad)>(
        "handle.roll_rad", kRestart, "rad", {-kHalfTurn, kHalfTurn}, "",
        "handle's rotation about the world's x axis, applied first"),
    row<HAPTICD_MEMBER(handle.pose.pitch_rad)>(
        "handle.pitch_rad", kRestart, "rad", {-kHalfTurn, kHalfTurn}, "",
        "handle's rotation about the world's y axis, applied second"),
    row<HAPTICD_MEMBER(handle.pose.yaw_rad)>(
        "handle.yaw_rad", kRestart, "rad", {-kHalfTurn, kHalfTurn}, "",
        "handle's rotation about the world's z axis, applied last"),
    row<HAPTICD_MEMBER(handle.clutch_button)>(
        "handle.clutch_button", kRestart, "", {-1, 31}, "",
        "while this button is held the handle moves and the HIP does not; -1: no clutch"),
    row<HAPTICD_MEMBER(handle.resolution_m)>(
        "handle.resolution_m", kRestart, "m", {1e-6, 0.005}, "",
        "smallest motion of the hand above the device's noise; used to estimate the velocity"),
    row<HAPTICD_MEMBER(handle.device_latency_s)>(
        "handle.device_latency_s", kRestart, "s", {0, 0.1}, "",
        "time by which the device exerts a command later, or measures its position earlier, than its driver can tell; added to "
        "the delay that stiffness limit and contact damping follow from"),
    row<HAPTICD_MEMBER(handle.measure_latency)>(
        "handle.measure_latency", kRestart, "", {}, "",
        "drivers udp and falcon: measure how late forces act with a knock of 0.5 N for 0.16 s when the box first engages, and "
        "reckon with what the driver cannot tell"),
});

constexpr auto kLedsToTrace = std::to_array<Parameter>({
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
    row<HAPTICD_MEMBER(control.status_socket)>(
        "control.status_socket", kRestart, "", {}, "",
        "path of the read-only status socket"),
    row<HAPTICD_MEMBER(control.control_socket)>(
        "control.control_socket", kRestart, "", {}, "",
        "path of the control socket"),
    row<HAPTICD_MEMBER(control.depth_for_everyone)>(
        "control.depth_for_everyone", kRestart, "", {}, "",
        "let every local user read the depth image, not only the groups haptic and haptic-view"),
    row<HAPTICD_MEMBER(control.engage_at_start)>(
        "control.engage_at_start", kRestart, "", {}, "",
        "engage as soon as the loop runs, without waiting for a command"),
    row<HAPTICD_MEMBER(state.folder)>(
        "state.folder", kRestart, "", {}, "",
        "folder of traces, profiles and the registration"),
    row<HAPTICD_MEMBER(trace.at_start)>(
        "trace.at_start", kRestart, "", {}, "",
        "write a trace from the start, without waiting for a command"),
    row<HAPTICD_MEMBER(trace.depth)>(
        "trace.depth", kRestart, "", {}, "",
        "record raw depth in each trace (about 2 MB/s), so that haptic-replay --trace can recompute its forces"),
    row<HAPTICD_MEMBER(trace.scene)>(
        "trace.scene", kRestart, "", {}, "",
        "what traces hold for the 3D picture in Foxglove or Lichtblick; scene: HIP, proxy, force and camera, 30 times a second; cloud: with depth, the points within reach too"),
    row<HAPTICD_MEMBER(trace.compression)>(
        "trace.compression", kRestart, "", {}, "",
        "compression of the chunks of a trace"),
    row<HAPTICD_MEMBER(trace.max_file_mb)>(
        "trace.max_file_mb", kRestart, "MB", {1, 100'000}, "",
        "size including depth at which a trace continues in another file; limited to a quarter of trace.max_folder_mb if that is set"),
    row<HAPTICD_MEMBER(trace.max_folder_mb)>(
        "trace.max_folder_mb", kRestart, "MB", {0, 1e8}, "",
        "size of the folder above which the oldest finished traces are deleted, except those marked to be kept, dumps of the flight recorder and the newest one; 0: nothing is deleted"),
    row<HAPTICD_MEMBER(trace.min_free_mb)>(
        "trace.min_free_mb", kRestart, "MB", {0, 1e6}, "",
        "free space on the disk below which nothing is written"),
    row<HAPTICD_MEMBER(trace.flight_recorder_s)>(
        "trace.flight_recorder_s", kRestart, "s", {0, 60}, "",
        "duration of the newest ticks kept in memory, written on a fault or by hapticctl trace dump; 0: none"),
});

constexpr auto kFaultRows = std::to_array<Parameter>({
    row<HAPTICD_MEMBER(control.allow_fault_injection)>(
        "control.allow_fault_injection", kRestart, "", {}, "",
        "allow hapticd --inject to simulate faults, for tests of a box that nobody holds"),
});
// clang-format on

/// All rows: those of this file, and those that the drivers state.
class Table {
 public:
  Table() {
    add(kForceToSafety);
    add(kCameraDriverRows);
    addDrivers(cameraDrivers(), false);
    add(kCameraRows);
    add(kGridToHandle);
    addDrivers(handleDrivers(), false);
    add(kLedsToTrace);
    shown_ = rows_.size();
    addDrivers(cameraDrivers(), true);
    addDrivers(handleDrivers(), true);
    add(kFaultRows);
    offer("camera.driver", cameraDrivers(), cameras_);
    offer("handle.driver", handleDrivers(), handles_);
  }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  std::span<const Parameter> all() const { return rows_; }
  std::span<const Parameter> shown() const { return all().first(shown_); }
  std::span<const Parameter> standIns() const { return all().subspan(shown_); }

 private:
  struct Words {
    std::vector<std::string_view> words;
    std::vector<std::string_view> help;
  };

  void add(std::span<const Parameter> rows) { rows_.insert(rows_.end(), rows.begin(), rows.end()); }

  template <typename Driver>
  void addDrivers(std::span<const Driver> drivers, bool stand_in) {
    for (const Driver& driver : drivers) {
      if (driver.stands_in == stand_in) add(driver.parameters);
    }
  }

  /// Makes the text `name` a choice of the words of the drivers.
  template <typename Driver>
  void offer(std::string_view name, std::span<const Driver> drivers, Words& to) {
    for (const Driver& driver : drivers) {
      to.words.push_back(driver.word);
      to.help.push_back(driver.help);
    }
    Parameter& parameter = *std::ranges::find(rows_, name, &Parameter::name);
    parameter.kind = Kind::choice;
    parameter.choices = to.words;
    parameter.choice_help = to.help;
  }

  std::vector<Parameter> rows_;
  std::size_t shown_ = 0;
  Words cameras_;
  Words handles_;
};

const Table& table() {
  static const Table kTable;
  return kTable;
}

}  // namespace

std::span<const Parameter> parameterTable() {
  return table().shown();
}

std::span<const Parameter> standInParameters() {
  return table().standIns();
}

std::span<const Parameter> allParameters() {
  return table().all();
}

std::vector<std::string_view> parameterGroups() {
  std::vector<std::string_view> groups;
  for (const Parameter& parameter : allParameters()) {
    if (std::ranges::find(groups, parameter.group()) == groups.end()) groups.push_back(parameter.group());
  }
  return groups;
}

const Parameter* findParameter(std::string_view name) {
  const std::span<const Parameter> all = allParameters();
  const auto found = std::ranges::find(all, name, &Parameter::name);
  return found == all.end() ? nullptr : &*found;
}

base::Error unknownParameter(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Parameter& parameter : allParameters()) names.push_back(parameter.name);
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
