// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/surface.h"

#include <algorithm>
#include <cmath>

#include "rt/laws/surface_probe.h"
#include "rt/laws/surface_pull.h"
#include "rt/laws/surface_side.h"
#include "rt/laws/surface_sight.h"

namespace hapticd::rt {
namespace {

/// A proxy that lags behind by more is repositioned.
constexpr double kMaxLag_m = 0.005;
constexpr double kMaxLag_px = 2;
/// Number of frames for which a contact is held where the proxy's measurement is missing.
constexpr std::uint64_t kHeldFrames = 30;
/// The same at the image border, where the surface may have left the view.
constexpr std::uint64_t kHeldFramesAtBorder = 4;

/// One tick of the proxy, in the camera's frame.
class SurfaceTick {
 public:
  SurfaceTick(const LawInput& input, ProxyMemory& proxy) noexcept
      : input_(input),
        model_(*input.scene.depth_model),
        memory_(proxy),
        contact_(proxy.surface),
        sight_(proxy, input.scene.frame_time_ns),
        probe_(input,
               model_.positionInCamera(proxy.placed ? proxy.position_m_in_world : input.hip_m_in_world)) {}

  ForceSample force() noexcept {
    const Vec3 start = memory_.placed ? memory_.position_m_in_world : input_.hip_m_in_world;
    if (!input_.scene.surface.covers(start, 0)) return outside(start);
    normal_ = model_.directionInCamera(memory_.normal_in_world);
    look();
    if (memory_.behind && isZero(normal_)) {
      leaveSolid();
    } else if (memory_.placed && isZero(normal_) && sight_.cameByJump(probe_)) {
      behind_ = true;
      probe_.p = probe_.hip;
    } else if (memory_.placed && sight_.outlineCameOver(probe_) && touchSideBeside()) {
      // It begins there.
    } else if (memory_.placed && contact_.hold == Hold::side) {
      followSide();
    } else if (memory_.placed && contact_.hold == Hold::vanished && !returns()) {
      giveUp();
    } else if (mustHold()) {
      held_ = in_contact_ = true;
      // It may have left the view: nothing constrains it tangentially there.
      if (probe_.at.where == Where::beyond) followAlong();
    } else {
      followFront();
    }
    return result();
  }

 private:
  using Where = SurfaceView::Where;
  using Place = SurfaceView::Place;

  bool isNewFrame() const noexcept { return contact_.frame != input_.scene.frame; }
  static bool isZero(const Vec3& v) noexcept { return v == Vec3{}; }

  ForceSample outside(const Vec3& start_m_in_world) noexcept {
    memory_.placed =
        // A free proxy is discarded, one in contact is kept.
        memory_.placed && !isZero(memory_.normal_in_world);
    contact_.lag_m_in_world = {};
    return {.force_n_in_world = {},
            .proxy_m_in_world = start_m_in_world,
            .normal_in_world = {},
            .outside_model = true};
  }

  /// Looks up the surface at the proxy. What has come in front of it by a jump is looked past, as long as it
  /// is there.
  void look() noexcept {
    probe_.look();
    if (isNewFrame() ? sight_.cameByJump(probe_) : contact_.passed_over) {
      passed_over_ = true;
      probe_.view.lookPast();
      probe_.look();
    }
  }

  /// Handles a HIP that came to be inside a solid without passing through its visible surface: there is no
  /// force until it is out again.
  void leaveSolid() noexcept {
    probe_.p = probe_.hip;
    if (!probe_.covers(probe_.p)) {
      probe_.cut_off = true;
      behind_ = true;
      return;
    }
    probe_.look();
    behind_ = probe_.at.where == Where::inside || probe_.at.where == Where::beyond;
  }

  /// Returns whether the contact must be held because the surface is no longer seen: hidden by something that
  /// it was not behind before, or too near to be measured. The surface is assumed to stay as long as the HIP
  /// presses on it; where a measurement is merely missing, for kHeldFrames, and at the image border for
  /// kHeldFramesAtBorder.
  bool mustHold() noexcept {
    if (!memory_.placed || !pressesOn(normal_)) return false;
    if (sight_.cameByJump(probe_)) return true;
    if (probe_.at.sheet.exists) return false;
    too_near_ = probe_.at.where == Where::free &&
                SurfaceView::depthOf(probe_.p) < probe_.view.nearLimit_m() + kNearLimitMargin_m;
    if (too_near_ || probe_.at.where == Where::unseen) return true;
    const std::uint64_t held = input_.scene.frame - memory_.frame;
    return held <= (probe_.at.where == Where::beyond ? kHeldFramesAtBorder : kHeldFrames);
  }

