#include "rt/surface.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {
namespace {

/// The proxy rests on the surface when it is that near to it, in voxel edges.
constexpr double kOnSurface_voxels = 2e-3;
/// Longest step between two looks at the field, in voxel edges: nothing that the field can show is thinner.
constexpr double kStep_voxels = 0.5;
/// Shorter ways are not gone, in voxel edges.
constexpr double kNoWay_voxels = 1e-5;
/// Where the field is flatter than that it says nothing about the direction of the surface.
constexpr double kFlat = 0.05;

/// One tick of the proxy.
class SurfaceTick {
 public:
  SurfaceTick(const LawInput& input, ProxyMemory& proxy) noexcept
      : input_(input),
        field_(input.scene.field),
        proxy_(proxy),
        hip_(input.hip_m_in_world),
        on_surface_m_(kOnSurface_voxels * field_.voxel_edge_m),
        longest_step_m_(kStep_voxels * field_.voxel_edge_m),
        p_(proxy.placed ? proxy.position_m_in_world : hip_) {}

  ForceSample force() noexcept {
    ForceSample result;
    if (!field_.covers(p_, 0)) return outside();
    look();
    if (isBuried()) {
      if (!holdOn()) goBuried();
    } else {
      result.state = liftOut() ? ContactState::entrenched : ContactState::free;
      follow();
    }
    remember();
    result.proxy_m_in_world = p_;
    result.outside_model = cut_off_ && !in_contact_;
    if (!in_contact_) {
      result.state = ContactState::free;
      return result;
    }
    if (result.state != ContactState::entrenched) result.state = ContactState::contact;
    result.normal_in_world = normal_;
    result.force_n_in_world = contactForce(input_, p_, normal_, 0);
    return result;
  }

 private:
  ForceSample outside() noexcept {
    proxy_.placed =
        proxy_.placed && !isZero(proxy_.normal_in_world);  // a free proxy is lost, one in contact waits
    return {.force_n_in_world = {}, .proxy_m_in_world = p_, .normal_in_world = {}, .outside_model = true};
  }

  static bool isZero(const Vec3& v) noexcept { return v == Vec3{}; }

  FieldSample sample(const Vec3& p) noexcept {
    ++samples_;
    return sampleField(field_, p);
  }
  bool mayLook() const noexcept { return samples_ < kMaxSurfaceSamples; }
  void look() noexcept { here_ = sample(p_); }

  /// Deep behind the surface, where the field has no direction. A proxy gets there by being placed there, or
  /// when something comes between it and the camera.
  bool isBuried() const noexcept {
    return here_.distance_m < -on_surface_m_ && (proxy_.behind || norm(here_.gradient_in_world) < kFlat);
  }

  /// What the HIP was pressed against has gone out of sight, behind something nearer to the camera: it is
  /// taken to be still there as long as the HIP presses on.
  bool holdOn() noexcept {
    normal_ = proxy_.normal_in_world;
    in_contact_ = !isZero(normal_) && dot(hip_ - p_, normal_) < 0;
    return in_contact_;
  }

  /// Nothing holds the proxy; it goes with the HIP.
  void goBuried() noexcept {
    proxy_.behind = true;
    if (!field_.covers(hip_, 0)) {
      cut_off_ = true;
      return;
    }
    p_ = hip_;
    look();
  }

  /// Out of a surface that went over it; true if it was in one.
  bool liftOut() noexcept {
    constexpr int kMaxSteps = 8;
    const bool inside = here_.distance_m < -on_surface_m_;
    for (int step = 0; step < kMaxSteps && here_.distance_m < -on_surface_m_ && mayLook(); ++step) {
      if (!stepToSurface()) break;
    }
    return inside && proxy_.placed;
  }

  /// One Newton step to distance zero, along the gradient. False where there is none or the field ends.
  bool stepToSurface() noexcept {
    const double steepness_squared = dot(here_.gradient_in_world, here_.gradient_in_world);
    if (steepness_squared < kFlat * kFlat) return false;
    const double factor = -here_.distance_m / steepness_squared;
    const double length = std::abs(factor) * std::sqrt(steepness_squared);
    const double shortening = std::min(1.0, field_.voxel_edge_m / std::max(length, 1e-12));
    const Vec3 next = p_ + (shortening * factor) * here_.gradient_in_world;
    if (!field_.covers(next, 0)) {
      cut_off_ = true;
      return false;
    }
    p_ = next;
    look();
    return true;
  }

