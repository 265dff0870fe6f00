#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "rt/force_blend.h"
#include "rt/force_laws.h"
#include "rt/handle_channel.h"
#include "rt/loop_state.h"
#include "rt/parameters.h"
#include "rt/realtime_safe.h"
#include "rt/safety_chain.h"
#include "rt/scene.h"

namespace hapticd::rt {

/// Positions outside this cube around the world's origin are taken for a fault of the handle.
inline constexpr double kWorkspaceHalfEdge_m = 10;

/// False also where a coordinate is not a number.  RT: safe.
inline bool inWorkspace(const Vec3& p_m) noexcept {
  return std::abs(p_m.x) <= kWorkspaceHalfEdge_m && std::abs(p_m.y) <= kWorkspaceHalfEdge_m &&
         std::abs(p_m.z) <= kWorkspaceHalfEdge_m;
}

/// One force tick without clock and channels: inputs in, force out. The mode machine, the law and the safety
/// chain live here; the force loop and the offline tools call it.
/// Thread: one.  RT: step() is safe.
class HapticCore {
 public:
  /// `point_capacity`: of the scenes to be felt.  RT: not safe (allocates).
  explicit HapticCore(std::size_t point_capacity) : laws_(point_capacity) {}

  struct Input {
    std::int64_t now_ns;  ///< CLOCK_MONOTONIC, or any clock that the scene and the handle share
    double period_s;      ///< since the step before
    const Scene& scene;
    const HandleState& handle;
    const Directive& directive;
  };

  /// Fills everything of a Tick but its number and its timing.
  /// Errors: stale, missing and invalid input ends in force zero with a cause, at the slew limit's pace.
  Tick step(const Input& input) HAPTICD_RT;

  /// The law's force at a HIP, whatever the mode, before any safety stage.
  ForceSample lawForce(const Scene& scene, const Vec3& hip_m_in_world,
                       const LiveParameters& parameters) HAPTICD_RT;

  /// Forgets the proxy: the next force of a constraint law begins with the proxy at the HIP.
  void release() HAPTICD_RT { laws_.release(); }

  /// Around this place the next tick needs the scene modelled: the proxy of a constraint law, else the HIP.
  Vec3 focus_m_in_world(const Vec3& hip_m_in_world) const HAPTICD_RT {
    return laws_.focus_m_in_world(hip_m_in_world);
  }

 private:
  /// What the force before came from; a change of it is blended.
  struct Origin {
    std::uint64_t model = 0;  ///< 0: there was none
    ForceLaw law = ForceLaw::nearest_springs;
    SpringParameters springs;
    ContactParameters contact;
    bool held = false;
    friend bool operator==(const Origin&, const Origin&) = default;
  };
  /// What the force before was computed from.
  struct Before {
    Vec3 hip_m_in_world;
    Vec3 velocity_m_per_s_in_world;
    Vec3 force_n_in_world;
  };

  void decideMode(const Input& input, Cause obstacle) HAPTICD_RT;
  Vec3 feel(const Input& input, Tick& tick) HAPTICD_RT;
  Vec3 blend(const Input& input, const Vec3& force_n_in_world, Tick& tick) HAPTICD_RT;
  double unexplained_n(const Input& input, const Vec3& force_n_in_world) const HAPTICD_RT;
  double rampGain(const Input& input) HAPTICD_RT;

  ForceLaws laws_;
  ForceBlend blend_;
  Origin origin_;
  Before before_;
  SafetyChain safety_;
  Mode mode_ = Mode::starting;
  Cause cause_ = Cause::none;
  double engaged_s_ = 0;        ///< since the mode became `engaged`
  Vec3 held_force_n_in_world_;  ///< of the last tick whose neighbourhood was modelled
  double outside_model_s_ = 0;  ///< since then
};

}  // namespace hapticd::rt
