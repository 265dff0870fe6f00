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
/// What a trace holds for viewers that draw a 3D picture (drivers/trace/foxglove/foxglove_schemas.h).
enum class TraceScene {
  off,
  scene,  ///< HIP, proxy, force, modelled part and the camera's pose
  cloud,  ///< the points that the hand can reach too, in traces with depth
};
constexpr auto wordsOf(TraceScene) {
  return rt::words<TraceScene>("off", "scene", "cloud");
}

/// Live. Choice of the force law; the law in use is LiveParameters::law.
struct ForceSettings {
  LawChoice law{};
  double max_error_n = 0;  ///< while `law` is auto; 0: as effectiveMaxError_n()

  /// Returns the allowed error; the default is seven percent of the force limit, the smallest force
  /// difference that a hand can detect (Pang, Tan, Durlach).
  double effectiveMaxError_n(const rt::SafetyParameters& safety) const {
    constexpr double kJustNoticeable = 0.07;
    return max_error_n > 0 ? max_error_n : kJustNoticeable * safety.max_force_n;
  }
  /// Returns the configured law; for auto, the one that works in every scene, until the scene is known.
  rt::ForceLaw namedLaw() const { return law.value_or(rt::lawThat(&rt::ForceLawRow::suits_every_scene)); }
};

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

/// The camera: driver, depth conversion and pose.
struct CameraSettings : DriverSettings {
  std::string driver = "freenect";  ///< a word of cameraDrivers() (driver_rows.h)
  std::string serial;               ///< empty: the first camera found
  DepthFormat format;
  DepthLaw depth_law = DepthLaw::paper;
  rt::DepthModelParameters depth_model;  ///< a and b are those of the depth law `custom`
  rt::PoseParameters pose;               ///< T_world_camera

  /// Returns true if the configuration describes a camera that delivers depth instead of raw disparities.
  bool deliversDepth() const;
  /// Returns the model of the camera as far as the configuration determines it: that of its driver, or
  /// depth_model with the coefficients selected by depth_law.
  rt::DepthModelParameters effectiveDepthModel() const;
};

/// The haptic handle.
struct HandleSettings : DriverSettings {
  std::string driver = "simulated";  ///< a word of handleDrivers() (driver_rows.h)
  std::string serial;                ///< of the device to use; empty: the first one found
  rt::PoseParameters pose;           ///< T_world_handle
  int clutch_button = -1;            ///< while it is held the handle moves and the HIP does not; -1: none
  double resolution_m = 5e-5;        ///< smallest motion of the hand above the device's noise
  /// From a command's arrival at the device to the force, beyond what its driver measures.
  double device_latency_s = 0;
  bool measure_latency = true;  ///< rt::HandleState::probes, of devices that exert forces over a link
  double device_mass_kg = 0;    ///< of the device alone, at the hand; 0: that of the driver's lightest device

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

/// Live. Distances at which people are warned of a forbidden region.
struct ProximitySettings {
  double warning_m = 0.01;  ///< 0: no warning before contact
};

/// The complete configuration. The parameter table (parameter_table.h) defines name, unit, range and default
/// of each member, except the additions.
struct Settings {
  ForceSettings force;
  rt::LiveParameters live;  ///< except the law: see effectiveLive()
  CameraSettings camera;
  rt::GridParameters grid;
  rt::LoopParameters loop;
  HandleSettings handle;
  LedSettings leds;
  ControlSettings control;
  StateSettings state;
  TraceSettings trace;
  ProximitySettings proximity;
  SceneAdditions additions;  ///< live

  /// Returns `live` with the law configured in `force`, the mass of the device and the clearance of the
  /// stand-off fixtures.
  rt::LiveParameters effectiveLive() const;
};

}  // namespace hapticd::config
