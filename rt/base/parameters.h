// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <type_traits>

#include "rt/base/vec3.h"
#include "rt/base/words.h"

/// Plain data that configures the core. Values are checked where they enter (`config/`); ranges are in the
/// parameter table there, which names each parameter after its member. LiveParameters may change while the
/// loop runs; all others are fixed at start.
namespace hapticd::rt {

/// A force law; the enumerators are those of the table (rt/laws/law_table.h).
enum class ForceLaw : std::uint8_t;

/// The paper's four parameters, eq. (6)-(11).
struct SpringParameters {
  double stiffness_n_per_m = 500;  ///< k_s
  double radius_m = 0.04;          ///< D_thresh
  int min_points = 10;             ///< N_min
  int max_points = 100;            ///< N_max

  friend bool operator==(const SpringParameters&, const SpringParameters&) = default;
};

/// The group `force`.
struct ForceParameters : SpringParameters {
  std::optional<ForceLaw> law;  ///< empty: chosen automatically; see LiveParameters::law
  double max_error_n = 0;       ///< of a law chosen automatically; 0: just noticeable to a hand
  /// Automatic choice of k_s (automatic_stiffness.h), which then never exceeds the ceiling.
  bool stiffness_is_automatic = false;
  double stiffness_ceiling_n_per_m = 1000;
};

/// Parameters of the two constraint laws, `proxy` and `surface`; their stiffness is k_s.
struct ContactParameters {
  double friction = 0;            ///< Coulomb's coefficient of friction; 0: the proxy slides freely
  double damping_n_s_per_m = 0;   ///< opposes the HIP's velocity along the normal while in contact
  double proxy_radius_m = 0.008;  ///< law `proxy`: radius of the smallest patch treated as a plane

  friend bool operator==(const ContactParameters&, const ContactParameters&) = default;
};

/// Surface estimation of the law `surface`.
struct SurfaceParameters {
  int fusion_frames = 16;  ///< number of frames averaged for a surface at rest; 1: only the newest
  double shell_m = 0.035;  ///< a place up to this far behind the visible surface is inside the solid

  friend bool operator==(const SurfaceParameters&, const SurfaceParameters&) = default;
};

/// Filtering of raw disparities before the scene is modelled.
struct FilterParameters {
  int temporal_frames = 1;  ///< number of frames averaged for a pixel at rest; 1: off
  /// Number of frames for which a pixel without measurement keeps its last value; 0: off.
  int hold_frames = 0;
  int spatial_radius_px = 0;  ///< radius of the edge-preserving mean; 0: off

  bool isOff() const noexcept { return temporal_frames <= 1 && hold_frames <= 0 && spatial_radius_px <= 0; }
  friend bool operator==(const FilterParameters&, const FilterParameters&) = default;
};

/// Transition of the force from one frame, law or parameter set to the next.
struct BlendParameters {
  double duration_s = 1.0 / 30;  ///< 0: no blending
};

/// Action taken when k_s exceeds the stiffness that can be rendered stably with the loop's lag and the device
/// (stiffness_limit.h).
enum class StiffnessLimit : std::uint8_t { off, warn, reduce };
constexpr auto wordsOf(StiffnessLimit) {
  return words<StiffnessLimit>("off", "warn", "reduce");
}

/// Whether contact is damped as the loop's lag requires (stiffness_limit.h) or only by
/// ContactParameters::damping_n_s_per_m.
enum class ContactDamping : std::uint8_t { off, automatic };
constexpr auto wordsOf(ContactDamping) {
  return words<ContactDamping>("off", "automatic");
}

/// The safety chain between the law's force and the device.
struct SafetyParameters {
  double max_force_n = 4.0;
  double max_slew_n_per_s = 2000;
  double engage_ramp_s = 0.5;
  bool engage_inside = false;       ///< engage even if the HIP is already in contact
  double depth_timeout_s = 0.5;     ///< older depth is stale: the force goes to zero ...
  double depth_ramp_s = 0.2;        ///< ... over this time
  double handle_timeout_s = 0.01;   ///< older handle measurements are stale: the force is released at once
  double continuous_force_n = 4.0;  ///< root mean square force that the device can exert indefinitely
  double thermal_time_s = 10;       ///< time constant of the device's heating
  double force_filter_hz = 0;       ///< cut-off frequency of the low-pass; 0: off
  bool passivity_control = true;
  StiffnessLimit stiffness_limit = StiffnessLimit::reduce;
  ContactDamping contact_damping = ContactDamping::automatic;
  int overrun_burst = 5;  ///< number of late ticks among the last 64 that counts as a burst; 65: never
  double workspace_radius_m = 20;       ///< around the world's origin; no force beyond it
  double max_handle_speed_m_per_s = 5;  ///< of the hand; faster motion is treated as a fault; 0: no limit
  double max_external_force_n = 0;      ///< that another program may add; 0: none
  double max_external_power_w = 0.2;    ///< that this force may give to the hand, beyond EnergyBudget
};

/// Distances at which people are warned of a forbidden region; the core does not read them.
struct ProximityParameters {
  double warning_m = 0.01;  ///< 0: no warning before contact
};

/// The tip that the handle moves; the core does not read it (config::toFixtureSet()).
struct ToolParameters {
  double radius_m = 0;  ///< of the ball about the HIP that fixtures hold off; 0: a point
};

/// All parameters that may change while the force loop runs, as one consistent set: each group under its
/// name, and what follows from them.
struct LiveParameters {
  ForceParameters force;
  ContactParameters contact;
  SurfaceParameters surface;
  FilterParameters filter;
  BlendParameters blend;
  SafetyParameters safety;
  ProximityParameters proximity;
  ToolParameters tool;

