// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/surface.h"

#include <algorithm>
#include <cmath>

#include "rt/scene/visible_surface.h"

namespace hapticd::rt {
namespace {

/// Shorter displacements count as zero.
constexpr double kNone_m = 1e-7;
/// Longest step between two samples of the surface, in pixel pitches: no body visible in the image is
/// thinner.
constexpr double kStride_px = 2;
/// On a continuous surface the distance from it changes by no more than the step from one sample to the next.
/// The factor leaves room for facets that do not quite agree.
constexpr double kContinuity = 2.5;
/// Tolerated disagreement of facets in units of SurfaceView::noiseUnit_m().
constexpr double kFacetNoise = 1.5;
constexpr double kAnyDistance_m = 10;  // a tolerance that accepts every place
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
        view_(input.scene.surface, model_, input.parameters.surface.shell_m, input.frame_age_s),
        memory_(proxy),
        hip_(model_.positionInCamera(input.hip_m_in_world)),
        p_(proxy.placed ? model_.positionInCamera(proxy.position_m_in_world) : hip_) {}

  ForceSample force() noexcept {
    const Vec3 start = memory_.placed ? memory_.position_m_in_world : input_.hip_m_in_world;
    if (!input_.scene.surface.covers(start, 0)) return outside(start);
    sampleProxy();
    normal_ = model_.directionInCamera(memory_.normal_in_world);
    if (memory_.behind && isZero(normal_)) {
      leaveSolid();
    } else if (mustHold()) {
      held_ = in_contact_ = true;
      // It may have left the view: nothing constrains it tangentially there.
      if (at_proxy_.where == Where::beyond) p_ = hip_ - dot(hip_ - p_, normal_) * normal_;
    } else {
      if (at_proxy_.where == Where::inside) liftOut();
      Vec3 over_hip;
      if (lostItsSurface() && findPlaceOverHip(p_, over_hip)) settleTowards(p_, over_hip, normal_);
      if (!behind_) follow();
    }
    return result();
  }

 private:
  using Where = SurfaceView::Where;
  using Place = SurfaceView::Place;

  static bool isZero(const Vec3& v) noexcept { return v == Vec3{}; }

  ForceSample outside(const Vec3& start_m_in_world) noexcept {
    memory_.placed =
        // A free proxy is discarded, one in contact is kept.
        memory_.placed && !isZero(memory_.normal_in_world);
    return {.force_n_in_world = {},
            .proxy_m_in_world = start_m_in_world,
            .normal_in_world = {},
            .outside_model = true};
  }

  bool maySample() const noexcept { return samples_ < kMaxSurfaceSamples; }
  Place placeOf(const Vec3& p) noexcept {
    ++samples_;
    return view_.sample(p);
  }
  void sampleProxy() noexcept { at_proxy_ = placeOf(p_); }
  double pitch_m() const noexcept { return view_.pitch_m(SurfaceView::depthOf(p_)); }
  double stride_m() const noexcept { return kStride_px * pitch_m(); }
  /// Returns how far a continuous surface may be off the place after a step of this length.
  double tolerance_m(double step_m) const noexcept {
    return kContinuity * step_m + kFacetNoise * view_.noiseUnit_m(SurfaceView::depthOf(p_));
  }
  bool covers(const Vec3& p) const noexcept {
    return input_.scene.surface.covers(model_.positionInWorld(p), 0);
  }

  /// Handles a HIP that came to be inside a solid without passing through its visible surface: there is no
  /// force until it is out again.
  void leaveSolid() noexcept {
    p_ = hip_;
    if (!covers(p_)) {
      cut_off_ = true;
      behind_ = true;
      return;
    }
    sampleProxy();
    behind_ = at_proxy_.where == Where::inside || at_proxy_.where == Where::beyond;
  }

