// SPDX-License-Identifier: Apache-2.0
#include "config/settings/parameter_table.h"

#include <algorithm>
#include <array>

#include "config/base/value_text.h"
#include "config/settings/driver_rows.h"
#include "config/settings/row_of_member.h"

namespace hapticd::config {
namespace {

using enum Looser;

/// A little more than pi, so that pi is accepted however it was rounded.
constexpr double kHalfTurn = 3.1416;

// Columns: the member, unit, {minimum, maximum}, the paper's symbol, help, and of limits which value is
// looser. All rows have the same shape.
// clang-format off
constexpr auto kForceToSafety = std::to_array<Parameter>({
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
    HAPTICD_PARAMETER(live.tool.radius_m, "m", {0, 0.02}, "",
        "radius of the ball at the tip of the tool, which fixtures hold off as a whole; 0: a point", lower),
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
    HAPTICD_PARAMETER(live.safety.max_external_force_n, "N", {0, 10}, "",
        "largest force that another program may add by FeedForce; 0: none", higher),
    HAPTICD_PARAMETER(live.safety.max_external_power_w, "W", {0, 5}, "",
        "power that this force may give to the hand for longer than a moment", higher),
});

constexpr auto kCameraDriverRows = std::to_array<Parameter>({
    HAPTICD_PARAMETER(camera.driver, "", {}, "",
        "source of the depth frames"),
    HAPTICD_PARAMETER(camera.serial, "", {}, "",
        "serial number of the camera to use; empty: the first one found"),
});

constexpr auto kCameraRows = std::to_array<Parameter>({
    HAPTICD_PARAMETER(camera.width_px, "px", {0, 1280}, "",
        "width of the frames, 160 or more, for the driver v4l2 and for synthetic cameras other than a Kinect v1; 0: 848, or 640 for time_of_flight"),
    HAPTICD_PARAMETER(camera.height_px, "px", {0, 800}, "",
        "height of the frames, 100 or more, for the driver v4l2 and for synthetic cameras other than a Kinect v1; 0: 480, or 576 for time_of_flight"),
    HAPTICD_PARAMETER(camera.intrinsics, "", {}, "",
        "intrinsics of the same cameras: those that the camera reports, or fx_px, fy_px, cx_px and cy_px"),
    HAPTICD_PARAMETER(camera.unit_um, "um", {0, 10000}, "",
        "depth unit of the same cameras; 0: 100 um where the camera can be set to it and the range allows it, otherwise its own"),
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
        "static share of the noise's variance: what is the same in each frame of a resting scene"),
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

constexpr auto kGridToHandle = std::to_array<Parameter>({
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
    HAPTICD_PARAMETER(handle.position_step_m, "m", {0, 0.005}, "",
        "step of the positions that the device measures, as of an encoder: while the hand moves steadily the position is "
        "interpolated within it, so that the steps do not vibrate in the hand; 0: that of the driver, 0.04 mm for falcon, none for the others"),
    HAPTICD_PARAMETER(handle.device_latency_s, "s", {0, 0.1}, "",
        "time by which the device exerts a command later, or measures its position earlier, than its driver can tell; added to "
        "the delay that stiffness limit and contact damping follow from"),
    HAPTICD_PARAMETER(handle.measure_latency, "", {}, "",
        "drivers udp and falcon: measure how late forces act with a knock of 0.5 N for 0.16 s when the box first engages, "
        "again every 5 s while it finds nothing, and allow for what the driver cannot tell"),
});

constexpr auto kLedsToTrace = std::to_array<Parameter>({
    HAPTICD_PARAMETER(leds.driver, "", {}, "",
        "driver of the LEDs"),
    HAPTICD_PARAMETER(leds.chip, "", {}, "",
        "the GPIO chip of all LEDs: its label (pinctrl-rp1), name (gpiochip0) or path; gpiodetect lists them"),
    HAPTICD_PARAMETER(leds.power_line, "", {}, "",
        "line of the power LED: blinks slowly at the start, on while hapticd runs"),
    HAPTICD_PARAMETER(leds.camera_line, "", {}, "",
        "line of the camera LED: on while it streams, two flashes for damaged frames, blinks fast when lost"),
    HAPTICD_PARAMETER(leds.contact_line, "", {}, "",
        "line of the contact LED: on while in contact, blinks slowly while engaged without contact"),
    HAPTICD_PARAMETER(leds.fault_line, "", {}, "",
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

constexpr auto kFaultRows = std::to_array<Parameter>({
    HAPTICD_PARAMETER(control.allow_fault_injection, "", {}, "",
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