  ForceLaw law{};  ///< in use: `force.law`, or the one that was chosen
  /// Largest clearance of the enabled stand-off fixtures: the surface is modelled that much farther.
  double standoff_clearance_m = 0;
};

/// Scaling between handle and world, and the damping of the device.
struct HandleScaleParameters {
  double motion_scale = 1;                 ///< displacement of the HIP per displacement of the hand
  double force_scale = 1;                  ///< newtons at the hand per newton of the law
  double device_damping_n_s_per_m = 0.05;  ///< device alone, at the hand
  double damping_n_s_per_m = 4;            ///< device in the lightest grip, at the hand
};

/// What a tick depends on of the handle and the camera.
struct StartParameters {
  HandleScaleParameters handle;
  double device_mass_kg = 0.045;  ///< device alone, at the hand; > 0
  double camera_latency_s = 0;    ///< from mid-exposure to the arrival of the frame
};

/// Principle by which a camera measures depth; it determines the kind of its errors.
enum class DepthPrinciple : std::uint8_t {
  structured_light,  ///< a projected pattern, matched block by block: Kinect v1
  active_stereo,     ///< two imagers, matched window by window: RealSense D400, Orbbec Gemini 330
  time_of_flight,    ///< phase of modulated light, pixel by pixel: Femto Mega
};
constexpr auto wordsOf(DepthPrinciple) {
  return words<DepthPrinciple>("structured_light", "active_stereo", "time_of_flight");
}

/// Function that converts a raw value to Z, the depth along the optical axis.
enum class DepthLawKind : std::uint8_t {
  reciprocal,  ///< 1/Z = c0 raw + c1, in 1/m: disparities of structured light
  linear,      ///< Z = c0 raw + c1, in m, for cameras that deliver depth; c0 is their depth unit
};
constexpr auto wordsOf(DepthLawKind) {
  return words<DepthLawKind>("reciprocal", "linear");
}

/// Noise of a camera's depth, pixel by pixel: sigma(Z) = c0 + c1 Z + c2 Z^2, in m with Z in m. A camera that
/// triangulates has c2 only: c2 = s / (f b) with the subpixel error s and the focal length f in pixels, and
/// the baseline b in m. All zero: unknown.
struct DepthNoiseParameters {
  double c0_m = 0;
  double c1 = 0;
  double c2_per_m = 0;
  /// Share of the variance that is the same in each frame of a resting scene, 0..1. The core takes all of it
  /// as standing; see SurfaceBuilder.
  double standing_share = 0;
  /// Distance over which the errors of neighbouring pixels are alike, >= 1; by default that of a Kinect v1,
  /// the side of its matching window. With a smaller one the core expects means over pixels to have less
  /// noise.
  double correlation_px = 9;

