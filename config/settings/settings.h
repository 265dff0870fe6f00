// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <typeindex>

#include "config/settings/fixture_settings.h"
#include "rt/base/parameters.h"
#include "rt/base/words.h"
#include "rt/laws/law_table.h"

namespace hapticd::config {

/// A force law, or no value ("auto"): the cheapest law that is accurate enough for the scene.
using LawChoice = std::optional<rt::ForceLaw>;
inline constexpr std::string_view kAutomaticLaw = "auto";
enum class DepthLaw { paper, factory, custom };
constexpr auto wordsOf(DepthLaw) {
  return rt::words<DepthLaw>("paper", "factory", "custom");
}
/// Source of a camera's intrinsics.
enum class IntrinsicsSource { camera, configured };
constexpr auto wordsOf(IntrinsicsSource) {
  return rt::words<IntrinsicsSource>("camera", "configured");
}
enum class LedDriver { none, gpiod };
constexpr auto wordsOf(LedDriver) {
  return rt::words<LedDriver>("none", "gpiod");
}
enum class TraceCompression { none, zstd };
constexpr auto wordsOf(TraceCompression) {
  return rt::words<TraceCompression>("none", "zstd");
}
/// What a trace holds for viewers that draw a 3D picture (daemon/trace/ros/scene_picture.h).
enum class TraceScene {
  off,
  scene,  ///< HIP, proxy, force, modelled part and the camera's pose
  cloud,  ///< the points that the hand can reach too, in traces with depth
};
constexpr auto wordsOf(TraceScene) {
  return rt::words<TraceScene>("off", "scene", "cloud");
}

/// Settings of single drivers: each driver has a struct of its own in its folder, with the defaults as
/// initialisers.  Thread: as a standard container.
class DriverSettings {
 public:
  /// Returns the settings of type `Own`; the defaults if none was changed.
  template <typename Own>
  const Own& of() const {
    static const Own kDefaults{};
    const auto found = own_.find(typeid(Own));
    return found == own_.end() ? kDefaults : *std::any_cast<Own>(&found->second);
  }
  template <typename Own>
  Own& of() {
    return *std::any_cast<Own>(&own_.try_emplace(typeid(Own), Own{}).first->second);
  }

 private:
  std::map<std::type_index, std::any> own_;
};

/// Frames of a camera that delivers depth instead of raw disparities.
struct DepthFormat {
  int width_px = 0;   ///< of the frames that it sends; 0: the usual one of the camera
  int height_px = 0;  ///< of the frames that it sends; 0: the usual one of the camera
  IntrinsicsSource intrinsics = IntrinsicsSource::camera;
  int unit_um = 0;  ///< 0: 100 um where possible, otherwise the camera's own
};

/// The pose of a device in the world, as rt::PoseParameters has it.
struct PoseSettings {
  double position_x_m = 0;
  double position_y_m = 0;
  double position_z_m = 0;
  double roll_rad = 0;
  double pitch_rad = 0;
  double yaw_rad = 0;

  rt::PoseParameters pose() const {
    return {{position_x_m, position_y_m, position_z_m}, roll_rad, pitch_rad, yaw_rad};
  }
  void setPose(const rt::PoseParameters& pose) {
    const auto& [position_m, roll, pitch, yaw] = pose;
    *this = {position_m.x, position_m.y, position_m.z, roll, pitch, yaw};
  }
};

/// The camera: driver, depth conversion, noise and T_world_camera. What rt::DepthModelParameters has too is
/// explained there.
struct CameraSettings : DriverSettings, PoseSettings, DepthFormat {
  static constexpr rt::DepthModelParameters kKinect{};

  std::string driver = "freenect";  ///< a word of cameraDrivers() (driver_rows.h)
  std::string serial;               ///< empty: the first camera found
  double latency_s = 0;             ///< rt::StartParameters::camera_latency_s
  DepthLaw depth_law = DepthLaw::paper;
  double depth_a_per_m = kKinect.a_per_m;  ///< of the depth law `custom`
  double depth_b_per_m = kKinect.b_per_m;  ///< of the depth law `custom`
  double near_m = kKinect.near_m;
  double far_m = kKinect.far_m;
  double fx_px = kKinect.fx_px;
  double fy_px = kKinect.fy_px;
  double cx_px = kKinect.cx_px;
  double cy_px = kKinect.cy_px;
  double noise_c0_m = kKinect.noise.c0_m;
  double noise_c1 = kKinect.noise.c1;
  double noise_c2_per_m = kKinect.noise.c2_per_m;
  double noise_standing_share = kKinect.noise.standing_share;
  double noise_correlation_px = kKinect.noise.correlation_px;
  /// The model that a recording states, which replaces the configured one; no parameter.
  std::optional<rt::DepthModelParameters> stated_model;