  /// To the HIP as far as the surface lets it.
  void follow() noexcept {
    constexpr int kMaxMoves = 10;
    for (int move = 0; move < kMaxMoves && mayLook(); ++move) {
      const Vec3 way = hip_ - p_;
      in_contact_ = here_.distance_m <= on_surface_m_ && pressesOn(way);
      if (norm(way) < kNoWay_voxels * field_.voxel_edge_m) return;
      if (!(in_contact_ ? slide(way) : fly(way))) return;
    }
    in_contact_ = here_.distance_m <= 2 * on_surface_m_ && pressesOn(hip_ - p_);
  }

  /// Sets the normal; true if the way leads into the surface.
  bool pressesOn(const Vec3& way) noexcept {
    const double steepness = norm(here_.gradient_in_world);
    if (steepness < kFlat) return false;
    normal_ = (1 / steepness) * here_.gradient_in_world;
    return dot(way, normal_) < 0;
  }

  /// A step through free space, up to the surface at most. False at the end of the way or of the field.
  bool fly(const Vec3& way) noexcept {
    const double length = norm(way);
    const double step = std::min(length, longest_step_m_);
    const Vec3 from = p_;
    const FieldSample from_sample = here_;
    const Vec3 to = from + (step / length) * way;
    if (!field_.covers(to, 0)) {
      cut_off_ = true;
      return false;
    }
    p_ = to;
    look();
    if (here_.distance_m >= 0) return step < length;
    landBetween(from, from_sample, to);
    return true;
  }

  /// Where the surface lies between a place in front of it and one behind: bisection with linear
  /// interpolation.
  void landBetween(Vec3 front, FieldSample front_sample, Vec3 back) noexcept {
    FieldSample back_sample = here_;
    constexpr int kMaxSteps = 6;
    for (int step = 0; step < kMaxSteps && mayLook(); ++step) {
      const double front_m = std::max(0.0, front_sample.distance_m);
      const double share = std::clamp(front_m / (front_m - back_sample.distance_m), 0.02, 0.98);
      p_ = front + share * (back - front);
      look();
      if (std::abs(here_.distance_m) <= on_surface_m_) return;
      if (here_.distance_m > 0) {
        front = p_;
        front_sample = here_;
      } else {
        back = p_;
        back_sample = here_;
      }
    }
    p_ = front;  // never left behind the surface
    here_ = front_sample;
  }

  /// A step along the surface, which must bring the proxy nearer to the HIP. False when it is as near as it
  /// can be.
  bool slide(const Vec3& way) noexcept {
    Vec3 step = slideOf(way, normal_, 0, input_.parameters.contact.friction);
    const double length = norm(step);
    if (length < kNoWay_voxels * field_.voxel_edge_m) return false;
    if (length > longest_step_m_) step = (longest_step_m_ / length) * step;
    const Vec3 from = p_;
    const FieldSample from_sample = here_;
    const double before = dot(way, way);
    constexpr int kMaxHalvings = 3;
    for (int halving = 0; halving <= kMaxHalvings && mayLook(); ++halving) {
      const Vec3 to = from + step;
      if (!field_.covers(to, 0)) {
        cut_off_ = true;
        break;
      }
      p_ = to;
      look();
      settle();
      const Vec3 left = hip_ - p_;
      if (here_.distance_m >= -on_surface_m_ && dot(left, left) < before) return true;
      step = 0.5 * step;
    }
    p_ = from;
    here_ = from_sample;
    return false;
  }

  /// Back onto the surface after a step along its tangent, from either side.
  void settle() noexcept {
    constexpr int kMaxSteps = 4;  // near edges the gradient is not quite that of the value
    for (int step = 0; step < kMaxSteps && mayLook(); ++step) {
      if (std::abs(here_.distance_m) <= on_surface_m_ || here_.distance_m > longest_step_m_) return;
      if (!stepToSurface()) return;
    }
  }

  void remember() noexcept {
    if (here_.distance_m >= -on_surface_m_) proxy_.behind = false;
    proxy_.placed = true;
    proxy_.position_m_in_world = p_;
    proxy_.normal_in_world = in_contact_ ? normal_ : Vec3{};
    proxy_.frame = input_.scene.frame;
  }

  const LawInput& input_;
  const SurfaceField& field_;
  ProxyMemory& proxy_;
  const Vec3 hip_;
  const double on_surface_m_;
  const double longest_step_m_;
  Vec3 p_;
  FieldSample here_{};
  Vec3 normal_;
  bool in_contact_ = false;
  bool cut_off_ = false;  // the field ended on the way
  int samples_ = 0;
};

}  // namespace

ForceSample surfaceForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT {
  return SurfaceTick(input, proxy).force();
}

}  // namespace hapticd::rt