  bool pressesOn(const Vec3& normal) const noexcept {
    return !isZero(normal) && dot(probe_.toHip(), normal) < 0;
  }

  /// Moves the proxy along the plane that it rests on to where it is in front of the HIP.
  void followAlong() noexcept { probe_.p = probe_.hip - dot(probe_.toHip(), normal_) * normal_; }

  void followFront() noexcept {
    if (probe_.at.where == Where::inside) liftOut();
    if (!behind_ && lostItsSurface()) {
      Vec3 over_hip;
      if (findPlaceOverHip(probe_.p, over_hip)) probe_.settleTowards(probe_.p, over_hip, normal_);
      if (lostItsSurface() && !receded()) {
        if (!holdBeside()) giveUp();
        return;
      }
    } else if (!behind_ && pressesOn(normal_) && turnedInFrame() && holdBeside()) {
      return;
    }
    if (!behind_) follow();
  }

  void followSide() noexcept {
    SideContact side(probe_, normal_, input_.friction);
    const SideContact::Next next = side.follow(isNewFrame());
    if (next == SideContact::Next::gone) return giveUp();
    if (next != SideContact::Next::holds) return follow();
    at_side_ = in_contact_ = true;
    normal_ = side.normal();
  }

  /// Begins contact with a side. Returns false if there is none; the proxy is in front of it then.
  bool touchSide(const Vec3& inside) noexcept {
    SideContact side(probe_, {}, input_.friction);
    if (!side.touch(inside)) return false;
    at_side_ = in_contact_ = true;
    normal_ = side.normal();
    return true;
  }

  /// Begins contact with a side whose outline flickered over the proxy. Returns false if there is none.
  bool touchSideBeside() noexcept {
    SideContact side(probe_, {}, input_.friction);
    if (!side.comeOver()) return false;
    at_side_ = in_contact_ = true;
    normal_ = side.normal();
    return true;
  }

  /// Returns whether the surface under the proxy has another direction than at the last tick, which happens
  /// at outlines.
  bool turnedInFrame() const noexcept {
    return probe_.at.sheet.exists && SurfaceProbe::isSharpTurn(probe_.at.sheet.normal_in_camera, normal_);
  }

  /// Returns whether the surface under a proxy that has lost it may be the same as before, farther away.
  bool receded() const noexcept {
    return probe_.at.sheet.exists && !probe_.turnsAwayFrom(normal_) &&
           probe_.at.sheet.depth_m() - contact_.surface_depth_m <= sight_.largestMove_m(probe_);
  }

  /// Holds a proxy whose surface ends next to it, by no more than an outline flickers, on the plane of that
  /// surface. Returns false if there is none.
  bool holdBeside() noexcept {
    const Vec3 from = probe_.p;
    const Sheet here = probe_.at.sheet;
    followAlong();
    // In a crease another face holds it as well.
    const bool in_crease = here.exists && SurfaceView::distanceFrom(here, probe_.p) < -SurfaceProbe::kNone_m;
    if (in_crease || !probe_.settleBeside(normal_, sight_.largestMove_m(probe_))) {
      probe_.p = from;
      return false;
    }
    normal_ = probe_.at.sheet.normal_in_camera;
    in_contact_ = pressesOn(normal_);
    return true;
  }

  /// Returns whether a surface that had vanished is seen again where the proxy was left.
  bool returns() noexcept {
    if (!pressesOn(normal_)) return true;
    followAlong();
    probe_.look();
    return probe_.at.sheet.exists && std::abs(probe_.at.distance_m) <= sight_.largestMove_m(probe_) &&
           !SurfaceProbe::isSharpTurn(probe_.at.sheet.normal_in_camera, normal_);
  }

  /// Lets go of a surface that is no longer there, see moveOver().
  void giveUp() noexcept { vanished_ = in_contact_ = true; }

  /// Moves the proxy out of a surface that has passed over it.
  void liftOut() noexcept {
    if (!memory_.placed) {
      behind_ = true;
      probe_.p = probe_.hip;
      return;
    }
    constexpr int kMaxSteps = 2;
    for (int step = 0; step < kMaxSteps && probe_.at.where == Where::inside; ++step) {
      const Sheet sheet = probe_.at.sheet;
      const Vec3 next = probe_.p - probe_.at.distance_m * sheet.normal_in_camera;
      if (probe_.settleOn(next, sheet.depth_m(), probe_.tolerance_m(-probe_.at.distance_m))) continue;
      // Next to the outline of that body: straight towards the camera.
      probe_.settleOn(probe_.p, sheet.depth_m(), SurfaceProbe::kAnyDistance_m);
      break;
    }
    entrenched_ = true;
  }

