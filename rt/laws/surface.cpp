// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rt/base/half_space.h"
#include "rt/laws/surface_field.h"
#include "rt/laws/surface_pull.h"
#include "rt/laws/surface_sight.h"

namespace hapticd::rt {
namespace {

/// Places that a proxy on its way looks at. What it does before and after it moves takes four more at most.
constexpr int kMaxLooks = 20;
/// Shorter displacements count as zero.
constexpr double kNone_m = 1e-7;
/// A proxy may be this far behind the boundary: more than the rounding of facets in single precision.
constexpr double kTolerance_m = 3e-6;
/// A step this short is not halved: what it leaves of the way changes the force by a millinewton.
constexpr double kLeastStep_m = 1e-7;
/// Number of frames for which a contact is held where the proxy's measurement is missing, and how far it may
/// slide meanwhile.
constexpr std::uint64_t kHeldFrames = 30;
constexpr double kHeldReach_m = 0.06;
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
        hip_(model_.positionInCamera(input.hip_m_in_world)),
        field_(input),
        sight_(proxy, field_, model_.directionInCamera(input.hip_velocity_m_per_s_in_world),
               input.scene.frame_time_ns) {}

  ForceSample force() noexcept {
    const Vec3 start = memory_.placed ? memory_.position_m_in_world : input_.hip_m_in_world;
    if (!input_.scene.surface.covers(start, 0)) return outside(start);
    normal_ = model_.directionInCamera(memory_.normal_in_world);
    const Vec3& front = contact_.surface_normal_in_camera;
    if (contact_.hold == Hold::surface && !SurfaceSight::isSharpTurn(normal_, front)) {
      field_.bridge(model_.positionInCamera(start), hip_, model_.positionInCamera(contact_.seen_m_in_world),
                    front, kHeldReach_m);
    }
    moveTo(model_.positionInCamera(start));
    if (isNewFrame() ? sight_.cameByJump(at_) : contact_.passed_over) {
      passed_over_ = true;
      field_.lookPast();
      moveTo(at_.place_m);
    }
    const bool was_held = !isZero(normal_);
    if ((memory_.behind && !was_held) || !memory_.placed || (!was_held && sight_.cameByJump(at_))) {
      begin();
    } else if (contact_.hold == Hold::vanished ? !returns() : was_held && vanishes()) {
      vanished_ = in_contact_ = true;
    } else if (mustHold()) {
      held_ = in_contact_ = true;
      slideWithoutSurface();
    } else {
      follow();
    }
    return result();
  }

 private:
  using Where = SurfaceView::Where;

  bool isNewFrame() const noexcept { return contact_.frame != input_.scene.frame; }
  static bool isZero(const Vec3& v) noexcept { return v == Vec3{}; }
  Vec3 toHip() const noexcept { return hip_ - at_.place_m; }
  /// Returns the distance of the HIP from a place of the proxy, as if the latter were not behind the
  /// boundary.
  double toHip_m(const SurfaceLook& look) const noexcept {
    return norm(hip_ - look.place_m) + std::max(0.0, -look.room_m);
  }
  bool covers(const Vec3& place) const noexcept {
    return input_.scene.surface.covers(model_.positionInWorld(place), 0);
  }
  SurfaceLook look(const Vec3& place) noexcept {
    ++looks_;
    return field_.look(place);
  }
  void moveTo(const Vec3& place) noexcept { at_ = look(place); }

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

  /// Places the proxy at a HIP that was nowhere before, or came to be inside a solid without passing through
  /// its visible surface: there is no force until it is out.
  void begin() noexcept {
    at_.place_m = hip_;
    behind_ = true;
    if (!covers(hip_)) {
      cut_off_ = true;
      return;
    }
    moveTo(hip_);
    behind_ = at_.room_m < 0 || at_.isIn(Where::beyond);
  }

  bool pressesOn(const Vec3& normal) const noexcept { return !isZero(normal) && dot(toHip(), normal) < 0; }

