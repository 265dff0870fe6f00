// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/surface_side.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "rt/laws/contact.h"

namespace hapticd::rt {
/// Returns whether a place is in the body, which extends back from its front. Places in front of it by no
/// more than noise count as well: the outline is what matters here.
bool SideContact::isSolid(const Vec3& place) noexcept {
  constexpr int kForFront = 3;
  if (!probe_.maySample(kForFront)) return true;  // no step is taken there
  const SurfaceProbe::Place there = probe_.placeOf(place);
  if (there.where == SurfaceProbe::Where::inside) return true;
  return there.where == SurfaceProbe::Where::free && there.sheet.exists &&
         there.sheet.depth_m() - SurfaceView::depthOf(place) < probe_.noise_m();
}

/// Moves the proxy towards `inside`, up to the outline.
void SideContact::retreatFrom(Vec3 inside) noexcept {
  constexpr int kHalvings = 4;
  for (int i = 0; i < kHalvings && probe_.maySample(); ++i) {
    const Vec3 middle = 0.5 * (probe_.p + inside);
    (isSolid(middle) ? inside : probe_.p) = middle;
  }
}

/// Returns the normal of a side: the mean of the directions in the image in which the body ends; zero if
/// there is none.
Vec3 SideContact::normalAt(const Vec3& inside) noexcept {
  const double radius = SurfaceProbe::kOutline_px * probe_.view.pitch_m(SurfaceView::depthOf(inside));
  const Vec3 ray = (1 / norm(inside)) * inside;
  Vec3 sum;
  for (const Vec3& direction : SurfaceProbe::kAround) {
    const Vec3 there = radius * direction;
    if (!isSolid(inside + there)) sum += there;
  }
  sum = sum - dot(sum, ray) * ray;
  const double length = norm(sum);
  constexpr double kLeast = 0.1;
  return length > kLeast * radius ? (1 / length) * sum : Vec3{};
}

bool SideContact::touch(const Vec3& inside) HAPTICD_RT {
  retreatFrom(inside);
  normal_ = normalAt(inside);
  if (normal_ == Vec3{}) {
    // The body does not end close by: a step this high is a side to whoever comes against it.
    const Vec3 ray = (1 / norm(inside)) * inside;
    const Vec3 back = probe_.p - probe_.hip;
    const Vec3 across = back - dot(back, ray) * ray;
    constexpr double kLeast = 0.1;
    const double length = norm(across);
    if (length > kLeast * norm(back)) normal_ = (1 / length) * across;
  }
  return !(normal_ == Vec3{}) && dot(probe_.toHip(), normal_) < 0;
}

bool SideContact::comeOver() HAPTICD_RT {
  normal_ = normalAt(probe_.p);
  return !(normal_ == Vec3{}) && escape() && dot(probe_.toHip(), normal_) < 0;
}

/// Moves a proxy that an outline has passed over out of the body again. Returns false if it is farther in
/// than an outline flickers.
bool SideContact::escape() noexcept {
  if (!isSolid(probe_.p)) return true;
  constexpr int kSteps = 4;
  const Vec3 step = (SurfaceProbe::kOutline_px / kSteps * probe_.pitch_m()) * normal_;
  Vec3 out = probe_.p;
  for (int i = 0; i < kSteps; ++i) {
    const Vec3 inside = out;
    out += step;
    if (isSolid(out)) continue;
    probe_.p = out;
    retreatFrom(inside);
    return true;
  }
  return false;
}

/// Moves the proxy along the side towards the HIP.
void SideContact::slide() noexcept {
  constexpr int kMaxSteps = 4;
  for (int i = 0; i < kMaxSteps; ++i) {
    const Vec3 left = slideOf(probe_.toHip(), normal_, 0, friction_);
    const double length = norm(left);
    if (length < SurfaceProbe::kNone_m) return;
    const Vec3 to = probe_.p + std::min(1.0, probe_.stride_m() / length) * left;
    if (!probe_.covers(to)) {
      probe_.cut_off = true;
      return;
    }
    const Vec3 from = probe_.p;
    probe_.p = to;
    if (!escape()) {  // another side
      probe_.p = from;
      return;
    }
  }
}

/// Moves the proxy towards the HIP up to the side. Returns false if nothing is in between.
bool SideContact::approach() noexcept {
  constexpr int kMaxSteps = 5;
  for (int i = 0; i < kMaxSteps; ++i) {
    const double gap_m = dot(probe_.p - probe_.hip, normal_);
    if (gap_m <= 0) return false;
    const double step_m = std::min(gap_m, probe_.pitch_m());
    const Vec3 to = probe_.p - step_m * normal_;
    if (isSolid(to)) {
      retreatFrom(to);
      return true;
    }
    probe_.p = to;
    if (step_m == gap_m) return false;
  }
  return true;
}

/// If the front is nearer to the HIP than the side, moves the proxy to it.
bool SideContact::frontIsNearer() noexcept {
  const double side_m = dot(probe_.p - probe_.hip, normal_);
  // In the body, as seen from the camera: behind the HIP if that is modelled, otherwise next to the outline.
  const Vec3 beside = probe_.p - (1.5 * SurfaceProbe::kOutline_px * probe_.pitch_m()) * normal_;
  const bool near_hip = side_m > norm(beside - probe_.p) && probe_.covers(probe_.hip);
  const Vec3 place = near_hip ? probe_.hip : beside;
  const SurfaceProbe::Place there = probe_.placeOf(place);
  if (there.where != SurfaceProbe::Where::inside && there.where != SurfaceProbe::Where::free) return false;
  if (!there.sheet.exists) return false;
  const double front_m = -SurfaceView::distanceFrom(there.sheet, probe_.hip);
  if (front_m >= side_m) return false;
  return probe_.settleOn(place, there.sheet.depth_m(), SurfaceProbe::kAnyDistance_m);
}

/// Lets the normal follow the outline, which flickers from frame to frame.
void SideContact::turn() noexcept {
  constexpr double kGain = 0.25;
  constexpr double kLeast_cos = 0.5;
  const Vec3 now = normalAt(probe_.p - probe_.pitch_m() * normal_);
  if (dot(now, normal_) < kLeast_cos) return;
  const Vec3 sum = normal_ + kGain * (now - normal_);
  normal_ = (1 / norm(sum)) * sum;
}

SideContact::Next SideContact::follow(bool is_new_frame) HAPTICD_RT {
  if (is_new_frame) turn();
  if (!escape()) return Next::gone;
  slide();
  if (!approach()) {
    probe_.look();
    return Next::left;
  }
  if (frontIsNearer()) return Next::front;
  probe_.look();
  return Next::holds;
}

}  // namespace hapticd::rt