  /// Returns whether the contact must be held because the surface is no longer seen: hidden by something that
  /// it was not behind before, or too near to be measured. The surface is assumed to stay as long as the HIP
  /// presses on it; where a measurement is merely missing, for kHeldFrames, and at the image border for
  /// kHeldFramesAtBorder.
  bool mustHold() noexcept {
    if (!memory_.placed || isZero(normal_) || at_proxy_.sheet.exists) return false;
    if (!(dot(hip_ - p_, normal_) < 0)) return false;
    too_near_ =
        at_proxy_.where == Where::free && SurfaceView::depthOf(p_) < view_.nearLimit_m() + kNearLimitMargin_m;
    if (too_near_ || at_proxy_.where == Where::unseen) return true;
    const std::uint64_t held = input_.scene.frame - memory_.frame;
    return held <= (at_proxy_.where == Where::beyond ? kHeldFramesAtBorder : kHeldFrames);
  }

  /// Moves the proxy out of a surface that has passed over it.
  void liftOut() noexcept {
    if (!memory_.placed) {
      behind_ = true;
      p_ = hip_;
      return;
    }
    constexpr int kMaxSteps = 2;
    for (int step = 0; step < kMaxSteps && at_proxy_.where == Where::inside; ++step) {
      const Sheet sheet = at_proxy_.sheet;
      const Vec3 next = p_ - at_proxy_.distance_m * sheet.normal_in_camera;
      if (settleOn(next, sheet.depth_m(), tolerance_m(-at_proxy_.distance_m))) continue;
      // Next to the outline of that body: straight towards the camera.
      settleOn(p_, sheet.depth_m(), kAnyDistance_m);
      break;
    }
    entrenched_ = true;
  }

  /// Returns whether the proxy was in contact but its surface is no longer under it.
  bool lostItsSurface() const noexcept {
    if (behind_ || !memory_.placed || isZero(normal_) || !(dot(hip_ - p_, normal_) < 0)) return false;
    return !at_proxy_.sheet.exists || at_proxy_.distance_m > tolerance_m(pitch_m()) || turnsAwayFrom(normal_);
  }

  /// Compensates for the outline of a body that flickers from frame to frame: moves the proxy to the nearest
  /// point of the surface between `from`, at the outline, and the point in front of the HIP at which the
  /// surface does not turn away from `normal`. Returns false, leaving the proxy in place, if there is none.
  bool settleTowards(const Vec3& from, const Vec3& over_hip, const Vec3& normal) noexcept {
    const Vec3 start = p_;
    const Place at_start = at_proxy_;
    const double depth_m = SurfaceView::depthOf(from);
    const Vec3 displacement = over_hip - from;
    constexpr int kSteps = 6;
    for (int i = 1; i <= kSteps; ++i) {
      const double share = static_cast<double>(i) / kSteps;
      const Vec3 step = share * displacement;
      if (settleOn(from + step, depth_m, tolerance_m(norm(step))) && !turnsAwayFrom(normal)) return true;
    }
    p_ = start;
    at_proxy_ = at_start;
    return false;
  }

  /// Moves the proxy to the point of the surface at the image position of `p`, near the depth `depth_m`.
  /// Returns false if there is none within `room_m` of `p`.
  bool settleOn(const Vec3& p, double depth_m, double room_m) noexcept {
    if (!(SurfaceView::depthOf(p) > SurfaceView::kNearest_m)) return false;
    const ImagePosition image = view_.project(p);
    if (!view_.isInImage(image)) return false;
    ++samples_;
    const Sheet sheet = view_.sheetNear(image, depth_m);
    if (!sheet.exists || std::abs(SurfaceView::distanceFrom(sheet, p)) > room_m) return false;
    const Vec3 place = view_.placeAt(image, sheet.depth_m());
    if (!covers(place)) {
      cut_off_ = true;
      return false;
    }
    p_ = place;
    at_proxy_ = {.where = Where::free, .sheet = sheet, .distance_m = 0};
    return true;
  }