  /// Returns whether the contact must be held because the surface is no longer seen: hidden by something that
  /// it was not behind before, or too near to be measured. The surface is assumed to stay as long as the HIP
  /// presses on it; where a measurement is merely missing, for kHeldFrames and over kHeldReach_m, and at the
  /// image border for kHeldFramesAtBorder.
  bool mustHold() noexcept {
    if (!pressesOn(normal_)) return false;
    if (sight_.cameByJump(at_)) return true;
    if (at_.sheet.exists) return false;
    too_near_ = at_.isIn(Where::free) &&
                SurfaceView::depthOf(at_.place_m) < field_.view().nearLimit_m() + kNearLimitMargin_m;
    if (too_near_ || at_.isIn(Where::unseen)) return true;
    if (norm(at_.place_m - model_.positionInCamera(contact_.seen_m_in_world)) > kHeldReach_m) return false;
    const std::uint64_t held = input_.scene.frame - memory_.frame;
    return held <= (at_.isIn(Where::beyond) ? kHeldFramesAtBorder : kHeldFrames);
  }

  /// Moves the proxy along the plane that it rests on to where it is in front of the HIP.
  void slideWithoutSurface() noexcept {
    if (at_.isIn(Where::unseen) || at_.isIn(Where::inside)) return;
    const Vec3 to = at_.place_m + slideOf(toHip(), normal_, 0, input_.friction);
    if (covers(to)) moveTo(to);
  }

  /// Returns whether the surface that held the proxy is gone: a new frame shows it farther away than it can
  /// have moved, or something else in its place.
  bool vanishes() const noexcept {
    if (!isNewFrame() || !pressesOn(normal_) || !at_.sheet.exists) return false;
    // An outline that goes on moving over the HIP belongs to something that passes in front of it.
    const bool passes = at_.at_side && -at_.room_m > field_.pitch_m(at_.place_m) &&
                        norm(toHip()) > input_.parameters.surface.shell_m;
    return passes || at_.room_m > sight_.largestMove_m(at_) || sight_.cameFromTheSide(at_);
  }

  /// Returns whether a surface that had vanished is seen again where the proxy was left.
  bool returns() noexcept {
    if (!pressesOn(normal_)) return true;
    moveTo(at_.place_m + slideOf(toHip(), normal_, 0, 0));
    return at_.sheet.exists && std::abs(at_.room_m) <= sight_.largestMove_m(at_) &&
           !SurfaceSight::isSharpTurn(at_.normal, normal_);
  }

  /// Moves the proxy towards the HIP as far as the surface allows: down the distance from the HIP, on as many
  /// faces as it meets, over places that are all allowed and never away from the HIP.
  void follow() noexcept {
    if (!isAllowed(at_)) leave();
    insert(at_);
    double share = 1;
    bool tried_alone = false;
    std::size_t met = 0;
    bool blocked = false;
    while (looks_ < kMaxLooks) {
      const Vec3 to = towardsHip(share);
      if (norm(to - at_.place_m) < kNone_m) {
        // An older face may end before this place.
        if (holding_.count <= 1 || std::exchange(tried_alone, true)) break;
        holding_.count = 1;
        continue;
      }
      if (!covers(to)) {
        cut_off_ = true;
        break;
      }
      SurfaceLook next = look(to);
      if (entersFromBehind(next)) return begin();
      if (!isAllowed(next) && met < HoldingFaces::kMax - 1) {
        // Another face: the next step keeps to this side of it as well.
        insert(next);
        ++met;
        continue;
      }
      next = onAllowedSide(next);
      insert(next);
      if (!isAllowed(next) || toHip_m(next) > toHip_m(at_)) {
        blocked = true;
        if (norm(to - at_.place_m) < kLeastStep_m) break;
        share *= 0.5;
        continue;
      }
      at_ = next;
      share = 1;
      met = 0;
    }
    if (blocked) passLedge();
    constexpr double kNear_px = 2;
    if (at_.room_m > kNear_px * field_.pitch_m(at_.place_m)) return;
    // Without friction the proxy would be there.
    const Vec3 out = (input_.friction > 0 ? holding_.nearestTo(hip_) : at_.place_m) - hip_;
    // So near to the HIP, rounding decides about the direction from there.
    constexpr double kDirected_m = 1e-5;
    const double out_m = norm(out);
    normal_ = out_m > kDirected_m ? (1 / out_m) * out : at_.normal;
    in_contact_ = pressesOn(normal_);
  }

  /// Returns whether the proxy may be at a place; at the HIP itself only where that is really free, so that
  /// contact begins without a step.
  bool isAllowed(const SurfaceLook& look) const noexcept {
    return look.room_m >= (look.place_m == hip_ ? 0 : -kTolerance_m);
  }

