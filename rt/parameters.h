// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <type_traits>

#include "rt/vec3.h"
#include "rt/words.h"

/// Plain data that the core is set up with. Values are checked where they enter (`config/`); ranges and
/// defaults stand in the parameter table there. "live" sets may change while the loop runs, the others are
/// fixed at start.
namespace hapticd::rt {

enum class ForceLaw : std::uint8_t {
  nearest_springs,  ///< the paper's: mean of the springs of the nearest points
  smooth_springs,   ///< weighted mean of the springs of all points near, continuous in position
  proxy,            ///< spring to a proxy that planes fitted to the raw points hold back
  surface,          ///< spring to a proxy that the visible surface holds back
};
constexpr auto wordsOf(ForceLaw) {
  return words<ForceLaw>("nearest_springs", "smooth_springs", "proxy", "surface");
}

/// Live. The paper's four parameters, eq. (6)-(11).
struct SpringParameters {
  double stiffness_n_per_m = 500;  ///< k_s
  double radius_m = 0.04;          ///< D_thresh
  int min_points = 10;             ///< N_min
  int max_points = 100;            ///< N_max

  friend bool operator==(const SpringParameters&, const SpringParameters&) = default;
};

/// Live. The two constraint laws, `proxy` and `surface`; their stiffness is k_s.
struct ContactParameters {
  double friction = 0;            ///< Coulomb's coefficient; 0: the proxy slides freely
  double damping_n_s_per_m = 0;   ///< against the HIP's velocity along the normal, while in contact
  double proxy_radius_m = 0.008;  ///< of the law `proxy`: of the smallest patch taken for a plane

  friend bool operator==(const ContactParameters&, const ContactParameters&) = default;
};

/// Live. The signed distance field of the law `surface`.
struct SurfaceParameters {
  double voxel_edge_m = 0.01;
  int fusion_frames = 16;  ///< frames that a resting surface is a mean over; 1: the newest alone
  double shell_m = 0.035;  ///< places no more than that behind the visible surface are inside the solid

  friend bool operator==(const SurfaceParameters&, const SurfaceParameters&) = default;
};

/// Live. What raw disparity passes before it is modelled.
struct FilterParameters {
  int temporal_frames = 1;    ///< frames that a still pixel is a mean over; 1: off
  int hold_frames = 0;        ///< frames that a pixel without measurement keeps its last one; 0: off
  int spatial_radius_px = 0;  ///< pixels to each side in a mean that stops at edges; 0: off