  /// Moves the proxy towards the HIP as far as the surface allows.
  void follow() noexcept {
    constexpr int kMaxMoves = 14;
    for (int move = 0; move < kMaxMoves && maySample(); ++move) {
      const Vec3 left = hip_ - p_;
      in_contact_ = restsOnSurface() && leadsInto(left);
      if (norm(left) < kNone_m) break;
      if (!(in_contact_ ? slide(left) : moveFreely(left))) break;
    }
    if (at_side_ || behind_) return;
    in_contact_ = restsOnSurface() && leadsInto(hip_ - p_);
    if (in_contact_ && lags()) catchUp();
  }

  bool restsOnSurface() const noexcept {
    constexpr double kOnSurface_m = 1e-6;
    return at_proxy_.sheet.exists && std::abs(at_proxy_.distance_m) <= kOnSurface_m;
  }

  /// Sets the normal; returns true if the displacement leads into the surface.
  bool leadsInto(const Vec3& displacement) noexcept {
    normal_ = at_proxy_.sheet.normal_in_camera;
    return dot(displacement, normal_) < 0;
  }

  /// Takes a step through free space, at most up to the surface. Returns false at the HIP, at the end of the
  /// model or at the side of a body.
  bool moveFreely(const Vec3& left) noexcept {
    const double length = norm(left);
    const double step = std::min(length, stride_m());
    const Vec3 to = p_ + (step / length) * left;
    if (!covers(to)) {
      cut_off_ = true;
      return false;
    }
    const Place there = placeOf(to);
    if (there.where != Where::inside) {
      p_ = to;
      at_proxy_ = there;
      return step < length;
    }
    if (at_proxy_.where == Where::unseen || at_proxy_.where == Where::beyond) return enterFromBehind();
    const double allowed_m = tolerance_m(step);
    if (there.distance_m < -allowed_m) return touchSide(to);
    const double from_m = at_proxy_.sheet.exists ? std::max(0.0, at_proxy_.distance_m) : 0;
    const double share = from_m / (from_m - there.distance_m);
    return settleOn(p_ + share * (to - p_), there.sheet.depth_m(), allowed_m);
  }

  /// Handles a step from behind, or from outside the image, into a solid: the surface was never in between.
  bool enterFromBehind() noexcept {
    behind_ = true;
    p_ = hip_;
    return false;
  }

  /// Handles contact with the side of a body, which the camera does not see: it is assumed to extend straight
  /// back from the outline in the image.
  bool touchSide(const Vec3& inside) noexcept {
    Vec3 blocked = inside;
    constexpr int kHalvings = 3;
    for (int i = 0; i < kHalvings && maySample(); ++i) {
      const Vec3 middle = 0.5 * (p_ + blocked);
      const Place there = placeOf(middle);
      if (there.where == Where::inside) {
        blocked = middle;
      } else {
        p_ = middle;
        at_proxy_ = there;
      }
    }
    const Vec3 outward = sideNormal(blocked);
    at_side_ = in_contact_ = false;
    if (isZero(outward) || !(dot(hip_ - p_, outward) < 0)) return false;
    at_side_ = in_contact_ = true;
    normal_ = outward;
    return slideAlongSide();
  }

  /// Returns the normal of a side: the mean of the directions in the image in which there is no solid at this
  /// depth.
  Vec3 sideNormal(const Vec3& at) noexcept {
    constexpr double kRadius_px = 2;
    constexpr double kDiagonal = 0.70710678118654752;
    constexpr double kDirections[8][2] = {
        {1, 0},  {kDiagonal, kDiagonal},   {0, 1},  {-kDiagonal, kDiagonal},
        {-1, 0}, {-kDiagonal, -kDiagonal}, {0, -1}, {kDiagonal, -kDiagonal}};
    const double radius = kRadius_px * view_.pitch_m(SurfaceView::depthOf(at));
    const Vec3 ray = (1 / norm(at)) * at;
    Vec3 sum;
    for (const auto& direction : kDirections) {
      if (!maySample()) break;
      const Vec3 there{radius * direction[0], radius * direction[1], 0};
      if (placeOf(at + there).where != Where::inside) sum += there;
    }
    sum = sum - dot(sum, ray) * ray;
    const double length = norm(sum);
    return length > 0.1 * radius ? (1 / length) * sum : Vec3{};
  }