  /// Returns whether a step leads from behind, or from outside the image, into a solid: the surface was never
  /// in between.
  bool entersFromBehind(const SurfaceLook& next) const noexcept {
    return next.isIn(Where::inside) && (at_.isIn(Where::unseen) || at_.isIn(Where::beyond));
  }

  /// Where facets disagree by no more than their noise, brings a proxy that the ledge between them holds
  /// towards the place over the HIP, as far as friction lets it slide, if that is nearer to the HIP.
  void passLedge() noexcept {
    if (at_.at_side || !(SurfaceView::depthOf(hip_) > SurfaceView::kNearest_m)) return;
    const SurfaceView& view = field_.view();
    const ImagePosition image = view.project(hip_);
    if (!view.isInImage(image)) return;
    const Sheet over = view.sheetNear(image, SurfaceView::depthOf(at_.place_m));
    if (!over.exists || SurfaceView::distanceFrom(over, hip_) >= 0) return;
    constexpr double kNoises = 2;
    constexpr double kAside_px = 2;
    const double allowed_m = kNoises * field_.noise_m(hip_) + kAside_px * field_.pitch_m(hip_);
    const Vec3 aim = view.placeAt(image, over.depth_m());
    if (norm(aim - at_.place_m) >= allowed_m) return;
    const SurfaceLook there = onAllowedSide(field_.look(slideTo(aim, allowed_m)));
    if (isAllowed(there) && toHip_m(there) < toHip_m(at_)) at_ = there;
  }

  /// Brings a place behind the boundary back to it.
  SurfaceLook onAllowedSide(SurfaceLook next) noexcept {
    constexpr int kMaxSteps = 3;
    for (int i = 0; i < kMaxSteps && !isAllowed(next) && looks_ < kMaxLooks; ++i)
      next = look(next.place_m - next.room_m * next.normal);
    return next;
  }

  /// Brings the proxy out of a surface that has come over it.
  void leave() noexcept {
    at_ = onAllowedSide(at_);
    entrenched_ = true;
  }

  void insert(const SurfaceLook& look) noexcept {
    if (isZero(look.normal)) return;
    const Vec3 foot = look.place_m - look.room_m * look.normal;
    holding_.insert(look.place_m, look.room_m, look.normal, foot, kTolerance_m);
  }

  /// Returns the next place of the proxy: towards where the faces let it come nearest to the HIP, as far as
  /// friction lets it slide, in a step that passes through nothing.
  Vec3 towardsHip(double share) const noexcept {
    constexpr double kShareOfRoom = 0.8;
    constexpr double kMostRoom_m = 0.05;
    const double most_m =
        share * std::max(field_.pitch_m(at_.place_m), kShareOfRoom * std::min(at_.room_m, kMostRoom_m));
    return slideTo(holding_.nearestTo(hip_), most_m);
  }

  /// Returns where the proxy comes on its way to `aim`: as far as friction lets it slide, `most_m` at most.
  Vec3 slideTo(const Vec3& aim, double most_m) const noexcept {
    const Vec3 way = aim - at_.place_m;
    const double length_m = norm(way);
    const double held_m = input_.friction * norm(aim - hip_);
    if (length_m <= held_m) return at_.place_m;
    return at_.place_m + (std::min(length_m - held_m, most_m) / length_m) * way;
  }

  /// Returns what holds the proxy at the end of the tick.
  Hold hold() const noexcept {
    if (!in_contact_) return Hold::nothing;
    return vanished_ ? Hold::vanished : Hold::surface;
  }

  /// Returns where the spring is to pull to: the proxy that something holds, otherwise the HIP.
  Vec3 goal_m() const noexcept { return in_contact_ && !vanished_ ? at_.place_m : hip_; }

  /// Returns the normal along which the surface may have moved in a new frame; zero if another surface holds
  /// the proxy, or none, or an outline or an assumed surface has flickered.
  Vec3 normalOfMotion() const noexcept {
    if (at_.bridged) return {};
    constexpr double kFlicker_px = 2;
    const double moved_m = norm(at_.place_m - model_.positionInCamera(memory_.position_m_in_world));
    const bool steep = SurfaceSight::isSteep(normal_, at_.place_m);
    if (steep && moved_m < kFlicker_px * field_.pitch_m(at_.place_m)) return {};
    if (contact_.hold == Hold::nothing) return hold() == Hold::surface ? normal_ : Vec3{};
    const Vec3 before = model_.directionInCamera(memory_.normal_in_world);
    const bool is_same = contact_.hold == hold() && !SurfaceSight::isSharpTurn(normal_, before);
    return is_same ? before : Vec3{};
  }

