// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "config/settings/fixture_settings.h"
#include "rt/base/parameters.h"
#include "rt/base/words.h"

namespace hapticd::config {

/// A force law, or no value ("auto"): the cheapest law that is accurate enough for the scene.
using LawChoice = std::optional<rt::ForceLaw>;
inline constexpr std::string_view kAutomaticLaw = "auto";
enum class CameraDriver { freenect, recorded, synthetic, v4l2 };
constexpr auto wordsOf(CameraDriver) {
  return rt::words<CameraDriver>("freenect", "recorded", "synthetic", "v4l2");
}
enum class DepthLaw { paper, factory, custom };
constexpr auto wordsOf(DepthLaw) {
  return rt::words<DepthLaw>("paper", "factory", "custom");
}
/// Source of a camera's intrinsics.
enum class IntrinsicsSource { camera, configured };
constexpr auto wordsOf(IntrinsicsSource) {
  return rt::words<IntrinsicsSource>("camera", "configured");
}
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
/// Camera that the driver `synthetic` plays.
enum class PlayedCamera { kinect, stereo, time_of_flight };
constexpr auto wordsOf(PlayedCamera) {
  return rt::words<PlayedCamera>("kinect", "stereo", "time_of_flight");
}
enum class SyntheticScene { plane, sphere, moving_sphere, edge };
constexpr auto wordsOf(SyntheticScene) {
  return rt::words<SyntheticScene>("plane", "sphere", "moving_sphere", "edge");
}
enum class SyntheticNoise { off, quantised, sensor, harsh };
constexpr auto wordsOf(SyntheticNoise) {
  return rt::words<SyntheticNoise>("off", "quantised", "sensor", "harsh");
}
enum class HandleDriver { simulated, udp, hid, falcon };
constexpr auto wordsOf(HandleDriver) {
  return rt::words<HandleDriver>("simulated", "udp", "hid", "falcon");
}
enum class HandScript { stroke, tap, lean, mixed };
constexpr auto wordsOf(HandScript) {
  return rt::words<HandScript>("stroke", "tap", "lean", "mixed");
}
enum class HidKind { controller, spacemouse };
constexpr auto wordsOf(HidKind) {
  return rt::words<HidKind>("controller", "spacemouse");
}
enum class LedDriver { none, gpiod };
constexpr auto wordsOf(LedDriver) {
  return rt::words<LedDriver>("none", "gpiod");
}
enum class TraceCompression { none, zstd };
constexpr auto wordsOf(TraceCompression) {
  return rt::words<TraceCompression>("none", "zstd");
}
/// What a trace holds for viewers that draw a 3D picture (daemon/trace/foxglove/foxglove_messages.h).
enum class TraceScene {
  off,
  scene,  ///< HIP, proxy, force, modelled part and the camera's pose
  cloud,  ///< the points that the hand can reach too, in traces with depth
};
constexpr auto wordsOf(TraceScene) {
  return rt::words<TraceScene>("off", "scene", "cloud");
}

/// A camera that the kernel drives, for the driver `v4l2`. The driver `synthetic` reads size, intrinsics and
/// unit too, unless it plays a Kinect v1.
struct V4l2Settings {
  std::string device;  ///< name in /dev/v4l/by-id, or a path; empty: by serial number, or the first one found
  int width_px = 0;    ///< of the frames that the camera sends; 0: the usual one of the camera
  int height_px = 0;   ///< of the frames that the camera sends; 0: the usual one of the camera
  int rate_hz = 30;
  IntrinsicsSource intrinsics = IntrinsicsSource::camera;
  int unit_um = 0;  ///< 0: 100 um where possible, otherwise the camera's own
  Emitter emitter = Emitter::unchanged;
  int exposure_us = 0;  ///< 0: unchanged
  int preset = 0;       ///< 0: unchanged
  SyncRole sync_role = SyncRole::unchanged;
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
struct CameraSettings : PoseSettings {
  static constexpr rt::DepthModelParameters kKinect{};

  CameraDriver driver = CameraDriver::freenect;
  std::string serial;     ///< empty: the first camera found
  std::string recording;  ///< folder with INDEX.txt or camera.yaml, for the driver `recorded`
  bool loop = true;       ///< restart at the end, for the driver `recorded`
  double speed = 1;       ///< playback speed relative to real time, for the driver `recorded`
  V4l2Settings v4l2;
  PlayedCamera played = PlayedCamera::kinect;  ///< for the driver `synthetic`
  double latency_s = 0;                        ///< rt::StartParameters::camera_latency_s
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