  /// Returns whether the proxy was in contact but its surface is no longer under it.
  bool lostItsSurface() const noexcept {
    if (!memory_.placed || !pressesOn(normal_)) return false;
    return !probe_.at.sheet.exists || probe_.at.distance_m > probe_.tolerance_m(probe_.pitch_m()) ||
           probe_.turnsAwayFrom(normal_);
  }

  /// Moves the proxy towards the HIP as far as the surface allows.
  void follow() noexcept {
    constexpr int kMaxMoves = 14;
    for (int move = 0; move < kMaxMoves && probe_.maySample(); ++move) {
      const Vec3 left = probe_.hip - probe_.p;
      in_contact_ = restsOnSurface() && leadsInto(left);
      if (norm(left) < SurfaceProbe::kNone_m) break;
      if (!(in_contact_ ? slide(left) : moveFreely(left))) break;
    }
    if (at_side_ || behind_) return;
    in_contact_ = restsOnSurface() && leadsInto(probe_.hip - probe_.p);
    if (in_contact_ && lags()) catchUp();
  }

  bool restsOnSurface() const noexcept {
    constexpr double kOnSurface_m = 1e-6;
    return probe_.at.sheet.exists && std::abs(probe_.at.distance_m) <= kOnSurface_m;
  }

  /// Sets the normal; returns true if the displacement leads into the surface.
  bool leadsInto(const Vec3& displacement) noexcept {
    normal_ = probe_.at.sheet.normal_in_camera;
    return dot(displacement, normal_) < 0;
  }

  /// Takes a step through free space, at most up to the surface. Returns false at the HIP, at the end of the
  /// model or at the side of a body.
  bool moveFreely(const Vec3& left) noexcept {
    const double length = norm(left);
    const double step = std::min(length, probe_.stride_m());
    const Vec3 to = probe_.p + (step / length) * left;
    if (!probe_.covers(to)) {
      probe_.cut_off = true;
      return false;
    }
    const Place there = probe_.placeOf(to);
    if (there.where != Where::inside) {
      probe_.p = to;
      probe_.at = there;
      return step < length;
    }
    if (probe_.at.where == Where::unseen || probe_.at.where == Where::beyond) return enterFromBehind();
    // On a continuous surface the distance changes by no more than the step.
    const double allowed_m = probe_.tolerance_m(step);
    const double from_m = probe_.at.sheet.exists ? std::max(0.0, probe_.at.distance_m) : 0;
    const bool is_continuous = probe_.at.sheet.exists && from_m - there.distance_m <= allowed_m;
    if (!is_continuous && touchSide(to)) return false;
    if (there.distance_m < -allowed_m) return false;
    const double share = from_m / (from_m - there.distance_m);
    return probe_.settleOn(probe_.p + share * (to - probe_.p), there.sheet.depth_m(), allowed_m);
  }

  /// Handles a step from behind, or from outside the image, into a solid: the surface was never in between.
  bool enterFromBehind() noexcept {
    behind_ = true;
    probe_.p = probe_.hip;
    return false;
  }

  /// Takes a step along the surface, which must bring the proxy nearer to the HIP. Returns false if it is as
  /// near as it can be.
  bool slide(const Vec3& left) noexcept {
    Vec3 step = slideOf(left, normal_, 0, input_.friction);
    const double length = norm(step);
    if (length < SurfaceProbe::kNone_m) return false;
    if (length > probe_.stride_m()) step = (probe_.stride_m() / length) * step;
    constexpr int kMaxHalvings = 4;
    for (int halving = 0; halving <= kMaxHalvings && probe_.maySample(); ++halving) {
      if (stepAlong(step, left)) return true;
      if (slideAlongCrease(left)) return true;
      step = 0.5 * step;
    }
    return false;
  }

  /// Where a step along one face met another face, slides along their crease.
  bool slideAlongCrease(const Vec3& left) noexcept {
    constexpr double kMinTurn = 0.1;
    const Vec3 crease = cross(normal_, met_normal_);
    const double turn_squared = dot(crease, crease);
    if (turn_squared < kMinTurn * kMinTurn || !probe_.maySample()) return false;
    const Vec3 along = (dot(left, crease) / turn_squared) * crease;
    const double length = norm(slideOf(along, normal_, 0, input_.friction));
    if (length < SurfaceProbe::kNone_m) return false;
    return stepAlong(std::min(1.0, probe_.stride_m() / length) * along, left);
  }