  bool isOff() const noexcept { return temporal_frames <= 1 && hold_frames <= 0 && spatial_radius_px <= 0; }
  friend bool operator==(const FilterParameters&, const FilterParameters&) = default;
};

/// Live. How the force passes from one frame, law or parameter set to the next.
struct BlendParameters {
  double duration_s = 1.0 / 30;  ///< 0: at once
  double max_surface_speed_m_per_s =
      0.5;  ///< the blend changes the force by no more than k_s times that per second
};

/// What is done where k_s is above what the loop's lag and the device let be rendered stably
/// (stiffness_limit.h).
enum class StiffnessLimit : std::uint8_t { off, warn, reduce };
constexpr auto wordsOf(StiffnessLimit) {
  return words<StiffnessLimit>("off", "warn", "reduce");
}

/// Whether contact is damped by what the loop's lag asks for (stiffness_limit.h), or only by
/// ContactParameters::damping_n_s_per_m.
enum class ContactDamping : std::uint8_t { off, automatic };
constexpr auto wordsOf(ContactDamping) {
  return words<ContactDamping>("off", "automatic");
}

/// Live. What the law's force passes before a device gets it.
struct SafetyParameters {
  double max_force_n = 4.0;
  double max_slew_n_per_s = 2000;
  double engage_ramp_s = 0.5;
  bool engage_inside = false;       ///< engage also where something is felt at once
  double depth_timeout_s = 0.5;     ///< older depth is stale: the force goes to zero
  double depth_ramp_s = 0.2;        ///< over that time
  double handle_timeout_s = 0.01;   ///< older handle measurements are stale: the force goes to zero at once
  double continuous_force_n = 4.0;  ///< root mean square over the thermal time that the device bears for ever
  double thermal_time_s = 10;       ///< time constant of the device's heating
  double force_filter_hz = 0;       ///< cut-off of the low-pass; 0: off
  bool passivity_control = true;
  double passivity_max_damping_n_s_per_m = 5;  ///< the most that passivity control brings in
  StiffnessLimit stiffness_limit = StiffnessLimit::reduce;
  ContactDamping contact_damping = ContactDamping::automatic;
  int overrun_burst = 5;                ///< late ticks of the last 64 that are a burst; 65: never
  double workspace_radius_m = 20;       ///< about the world's origin; beyond it nothing is felt
  double max_handle_speed_m_per_s = 5;  ///< of the hand; faster ones are taken for a fault; 0: no limit
};

/// Fixed at start. How the handle's motion and the law's force are scaled, and how the device moves.
struct HandleScaleParameters {
  double motion_scale = 1;                 ///< metres of the HIP per metre of the hand
  double force_scale = 1;                  ///< newtons at the hand per newton of the law
  double device_damping_n_s_per_m = 0.05;  ///< of the device alone, at the hand
  double damping_n_s_per_m = 4;            ///< of the device in the lightest grip, at the hand
  double device_mass_kg = 0.045;           ///< of the device alone, at the hand, > 0
};

/// Fixed at start. When the camera saw what a frame shows.
struct CameraTimingParameters {
  double latency_s = 0;  ///< from the middle of the exposure to the arrival of the frame
};

/// Live: all that may change while the force loop runs, as one consistent set.
struct LiveParameters {
  ForceLaw law = ForceLaw::nearest_springs;
  SpringParameters springs;
  ContactParameters contact;
  SurfaceParameters surface;
  CameraTimingParameters camera;
  FilterParameters filter;
  BlendParameters blend;
  SafetyParameters safety;
  HandleScaleParameters handle;
};

/// How raw disparity becomes depth: Z = 1 / (a d + b), and the pinhole of eq. (1).
struct DepthModelParameters {
  double a_per_m = -0.003071102;  ///< Table I
  double b_per_m = 3.330949516;   ///< Table I
  double fx_px = 594.214342;
  double fy_px = 591.040537;
  double cx_px = 339.307810;
  double cy_px = 242.739138;
  double near_m = 0.4;  ///< nearer measurements are rejected
  double far_m = 4.0;   ///< farther measurements are rejected
};

/// T_world_camera as a translation and rotations about the fixed world axes: first roll about x, then pitch
/// about y, then yaw about z.
struct PoseParameters {
  Vec3 position_m;
  double roll_rad = 0;
  double pitch_rad = 0;
  double yaw_rad = 0;
};

enum class ModelExtent : std::uint8_t {
  reach,  ///< only what the HIP can reach before the next frame
  frame,  ///< every valid pixel
};
constexpr auto wordsOf(ModelExtent) {
  return words<ModelExtent>("reach", "frame");
}

struct GridParameters {
  ModelExtent extent = ModelExtent::reach;
  double voxel_edge_m = 0.01;        ///< of the window that follows the HIP
  int cells_per_axis = 32;           ///< of the window that follows the HIP
  int point_capacity = 65536;        ///< points that a scene holds while `extent` is reach
  double frame_voxel_edge_m = 0.05;  ///< of the grid over all that the camera sees, while `extent` is frame
  double max_hip_speed_m_per_s = 0.6;
  double frame_period_s = 1.0 / 30;
  double frame_margin_s = 0.02;  ///< a frame may come that much late
};

struct LoopParameters {
  double rate_hz = 1000;
  int cpu = -1;  ///< the CPU that the force thread is pinned to; -1: the last one that the process may use
  int priority = 80;  ///< SCHED_FIFO
  bool lock_memory = true;
};

static_assert(std::is_trivially_copyable_v<LiveParameters>);

}  // namespace hapticd::rt