  /// Takes a step along the side towards the HIP. Returns false if there is none to take.
  bool slideAlongSide() noexcept {
    const Vec3 left = hip_ - p_;
    Vec3 step = slideOf(left, normal_, 0, input_.friction);
    const double length = norm(step);
    if (length < kNone_m) return false;
    step = std::min(1.0, 0.5 * stride_m() / length) * step;
    const Vec3 to = p_ + step;
    if (!covers(to)) {
      cut_off_ = true;
      return false;
    }
    const Place there = placeOf(to);
    if (there.where == Where::inside) return false;
    p_ = to;
    at_proxy_ = there;
    return true;
  }

  /// Takes a step along the surface, which must bring the proxy nearer to the HIP. Returns false if it is as
  /// near as it can be.
  bool slide(const Vec3& left) noexcept {
    Vec3 step = slideOf(left, normal_, 0, input_.friction);
    const double length = norm(step);
    if (length < kNone_m) return false;
    if (length > stride_m()) step = (stride_m() / length) * step;
    constexpr int kMaxHalvings = 4;
    for (int halving = 0; halving <= kMaxHalvings && maySample(); ++halving) {
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
    if (turn_squared < kMinTurn * kMinTurn || !maySample()) return false;
    const Vec3 along = (dot(left, crease) / turn_squared) * crease;
    const double length = norm(slideOf(along, normal_, 0, input_.friction));
    if (length < kNone_m) return false;
    return stepAlong(std::min(1.0, stride_m() / length) * along, left);
  }

  bool stepAlong(const Vec3& step, const Vec3& left) noexcept {
    met_normal_ = {};
    const Vec3 from = p_;
    const Place at_start = at_proxy_;
    const Vec3 to = p_ + step;
    const auto isNearer = [this, &left] {
      const Vec3 still_left = hip_ - p_;
      return dot(still_left, still_left) < dot(left, left);
    };
    Vec3 over_hip;
    if (settleOn(to, SurfaceView::depthOf(to), tolerance_m(norm(step)))) {
      const bool nearer = isNearer();
      const bool around_edge = turnsAwayFrom(at_start.sheet.normal_in_camera);
      if (nearer && !(around_edge && findPlaceOverHip(from, over_hip))) return true;
      if (!nearer) met_normal_ = at_proxy_.sheet.normal_in_camera;
    } else if (!cut_off_) {
      // The surface ends: move over the edge, unless there is something or the HIP is still behind the
      // surface.
      const Place there = placeOf(to);
      const bool leaves_view = there.where == Where::beyond;
      if (there.where != Where::inside && covers(to) && (leaves_view || !findPlaceOverHip(from, over_hip))) {
        p_ = to;
        at_proxy_ = there;
        return true;
      }
    }
    if (!isZero(over_hip) && settleTowards(to, over_hip, at_start.sheet.normal_in_camera) && isNearer())
      return true;
    p_ = from;
    at_proxy_ = at_start;
    return false;
  }

  /// Returns whether the surface turns away from `normal` and is nearly parallel to the ray: it goes around
  /// the edge of a body.
  bool turnsAwayFrom(const Vec3& normal) const noexcept {
    constexpr double kSharpTurn_cos = 0.82;  // 35 degrees
    constexpr double kSteep_cos = 0.26;      // 75 degrees
    const Vec3& here = at_proxy_.sheet.normal_in_camera;
    return dot(here, normal) < kSharpTurn_cos && -dot(here, p_) < kSteep_cos * norm(p_);
  }

  /// Finds the point of the proxy's surface in front of the HIP as seen from the camera, if the HIP is behind
  /// that surface. It prevents the proxy from slipping over an edge because noise tilts the surface at its
  /// outline.
  bool findPlaceOverHip(const Vec3& proxy, Vec3& place) noexcept {
    if (!(SurfaceView::depthOf(hip_) > SurfaceView::kNearest_m)) return false;
    const ImagePosition image = view_.project(hip_);
    if (!view_.isInImage(image)) return false;
    ++samples_;
    const Sheet sheet = view_.sheetNear(image, SurfaceView::depthOf(proxy));
    if (!sheet.exists || SurfaceView::distanceFrom(sheet, hip_) > 0) return false;
    const Vec3 found = view_.placeAt(image, sheet.depth_m());
    if (std::abs(sheet.depth_m() - SurfaceView::depthOf(proxy)) > tolerance_m(norm(found - proxy)))
      return false;
    place = found;
    return true;
  }

  double maxLag_m() const noexcept { return std::max(kMaxLag_m, kMaxLag_px * pitch_m()); }
  bool lags() const noexcept {
    const Vec3 left = hip_ - p_;
    return norm(slideOf(left, normal_, 0, input_.friction)) > maxLag_m();
  }

  /// Repositions a proxy that has got stuck: to where the line of sight to the HIP meets the same surface, if
  /// the surface is continuous up to there and the result is nearer to the HIP.
  void catchUp() noexcept {
    const Vec3 from = p_;
    const Place at_start = at_proxy_;
    const Vec3 left = hip_ - p_;
    constexpr int kSteps = 6;
    bool continuous = true;
    for (int i = 1; i <= kSteps && continuous; ++i) {
      const Vec3 between = from + (static_cast<double>(i) / kSteps) * left;
      const double depth_before = SurfaceView::depthOf(p_);
      const Vec3 before = p_;
      continuous = settleOn(between, depth_before, kAnyDistance_m);
      constexpr double kSteepest = 3.7;
      continuous =
          continuous && std::abs(SurfaceView::depthOf(p_) - depth_before) <=
                            kSteepest * norm(left) / kSteps + kFacetNoise * view_.noiseUnit_m(depth_before);
      continuous = continuous && !(p_ == before);
    }
    const Vec3 still_left = hip_ - p_;
    if (continuous && dot(still_left, still_left) < dot(left, left)) {
      in_contact_ = leadsInto(still_left);
      entrenched_ = true;
      return;
    }
    p_ = from;
    at_proxy_ = at_start;
    in_contact_ = leadsInto(left);
  }

  ForceSample result() noexcept {
    ForceSample result;
    const Vec3 proxy = model_.positionInWorld(p_);
    const Vec3 normal = in_contact_ ? model_.directionInWorld(normal_) : Vec3{};
    memory_.placed = true;
    memory_.position_m_in_world = proxy;
    memory_.normal_in_world = normal;
    if (!held_) memory_.frame = input_.scene.frame;
    memory_.behind = behind_;
    result.proxy_m_in_world = proxy;
    result.outside_model = cut_off_ && !in_contact_;
    if (behind_ || at_proxy_.where == Where::unseen || at_proxy_.where == Where::beyond)
      result.state = ContactState::behind;
    if (!in_contact_) return result;
    result.state = entrenched_ ? ContactState::entrenched : ContactState::contact;
    result.too_near = too_near_ && held_;
    result.normal_in_world = normal;
    if (!held_ && !at_side_)
      result.surface_velocity_m_per_s_in_world = at_proxy_.sheet.speed_m_per_s * normal;
    result.force_n_in_world = contactForce(input_, proxy, normal, 0);
    result.depth_m = depthBelow(proxy, input_.hip_m_in_world, normal, 0);
    return result;
  }

  const LawInput& input_;
  const DepthModel& model_;
  const SurfaceView view_;
  ProxyMemory& memory_;
  const Vec3 hip_;
  Vec3 p_;
  Place at_proxy_;
  Vec3 normal_;
  Vec3 met_normal_;  // normal of the surface that blocked the last step along the surface
  bool in_contact_ = false;
  bool at_side_ = false;
  bool held_ = false;
  bool too_near_ = false;
  bool behind_ = false;
  bool entrenched_ = false;
  bool cut_off_ = false;  // the step reached the end of the model
  int samples_ = 0;
};

}  // namespace

ForceSample surfaceForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT {
  return SurfaceTick(input, proxy).force();
}

}  // namespace hapticd::rt