  /// Returns true if the configuration describes a camera that delivers depth instead of raw disparities: for
  /// the driver `v4l2`, and for `synthetic` unless it plays a Kinect v1.
  bool deliversDepth() const;
  rt::DepthNoiseParameters noise() const {
    return {noise_c0_m, noise_c1, noise_c2_per_m, noise_standing_share, noise_correlation_px};
  }
  /// Returns the configured model with the coefficients selected by depth_law. For the driver `v4l2`: the
  /// model of the camera as far as the configuration determines it; the driver completes it with what the
  /// camera reports. For the driver `synthetic`: the model of the camera that it plays.
  rt::DepthModelParameters effectiveDepthModel() const;
};

/// The analytic scene of the driver `synthetic`, in front of a camera that looks along -z.
struct SyntheticSettings {
  SyntheticScene scene = SyntheticScene::moving_sphere;
  SyntheticNoise noise = SyntheticNoise::sensor;
  double distance_m = 1.0;  ///< from the camera to the plane, or to the sphere's centre
  double tilt_rad = 0;      ///< of the plane about the camera's x axis
  double sphere_radius_m = 0.1;
  double motion_amplitude_m = 0.1;  ///< of the moving sphere, along x
  double motion_period_s = 4;
  double frame_rate_hz = 30;
  int seed = 1;  ///< of the noise
};

/// The simulated handle and the hand that holds it. The hand moves towards the surface, strokes it, taps it
/// or leans on it with press_force_n, retreats, and repeats this.
struct SimulatedHandleSettings {
  HandScript script = HandScript::stroke;
  double mass_kg = 0.045;
  double damping_n_s_per_m = 0.05;
  double friction_n = 0;  ///< of the handle, along each axis: kinetic friction and limit of static friction
  double position_quantum_m = 0;  ///< resolution of the measured position; 0: exact
  double hand_stiffness_n_per_m = 400;
  double hand_damping_n_s_per_m = 4;
  rt::Vec3 start_m_in_world{0, 0, -0.8};
  rt::Vec3 direction_in_world{0, 0, -1};  ///< of the approach; any length except zero
  double travel_m = 0.4;                  ///< distance after which the hand turns back
  double speed_m_per_s = 0.1;
  double press_force_n = 2;
  double press_s = 2;      ///< time for which it strokes or leans before it retreats
  double stroke_m = 0.05;  ///< amplitude of the stroke across the direction of approach
  double stroke_period_s = 2;
};

/// A device on another computer, connected by the packets of drivers/handle/udp/protocol.md.
struct UdpHandleSettings {
  std::string address = "127.0.0.1";  ///< of this computer, where packets of the peer arrive
  int port = 47800;
  std::string peer;  ///< address of the other computer; "address:port" accepts packets from that port only
  std::string key_file;  ///< contains the key shared by both; empty: packets are not authenticated
};

/// A device on USB HID.
struct HidHandleSettings {
  HidKind kind = HidKind::controller;
  std::string device = "1209:0001";  ///< vendor and product id, hexadecimal
  double full_speed_m_per_s = 0.1;   ///< of the HIP, at full deflection of a SpaceMouse
};

/// A Novint Falcon.
struct FalconHandleSettings {
  std::string firmware;       ///< path of the firmware image
  double force_share = 0.25;  ///< fraction of the motor counts per newton that other drivers send
};

/// The haptic handle and T_world_handle.
struct HandleSettings : PoseSettings, rt::HandleScaleParameters {
  HandleDriver driver = HandleDriver::simulated;
  std::string serial;          ///< of the device to use; empty: the first one found
  int clutch_button = -1;      ///< while it is held the handle moves and the HIP does not; -1: none
  double resolution_m = 5e-5;  ///< smallest motion of the hand above the device's noise
  /// From a command's arrival at the device to the force, beyond what its driver measures.
  double device_latency_s = 0;
  bool measure_latency = true;  ///< rt::HandleState::probes, of devices that exert forces over a link
  double device_mass_kg = 0;    ///< of the device alone, at the hand; 0: that of the driver's lightest device
  SimulatedHandleSettings simulated;
  UdpHandleSettings udp;
  HidHandleSettings hid;
  FalconHandleSettings falcon;

  /// Returns device_mass_kg, or the driver's default if that is 0.
  double effectiveDeviceMass_kg() const;
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
  SyntheticSettings synthetic;
  rt::GridParameters grid;
  rt::LoopParameters loop;
  HandleSettings handle;
  LedSettings leds;
  ControlSettings control;
  StateSettings state;
  TraceSettings trace;
  SceneAdditions additions;  ///< live

  /// Returns the configured law; for auto, the one that works in every scene, until the scene is known.
  rt::ForceLaw namedLaw() const { return live.force.law.value_or(rt::ForceLaw::surface); }
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
