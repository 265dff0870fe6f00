// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "rt/handle_channel.h"
#include "rt/loop_state.h"
#include "rt/parameters.h"
#include "rt/realtime_safe.h"
#include "rt/scene.h"

namespace hapticd::rt {

/// Positions outside this cube around the world's origin are taken for a fault of the handle.
inline constexpr double kWorkspaceHalfEdge_m = 10;

/// False also where a coordinate is not a number.  RT: safe.
inline bool inWorkspace(const Vec3& p_m) noexcept {
  return std::abs(p_m.x) <= kWorkspaceHalfEdge_m && std::abs(p_m.y) <= kWorkspaceHalfEdge_m &&
         std::abs(p_m.z) <= kWorkspaceHalfEdge_m;
}

/// The mode machine: whether a force may be exerted, how much of it, and how it goes when it may not. The
/// table of causes and reactions stands in docs/faults.md. Thread: one.  Progress: wait-free.  RT: safe.
class Supervisor {
 public:
  struct Input {
    std::int64_t now_ns;  ///< CLOCK_MONOTONIC, or any clock that the scene and the handle share
    double period_s;      ///< since the tick before
    const Scene& scene;
    const HandleState& handle;
    const Directive& directive;
    bool overran = false;      ///< the tick before ended late
    bool release = false;      ///< the loop ends now: what is left of the force goes to zero at once
    double loop_period_s = 0;  ///< that a force is held for on the device; 0: period_s
  };

  /// What keeps the force away, as far as the law need not be asked.
  struct Obstacle {
    Cause cause = Cause::none;
    bool feels = true;      ///< the law can still be asked
    bool releases = false;  ///< the force goes to zero at once
  };

  /// What the law says of this tick; nothing where it was not asked.
  struct Touch {
    bool touches = false;   ///< something would be felt at once
    bool too_near = false;  ///< ForceSample::too_near
  };

  /// To be called once per tick, before the law is asked.
  Obstacle look(const Input& input) HAPTICD_RT;

  /// The mode of this tick.
  void decide(const Input& input, const Obstacle& obstacle, const Touch& touch) HAPTICD_RT;

  /// A force that is not finite was computed.
  void fault() HAPTICD_RT {
    mode_ = Mode::faulted;
    cause_ = Cause::force_not_finite;
    gain_ = 0;
  }

  Mode mode() const noexcept { return mode_; }
  Cause cause() const noexcept { return cause_; }
  /// Share of the law's force to exert, 0..1.
  double gain() const noexcept { return gain_; }

 private:
  Cause handleTrouble(const Input& input) HAPTICD_RT;
  bool isTooFast(const Input& input) HAPTICD_RT;
  bool isOverrunning(const Input& input) HAPTICD_RT;
  bool isTooNear(const Input& input, const Touch& touch) HAPTICD_RT;
  void engageOrRefuse(const Input& input, bool touches) HAPTICD_RT;
  void moveGain(const Input& input, const Obstacle& obstacle) HAPTICD_RT;
  void refuse(Cause cause) HAPTICD_RT;

  Mode mode_ = Mode::starting;
  Cause cause_ = Cause::none;
  double gain_ = 0;
  std::int64_t last_ns_ = 0;   ///< when the gain was moved last
  std::uint64_t request_ = 0;  ///< the newest one that was decided on
  bool accepted_ = false;      ///< it has been engaged
  bool refused_ = false;       ///< it was refused, and stays so
  std::uint64_t session_ = 0;  ///< of the handle, in which the last request was made; 0: none seen yet
  bool session_changed_ = false;
  HandleState last_handle_;
  std::int64_t too_fast_until_ns_ = 0;
  std::uint64_t overruns_ = 0;  ///< bit n: the tick n before this one ended late
  std::int64_t overrunning_until_ns_ = 0;
  bool was_too_near_ = false;           ///< at the last tick
  std::int64_t too_near_since_ns_ = 0;  ///< the first tick of those that were
};

}  // namespace hapticd::rt