  /// Returns the place that the spring pulls to.
  Vec3 pulledTo() noexcept {
    if (!memory_.placed) return goal_m();
    const Vec3 proxy_before = model_.positionInCamera(memory_.position_m_in_world);
    const Vec3 hip_before = model_.positionInCamera(contact_.hip_m_in_world);
    const bool was_held = contact_.hold == Hold::surface;
    const PullChange change{
        .pulled_before_m = proxy_before + model_.directionInCamera(contact_.lag_m_in_world),
        .goal_before_m = was_held ? proxy_before : hip_before,
        .goal_m = goal_m(),
        .hip_displacement_m = norm(hip_ - hip_before),
        .normal = isNewFrame() ? normalOfMotion() : Vec3{},
        .was_held = contact_.hold != Hold::nothing,
        .is_curved = was_held && hold() == Hold::surface,
        .is_new_frame = isNewFrame(),
        .period_s = input_.period_s};
    return moveOver(change, contact_.lag_speed_m_per_s);
  }

  /// Ends a contact that is given up when the spring has lost its tension.
  void finishGivingUp(const Vec3& pulled) noexcept {
    if (!vanished_ || norm(pulled - hip_) > kNone_m) return;
    vanished_ = in_contact_ = false;
    moveTo(hip_);
    behind_ = at_.room_m < 0;
  }

  ForceSample result() noexcept {
    ForceSample result;
    const Vec3 pulled = pulledTo();
    const bool lags = norm(pulled - goal_m()) > kNone_m;
    finishGivingUp(pulled);
    const bool pulls = in_contact_ || lags;
    const Vec3 proxy = model_.positionInWorld(at_.place_m);
    const Vec3 normal = in_contact_ ? model_.directionInWorld(normal_) : Vec3{};
    const Vec3 pulled_in_world = model_.positionInWorld(pulled);
    if (!vanished_ && !held_ && !at_.bridged) {
      sight_.remember(at_, in_contact_);
      memory_.frame = input_.scene.frame;
      contact_.seen_m_in_world = proxy;
    }
    memory_.placed = true;
    memory_.position_m_in_world = proxy;
    memory_.normal_in_world = normal;
    memory_.behind = behind_;
    contact_.hold = hold();
    contact_.lag_m_in_world = pulled_in_world - proxy;
    contact_.hip_m_in_world = input_.hip_m_in_world;
    contact_.frame = input_.scene.frame;
    contact_.passed_over = passed_over_;
    result.proxy_m_in_world = pulls ? pulled_in_world : proxy;
    result.outside_model = cut_off_ && !pulls;
    if (behind_ || at_.isIn(Where::unseen) || at_.isIn(Where::beyond)) result.state = ContactState::behind;
    if (!pulls) return result;
    result.state = entrenched_ ? ContactState::entrenched : ContactState::contact;
    result.too_near = too_near_ && held_;
    const Vec3 to_pulled = pulled_in_world - input_.hip_m_in_world;
    const double length = norm(to_pulled);
    result.normal_in_world = lags && length > 0 ? (1 / length) * to_pulled : normal;
    if (!held_ && !at_.at_side && !lags)
      result.surface_velocity_m_per_s_in_world = at_.sheet.speed_m_per_s * normal;
    result.force_n_in_world = contactForce(input_, pulled_in_world, result.normal_in_world, 0);
    result.depth_m = depthBelow(pulled_in_world, input_.hip_m_in_world, result.normal_in_world, 0);
    return result;
  }

  const LawInput& input_;
  const DepthModel& model_;
  ProxyMemory& memory_;
  SurfaceContact& contact_;
  const Vec3 hip_;
  SurfaceField field_;
  SurfaceSight sight_;
  SurfaceLook at_;  ///< the proxy
  Vec3 normal_;
  HoldingFaces holding_;
  int looks_ = 0;
  bool cut_off_ = false;  ///< a step reached the end of the model
  bool in_contact_ = false;
  bool held_ = false;
  bool vanished_ = false;  ///< the surface that held the proxy is not there
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