  /// Returns true if the configuration describes a camera that delivers depth instead of raw disparities.
  bool deliversDepth() const;
  rt::DepthNoiseParameters noise() const {
    return {noise_c0_m, noise_c1, noise_c2_per_m, noise_standing_share, noise_correlation_px};
  }
  /// Returns a Kinect v1 with the configured range, intrinsics and noise.
  rt::DepthModelParameters configuredDepthModel() const;
  /// Returns the model of the camera as far as the configuration determines it: that which a recording
  /// states, that of the driver, or the configured one with the coefficients selected by depth_law.
  rt::DepthModelParameters effectiveDepthModel() const;
};

/// The haptic handle and T_world_handle.
struct HandleSettings : DriverSettings, PoseSettings, rt::HandleScaleParameters {
  std::string driver = "simulated";  ///< a word of handleDrivers() (driver_rows.h)
  std::string serial;                ///< of the device to use; empty: the first one found
  int clutch_button = -1;            ///< while it is held the handle moves and the HIP does not; -1: none
  double resolution_m = 5e-5;        ///< smallest motion of the hand above the device's noise
  double position_step_m = 0;        ///< of the positions that the device measures; 0: that of the driver
  /// From a command's arrival at the device to the force, beyond what its driver measures.
  double device_latency_s = 0;
  bool measure_latency = true;  ///< rt::HandleState::probes, of devices that exert forces over a link
  double device_mass_kg = 0;    ///< of the device alone, at the hand; 0: that of the driver's lightest device

  /// Returns device_mass_kg, or the driver's default if that is 0.
  double effectiveDeviceMass_kg() const;
  /// Returns position_step_m, or the driver's default if that is 0; 0: positions are exact.
  double effectivePositionStep_m() const;
};

/// The LEDs. Each line is in the form of lineAddressFrom() (line_address.h); empty: no such LED.
struct LedSettings {
  LedDriver driver = LedDriver::none;
  std::string chip;  ///< "gpiochipN", a path from /, or a label
  std::string power_line;
  std::string camera_line;
  std::string contact_line;
  std::string fault_line;
};

/// The sockets of the control API and permissions.
struct ControlSettings {
  std::string status_socket = "/run/hapticd/io.hapticd.Status";
  std::string control_socket = "/run/hapticd/io.hapticd.Control";
  bool depth_for_everyone = false;
  bool engage_at_start = false;
  bool allow_fault_injection = false;
};

/// State that the box keeps from one start to the next, in one folder: `traces`, `profiles`,
/// `registration.yaml`.
struct StateSettings {
  std::string folder = "/var/lib/hapticd";
};

/// Force traces.
struct TraceSettings {
  bool at_start = false;
  bool depth = false;  ///< raw depth in each trace, for haptic-replay
  TraceScene scene = TraceScene::scene;
  TraceCompression compression = TraceCompression::zstd;
  double max_file_mb = 1000;  ///< a larger trace continues in another file
  double max_folder_mb = 0;   ///< above it the oldest finished traces are deleted; 0: never
  double min_free_mb = 500;   ///< with less free space nothing is written
  double flight_recorder_s = 10;
};

/// The complete configuration. Each row of the parameter table (parameter_table.h) names a member as YAML
/// files do, those in `live` without this prefix, and defines unit and range; the additions have no rows.
struct Settings {
  rt::LiveParameters live;  ///< as configured: see effectiveLive()
  CameraSettings camera;
  rt::GridParameters grid;
  rt::LoopParameters loop;
  HandleSettings handle;
  LedSettings leds;
  ControlSettings control;
  StateSettings state;
  TraceSettings trace;
  SceneAdditions additions;  ///< live

  /// Returns the configured law; for auto, the one that works in every scene, until the scene is known.
  rt::ForceLaw namedLaw() const {
    return live.force.law.value_or(rt::lawThat(&rt::ForceLawRow::suits_every_scene));
  }
  /// Returns the largest error of a law chosen automatically; by default seven percent of the force limit,
  /// the smallest force difference that a hand can detect (Pang, Tan, Durlach).
  double effectiveMaxError_n() const {
    constexpr double kJustNoticeable = 0.07;
    const double configured_n = live.force.max_error_n;
    return configured_n > 0 ? configured_n : kJustNoticeable * live.safety.max_force_n;
  }
  /// Returns `live` with the configured law and the clearance of the stand-off fixtures.
  rt::LiveParameters effectiveLive() const;
  /// Returns what a tick depends on of the handle, with the mass of the device, and of the camera.
  rt::StartParameters startParameters() const {
    return {handle, handle.effectiveDeviceMass_kg(), camera.latency_s};
  }
};

}  // namespace hapticd::config
