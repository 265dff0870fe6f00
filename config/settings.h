// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "rt/parameters.h"
#include "rt/words.h"

namespace hapticd::config {

/// A force law; without a value ("auto") the cheapest that is accurate enough for the scene.
using LawChoice = std::optional<rt::ForceLaw>;
inline constexpr std::string_view kAutomaticLaw = "auto";
enum class CameraDriver { freenect, recorded, synthetic };
constexpr auto wordsOf(CameraDriver) {
  return rt::words<CameraDriver>("freenect", "recorded", "synthetic");
}
enum class DepthLaw { paper, factory, custom };
constexpr auto wordsOf(DepthLaw) {
  return rt::words<DepthLaw>("paper", "factory", "custom");
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

/// Live. What the force law is chosen by; the law itself is LiveParameters::law.
struct ForceSettings {
  LawChoice law{};
  double max_error_n = 0;  ///< for a law that is not named; 0: as below

  /// Seven percent of the force limit: the smallest difference that a hand feels (Pang, Tan, Durlach).
  double effectiveMaxError_n(const rt::SafetyParameters& safety) const {
    constexpr double kJustNoticeable = 0.07;
    return max_error_n > 0 ? max_error_n : kJustNoticeable * safety.max_force_n;
  }
  /// The law that is named; else the one that works everywhere, until the scene is known.
  rt::ForceLaw namedLaw() const { return law.value_or(rt::ForceLaw::surface); }
};

struct CameraSettings {
  CameraDriver driver = CameraDriver::freenect;
  std::string serial;     ///< empty: the first camera found
  std::string recording;  ///< folder with INDEX.txt, for the driver `recorded`
  bool loop = true;       ///< the driver `recorded` starts again at the end
  double speed = 1;       ///< the driver `recorded` plays that many times faster than the clock
  DepthLaw depth_law = DepthLaw::paper;
  rt::DepthModelParameters depth_model;  ///< a and b here are those of the law `custom`
  rt::PoseParameters pose;               ///< T_world_camera

  /// depth_model with the coefficients that depth_law stands for.
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
/// or leans on it with press_force_n, retreats, and begins again.
struct SimulatedHandleSettings {
  HandScript script = HandScript::stroke;
  double mass_kg = 0.045;
  double damping_n_s_per_m = 0.05;
  double friction_n = 0;          ///< of the handle, along each axis: kinetic, and the limit of sticking
  double position_quantum_m = 0;  ///< step of the measured position; 0: none
  double hand_stiffness_n_per_m = 400;
  double hand_damping_n_s_per_m = 4;
  rt::Vec3 start_m_in_world{0, 0, -0.8};
  rt::Vec3 direction_in_world{0, 0, -1};  ///< of the approach; any length but zero
  double travel_m = 0.4;                  ///< the hand turns back after that distance
  double speed_m_per_s = 0.1;
  double press_force_n = 2;
  double press_s = 2;      ///< how long it strokes or leans before it retreats
  double stroke_m = 0.05;  ///< amplitude of the stroke across the direction of approach
  double stroke_period_s = 2;
};

/// A device on another computer, behind the packets of drivers/handle/udp/protocol.md.
struct UdpHandleSettings {
  std::string address = "127.0.0.1";  ///< of this computer, where packets of the peer arrive
  int port = 47800;
  std::string peer;      ///< address of the other computer; "address:port" takes packets from that port only
  std::string key_file;  ///< with the key that both share; empty: packets are not authenticated
};

struct HidHandleSettings {
  HidKind kind = HidKind::controller;
  std::string device = "1209:0001";  ///< vendor and product, hexadecimal
  double full_speed_m_per_s = 0.1;   ///< of the HIP, at full deflection of a SpaceMouse
};

struct FalconHandleSettings {
  std::string firmware;       ///< path of the image that the device is loaded with
  double force_share = 0.25;  ///< motor counts, of those that the peers' scale asks for
};

struct HandleSettings {
  HandleDriver driver = HandleDriver::simulated;
  std::string serial;          ///< of the device to use; empty: the first one found
  rt::PoseParameters pose;     ///< T_world_handle
  int clutch_button = -1;      ///< while it is held the handle moves and the HIP does not; -1: there is none
  double resolution_m = 5e-5;  ///< smallest motion of the hand that the device tells from noise
  int thread_priority = -1;    ///< SCHED_FIFO; 0: none; -1: what the driver needs
  double device_mass_kg = 0;   ///< of the device alone, at the hand; 0: the lightest of the driver's
  SimulatedHandleSettings simulated;
  UdpHandleSettings udp;
  HidHandleSettings hid;
  FalconHandleSettings falcon;

  /// device_mass_kg, or what stands for 0 with the driver.
  double effectiveDeviceMass_kg() const;
};

/// Each line as lineAddressFrom() (line_address.h) reads it; empty: there is no such LED.
struct LedSettings {
  LedDriver driver = LedDriver::none;
  std::string chip;  ///< "gpiochipN", a path from /, or a label
  std::string power_line;
  std::string camera_line;
  std::string contact_line;
  std::string fault_line;
};

struct ControlSettings {
  std::string status_socket = "/run/hapticd/io.hapticd.Status";
  std::string control_socket = "/run/hapticd/io.hapticd.Control";
  bool depth_for_everyone = false;
  bool engage_at_start = false;
  bool allow_fault_injection = false;
};

/// What the box keeps from one start to the next, below one folder: `traces`, `profiles`,
/// `registration.yaml`.
struct StateSettings {
  std::string folder = "/var/lib/hapticd";
};

struct TraceSettings {
  bool at_start = false;
  bool depth = false;  ///< raw depth in each trace, for haptic-replay
  TraceCompression compression = TraceCompression::zstd;
  double max_file_mb = 1000;  ///< a larger trace goes on in another file
  double max_file_s = 3600;   ///< as does an older one
  double max_folder_mb = 0;   ///< above that the oldest finished traces are deleted; 0: none ever is
  double min_free_mb = 500;   ///< with less free space nothing is written
  double flight_recorder_s = 10;
};

/// Everything that can be configured. The parameter table (parameter_table.h) names each member, its unit,
/// range and default.
struct Settings {
  ForceSettings force;
  rt::LiveParameters live;  ///< but its law: see effectiveLive()
  CameraSettings camera;
  SyntheticSettings synthetic;
  rt::GridParameters grid;
  rt::LoopParameters loop;
  HandleSettings handle;
  LedSettings leds;
  ControlSettings control;
  StateSettings state;
  TraceSettings trace;

  /// `live` with the law that `force` names and the mass of the device.
  rt::LiveParameters effectiveLive() const;
};

}  // namespace hapticd::config