  bool stepAlong(const Vec3& step, const Vec3& left) noexcept {
    met_normal_ = {};
    const Vec3 from = probe_.p;
    const Place at_start = probe_.at;
    const Vec3 to = probe_.p + step;
    const auto isNearer = [this, &left] {
      const Vec3 still_left = probe_.hip - probe_.p;
      return dot(still_left, still_left) < dot(left, left);
    };
    Vec3 over_hip;
    if (probe_.settleOn(to, SurfaceView::depthOf(to), probe_.tolerance_m(norm(step)))) {
      const bool nearer = isNearer();
      const bool around_edge = probe_.turnsAwayFrom(at_start.sheet.normal_in_camera);
      if (nearer && !(around_edge && findPlaceOverHip(from, over_hip))) return true;
      if (!nearer) met_normal_ = probe_.at.sheet.normal_in_camera;
    } else if (!probe_.cut_off) {
      // The surface ends: move over the edge, unless there is something or the HIP is still behind the
      // surface.
      const Place there = probe_.placeOf(to);
      const bool leaves_view = there.where == Where::beyond;
      if (there.where != Where::inside && probe_.covers(to) &&
          (leaves_view || !findPlaceOverHip(from, over_hip))) {
        probe_.p = to;
        probe_.at = there;
        return true;
      }
    }
    if (!isZero(over_hip) && probe_.settleTowards(to, over_hip, at_start.sheet.normal_in_camera) &&
        isNearer())
      return true;
    probe_.p = from;
    probe_.at = at_start;
    return false;
  }

  /// Finds the point of the proxy's surface in front of the HIP as seen from the camera, if the HIP is behind
  /// that surface. It prevents the proxy from slipping over an edge because noise tilts the surface at its
  /// outline.
  bool findPlaceOverHip(const Vec3& proxy, Vec3& place) noexcept {
    if (!(SurfaceView::depthOf(probe_.hip) > SurfaceView::kNearest_m)) return false;
    const ImagePosition image = probe_.view.project(probe_.hip);
    if (!probe_.view.isInImage(image)) return false;
    const Sheet sheet = probe_.sheetNear(image, SurfaceView::depthOf(proxy));
    if (!sheet.exists || SurfaceView::distanceFrom(sheet, probe_.hip) > 0) return false;
    const Vec3 found = probe_.view.placeAt(image, sheet.depth_m());
    if (std::abs(sheet.depth_m() - SurfaceView::depthOf(proxy)) > probe_.tolerance_m(norm(found - proxy)))
      return false;
    place = found;
    return true;
  }

  double maxLag_m() const noexcept { return std::max(kMaxLag_m, kMaxLag_px * probe_.pitch_m()); }
  bool lags() const noexcept {
    const Vec3 left = probe_.hip - probe_.p;
    return norm(slideOf(left, normal_, 0, input_.friction)) > maxLag_m();
  }

  /// Repositions a proxy that has got stuck: to where the line of sight to the HIP meets the same surface, if
  /// the surface is continuous up to there and the result is nearer to the HIP.
  void catchUp() noexcept {
    const Vec3 from = probe_.p;
    const Place at_start = probe_.at;
    const Vec3 left = probe_.hip - probe_.p;
    constexpr int kSteps = 6;
    bool continuous = true;
    for (int i = 1; i <= kSteps && continuous; ++i) {
      const Vec3 between = from + (static_cast<double>(i) / kSteps) * left;
      const double depth_before = SurfaceView::depthOf(probe_.p);
      const Vec3 before = probe_.p;
      continuous = probe_.settleOn(between, depth_before, SurfaceProbe::kAnyDistance_m);
      constexpr double kSteepest = 3.7;
      continuous = continuous && std::abs(SurfaceView::depthOf(probe_.p) - depth_before) <=
                                     kSteepest * norm(left) / kSteps + probe_.noise_m();
      continuous = continuous && !(probe_.p == before);
    }
    const Vec3 still_left = probe_.hip - probe_.p;
    if (continuous && dot(still_left, still_left) < dot(left, left)) {
      in_contact_ = leadsInto(still_left);
      entrenched_ = true;
      return;
    }
    probe_.p = from;
    probe_.at = at_start;
    in_contact_ = leadsInto(left);
  }

  /// Returns what holds the proxy at the end of the tick.
  Hold hold() const noexcept {
    if (!in_contact_) return Hold::nothing;
    return vanished_ ? Hold::vanished : at_side_ ? Hold::side : Hold::front;
  }

  /// Returns where the spring is to pull to: the proxy that something holds, otherwise the HIP.
  Vec3 goal_m() const noexcept { return in_contact_ && !vanished_ ? probe_.p : probe_.hip; }

