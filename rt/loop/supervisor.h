// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/channels/handle_channel.h"
#include "rt/loop/loop_state.h"
#include "rt/scene/scene.h"

namespace hapticd::rt {

/// Positions outside this cube around the world's origin are treated as a fault of the handle.
inline constexpr double kWorkspaceHalfEdge_m = 10;

/// Returns whether a position is inside the cube; false if a coordinate is NaN.  RT: safe.
inline bool inWorkspace(const Vec3& p_m) noexcept {
  return std::abs(p_m.x) <= kWorkspaceHalfEdge_m && std::abs(p_m.y) <= kWorkspaceHalfEdge_m &&
         std::abs(p_m.z) <= kWorkspaceHalfEdge_m;
}

/// Decides at each tick in which mode the loop is, what share of the law's force is exerted, and how that
/// share falls to zero (docs/faults.md: causes and reactions).  Thread: one.  Progress: wait-free.  RT: safe.
class Supervisor {
 public:
  /// Input of one tick.
  struct Input {
    std::int64_t now_ns;  ///< CLOCK_MONOTONIC, or any clock shared by the scene and the handle
    double period_s;      ///< time since the previous tick
    const Scene& scene;
    const HandleState& handle;
    const Directive& directive;
    const StartParameters& start;          ///< the same at every tick
    bool overran = false;                  ///< the previous tick ended late
    bool release = false;                  ///< the loop is ending: release the remaining force
    double loop_period_s = 0;              ///< time for which the device holds a force; 0: period_s
    const FixtureSet* fixtures = nullptr;  ///< null: none
    const TissueMap* tissue = nullptr;     ///< null: none
    std::span<const FramePose> poses{};    ///< of moving frames, that have arrived since the previous tick
    Vec3 external_n_in_world{};            ///< at the hand, see externalForceAt(); zero: none
  };

  /// Reason against exerting a force that is known before the law is evaluated.
  struct Obstacle {
    Cause cause = Cause::none;
    bool law_usable = true;  ///< the law can still be evaluated
    bool releases = false;   ///< the force must be released at once
  };

  /// Result of the law for this tick; the defaults apply where it was not evaluated.
  struct Contact {
    bool in_contact = false;  ///< the HIP is in contact
    bool too_near = false;    ///< ForceSample::too_near
    bool in_debt = false;     ///< the hand has got more energy than allowed
    bool keeps = false;       ///< a fixture goes on acting without depth
  };

  /// Checks the inputs. Called once per tick, before the law is evaluated.
  Obstacle look(const Input& input) HAPTICD_RT;

  /// Decides the mode and the gain of this tick.
  void decide(const Input& input, const Obstacle& obstacle, const Contact& contact) HAPTICD_RT;

  /// Enters the mode `faulted` because a force was not finite.
  void fault() HAPTICD_RT {
    mode_ = Mode::faulted;
    cause_ = Cause::force_not_finite;
    gain_ = 0;
  }

  /// Lets the force ramp in anew: the device has had none for a while.
  void restartRamp() noexcept { gain_ = 0; }

  /// Returns the share of what needs depth, 0..1, besides gain().
  double depthShare() const noexcept { return depth_share_; }

  /// Whether a force that was granted is held at zero: what it comes from begins anew when it returns.
  bool returns() const noexcept { return mode_ == Mode::holding && accepted_ && !(gain_ > 0); }

  Mode mode() const noexcept { return mode_; }
  Cause cause() const noexcept { return cause_; }
  /// Returns the share of the law's force to exert, 0..1.
  double gain() const noexcept { return gain_; }

 private:
  Cause handleFault(const Input& input) HAPTICD_RT;
  bool isTooFast(const Input& input) HAPTICD_RT;
  bool isInconsistent(const Input& input) HAPTICD_RT;
  bool isOverrunning(const Input& input) HAPTICD_RT;
  bool isTooNear(const Input& input, const Contact& contact) HAPTICD_RT;
  void engageOrRefuse(const Input& input, bool in_contact) HAPTICD_RT;
  bool goesOnWithoutDepth(const Obstacle& obstacle, bool too_near, const Contact& contact) const HAPTICD_RT;
  void moveGain(const Input& input, const Obstacle& obstacle) HAPTICD_RT;
  void refuse(Cause cause) HAPTICD_RT;

  Mode mode_ = Mode::starting;
  Cause cause_ = Cause::none;
  double gain_ = 0;
  double depth_share_ = 1;
  bool without_depth_ = false;  ///< engaged although depth is lost
  std::int64_t last_ns_ = 0;    ///< time of the last change of the gain
  std::uint64_t request_ = 0;   ///< the newest request that was decided on
  bool accepted_ = false;       ///< that request was granted
  bool refused_ = false;        ///< that request was refused and stays refused
  std::uint64_t session_ = 0;   ///< handle session of the last request; 0: none seen yet
  bool session_changed_ = false;
  HandleState last_handle_;
  std::int64_t too_fast_until_ns_ = 0;
  double contradicting_s_ = 0;        ///< time for which the device has contradicted itself of late
  std::int64_t contradicted_ns_ = 0;  ///< when it did last
  std::uint64_t overruns_ = 0;        ///< bit n: the tick n before this one ended late
  std::int64_t overrunning_until_ns_ = 0;
  bool was_too_near_ = false;           ///< at the last tick
  std::int64_t too_near_since_ns_ = 0;  ///< first tick of the current period of being too near
};

/// Turns requests to engage or disengage into changes of the directive. Requesting force that has already
/// been requested changes nothing, whether that force is active, ramping in or held: the force loop makes a
/// new decision for every new request, and that would interrupt an active force.
/// Thread: one, the writer of the directive.
class EngageRequests {
 public:
  /// Handles one request. `inside`: engage even inside a surface, where a force acts at once; `loop`: the
  /// newest known state. Returns true if `directive` was changed and must be sent with the next generation.
  bool ask(bool engage, bool inside, const LoopState& loop, Directive& directive) noexcept {
    if (engage && isAlreadyRequested(inside, loop, directive)) return false;
    directive.engage = engage;
    directive.engage_inside = inside;
    ++directive.engage_request;
    generation_ = directive.generation + 1;
    return true;
  }

 private:
  /// Returns whether the force has already been requested and not been refused; after a refusal, or a debt of
  /// energy, a new request is needed. `loop` may be older than the loop's decision on the newest request; a
  /// refusal is then not known yet.
  bool isAlreadyRequested(bool inside, const LoopState& loop, const Directive& directive) const noexcept {
    const bool decided = loop.directive_generation >= generation_;
    const bool refused = decided && (loop.tick.mode == Mode::idle || loop.tick.cause == Cause::energy_debt);
    return directive.engage && !refused && (directive.engage_inside || !inside);
  }

  std::uint64_t generation_ = 0;  // of the directive with the newest request
};

}  // namespace hapticd::rt