  bool isKnown() const noexcept { return c0_m > 0 || c1 > 0 || c2_per_m > 0; }
  /// Returns the standard deviation of Z in metres at a depth; 0 if it is not known.
  double sigma_m(double depth_m) const noexcept { return c0_m + depth_m * (c1 + depth_m * c2_per_m); }
  friend bool operator==(const DepthNoiseParameters&, const DepthNoiseParameters&) = default;
};

/// Noise of one pixel of a Kinect v1 in raw units, sigma_Z = kKinectNoise_raw |a| Z^2, for which the
/// tolerances of the core are stated. Measured on resting walls: a standing part of 0.5 and a changing one of
/// 0.2.
inline constexpr double kKinectNoise_raw = 0.54;

/// A depth camera as the core knows it: the size of its frames, the conversion of raw values to points by the
/// law of its depth and the pinhole model of eq. (1), and its noise. Given by the driver with each frame. The
/// defaults are those of a Kinect v1.
struct DepthModelParameters {
  double a_per_m = -0.003071102;  ///< reciprocal law, Z = 1 / (a raw + b); from Table I of the paper
  double b_per_m = 3.330949516;   ///< from Table I of the paper
  double fx_px = 594.214342;
  double fy_px = 591.040537;
  double cx_px = 339.307810;
  double cy_px = 242.739138;
  double near_m = 0.4;  ///< nearer measurements are rejected
  double far_m = 4.0;   ///< farther measurements are rejected
  int width_px = 640;   ///< columns u, left to right; a multiple of 16 up to kMaxFrameWidth
  int height_px = 480;  ///< rows v, top to bottom; a multiple of 4 up to kMaxFrameHeight
  DepthLawKind law = DepthLawKind::reciprocal;
  double unit_m = 0.001;                    ///< linear law, Z = unit raw
  std::uint16_t raw_no_measurement = 2047;  ///< raw value that means no measurement
  std::uint32_t raw_values = 2048;          ///< raw values are 0..raw_values-1; others are damaged data
  DepthPrinciple principle = DepthPrinciple::structured_light;
  DepthNoiseParameters noise{};

  friend bool operator==(const DepthModelParameters&, const DepthModelParameters&) = default;
};

/// T_world_camera as a translation and rotations about the fixed world axes: first roll about x, then pitch
/// about y, then yaw about z.
struct PoseParameters {
  Vec3 position_m;
  double roll_rad = 0;
  double pitch_rad = 0;
  double yaw_rad = 0;
};

/// Part of a frame that is modelled.
enum class ModelExtent : std::uint8_t {
  reach,  ///< only what the HIP can reach before the next frame
  frame,  ///< every valid pixel
};
constexpr auto wordsOf(ModelExtent) {
  return words<ModelExtent>("reach", "frame");
}

/// The scene's voxel grid. Only the number of points can be configured; tools and tests
/// change the rest. Where a hand or a camera exceeds what is allowed for, the same frame is modelled again.
struct GridParameters {
  /// The whole frame costs several times as much for the same force; haptic-replay --full-model compares.
  ModelExtent extent = ModelExtent::reach;
  /// Edge and number of voxels of the window that follows the HIP: 0.32 m, which hold what each law can reach
  /// with all values of its parameters.
  double voxel_edge_m = 0.01;
  int cells_per_axis = 32;
  int point_capacity = 65536;          ///< largest number of points in a scene while `extent` is reach
  double frame_voxel_edge_m = 0.05;    ///< of the grid over the camera's whole view, while `extent` is frame
  double max_hip_speed_m_per_s = 0.6;  ///< of the HIP in a hand that explores; a stroke is about 0.1 m/s
  double frame_period_s = 1.0 / 30;    ///< of a Kinect v1, and the usual one of other cameras
  double frame_margin_s = 0.02;        ///< tolerated lateness of a frame: most of a period
};

/// Timing and scheduling of the force loop.
struct LoopParameters {
  double rate_hz = 1000;
  int cpu = -1;       ///< CPU that the force thread is pinned to; -1: the last CPU available to the process
  int priority = 80;  ///< SCHED_FIFO priority
};

static_assert(std::is_trivially_copyable_v<LiveParameters>);

}  // namespace hapticd::rt