  /// Returns the normal along which the surface may have moved in a new frame; zero if another surface holds
  /// the proxy, or none.
  Vec3 normalOfMotion() const noexcept {
    if (contact_.hold == Hold::nothing) return hold() == Hold::front ? normal_ : Vec3{};
    return contact_.hold == hold() ? model_.directionInCamera(memory_.normal_in_world) : Vec3{};
  }

  /// Returns the place that the spring pulls to.
  Vec3 pulledTo() noexcept {
    if (!memory_.placed) return goal_m();
    const Vec3 proxy_before = model_.positionInCamera(memory_.position_m_in_world);
    const Vec3 hip_before = model_.positionInCamera(contact_.hip_m_in_world);
    const bool was_held = contact_.hold == Hold::front || contact_.hold == Hold::side;
    const PullChange change{
        .pulled_before_m = proxy_before + model_.directionInCamera(contact_.lag_m_in_world),
        .goal_before_m = was_held ? proxy_before : hip_before,
        .goal_m = goal_m(),
        .hip_displacement_m = norm(probe_.hip - hip_before),
        .normal = isNewFrame() ? normalOfMotion() : Vec3{},
        .was_held = contact_.hold != Hold::nothing,
        .is_curved = contact_.hold == Hold::front && hold() == Hold::front,
        .is_new_frame = isNewFrame(),
        .period_s = input_.period_s};
    return moveOver(change, contact_.lag_speed_m_per_s);
  }

  /// Ends a contact that is given up when the spring has lost its tension.
  void finishGivingUp(const Vec3& pulled) noexcept {
    if (!vanished_ || norm(pulled - probe_.hip) > SurfaceProbe::kNone_m) return;
    vanished_ = in_contact_ = false;
    probe_.p = probe_.hip;
    probe_.look();
    behind_ = probe_.at.where == Where::inside;
  }

  ForceSample result() noexcept {
    ForceSample result;
    const Vec3 pulled = pulledTo();
    const bool lags = norm(pulled - goal_m()) > SurfaceProbe::kNone_m;
    finishGivingUp(pulled);
    const bool pulls = in_contact_ || lags;
    const Vec3 proxy = model_.positionInWorld(probe_.p);
    const Vec3 normal = in_contact_ ? model_.directionInWorld(normal_) : Vec3{};
    const Vec3 pulled_in_world = model_.positionInWorld(pulled);
    if (!vanished_ && !held_) sight_.remember(probe_, in_contact_);
    memory_.placed = true;
    memory_.position_m_in_world = proxy;
    memory_.normal_in_world = normal;
    if (!held_ && !vanished_) memory_.frame = input_.scene.frame;
    memory_.behind = behind_;
    contact_.hold = hold();
    contact_.lag_m_in_world = pulled_in_world - proxy;
    contact_.hip_m_in_world = input_.hip_m_in_world;
    contact_.frame = input_.scene.frame;
    contact_.passed_over = passed_over_;
    result.proxy_m_in_world = pulls ? pulled_in_world : proxy;
    result.outside_model = probe_.cut_off && !pulls;
    if (behind_ || probe_.at.where == Where::unseen || probe_.at.where == Where::beyond)
      result.state = ContactState::behind;
    if (!pulls) return result;
    result.state = entrenched_ ? ContactState::entrenched : ContactState::contact;
    result.too_near = too_near_ && held_;
    const Vec3 to_pulled = pulled_in_world - input_.hip_m_in_world;
    const double length = norm(to_pulled);
    result.normal_in_world = lags && length > 0 ? (1 / length) * to_pulled : normal;
    if (!held_ && !at_side_ && !lags)
      result.surface_velocity_m_per_s_in_world = probe_.at.sheet.speed_m_per_s * normal;
    result.force_n_in_world = contactForce(input_, pulled_in_world, result.normal_in_world, 0);
    result.depth_m = depthBelow(pulled_in_world, input_.hip_m_in_world, result.normal_in_world, 0);
    return result;
  }

  const LawInput& input_;
  const DepthModel& model_;
  ProxyMemory& memory_;
  SurfaceContact& contact_;
  SurfaceSight sight_;
  SurfaceProbe probe_;
  Vec3 normal_;
  Vec3 met_normal_;  // normal of the surface that blocked the last step along the surface
  bool in_contact_ = false;
  bool at_side_ = false;
  bool held_ = false;
  bool vanished_ = false;  // the surface that held the proxy is not there
  bool passed_over_ = false;
  bool too_near_ = false;
  bool behind_ = false;
  bool entrenched_ = false;
};

}  // namespace

ForceSample surfaceForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT {
  return SurfaceTick(input, proxy).force();
}

}  // namespace hapticd::rt
