// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/proxy.h"

#include <algorithm>
#include <cmath>

#include "rt/scene/plane_fit_kernel.h"

namespace hapticd::rt {
namespace {

constexpr double kSmallRadius_px = 5;
constexpr double kLargeRadius_px = 20;  // more than four times the 9 px over which noise is correlated
constexpr double kMinLarge_m = 0.016;
/// Noise including rounding on a surface at rest, measured with real cameras.
constexpr double kNoise_raw = 0.6;
constexpr double kMinNoise_m = 1e-4;
/// A large patch counts as flat up to kFlat variances of the noise and as not flat from kNotFlat on.
constexpr double kFlat = 2.2;
constexpr double kNotFlat = 4.5;
/// Sum of weights (each at most 1) below which points do not determine a surface.
constexpr double kMinWeight = 2;
/// If the fitted slope relative to the assumed normal is steeper, the next look uses a smaller patch.
constexpr double kMaxSlope = 1.5;
/// The proxy does not fall into holes narrower than twice this.
constexpr double kHole_m = 0.011;

struct Frame {
  Vec3 x, y, normal;

  explicit Frame(const Vec3& n) noexcept : normal(n) {
    const Vec3 least = std::abs(n.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 across = least - dot(least, n) * n;
    x = (1 / norm(across)) * across;
    y = cross(n, x);
  }
};

/// A plane h = height + slope_x x + slope_y y and the residuals of its points.
struct Fit {
  double height_m = 0;
  double slope_x = 0;
  double slope_y = 0;
  double residual_m2 = 0;
  double mean_x_m = 0;
  double mean_y_m = 0;
};

/// Fits a plane by least squares. `blur_m`: spread of the points below which they do not determine the slope;
/// the slope is then drawn towards the assumed normal, which the next look replaces by the result of this
/// one.
Fit fitOf(const PlaneSums& s, double blur_m) noexcept {
  Fit fit;
  const double per_w = 1 / s.w;
  fit.mean_x_m = per_w * s.x;
  fit.mean_y_m = per_w * s.y;
  const double mean_h = per_w * s.h;
  const double xx = per_w * s.xx - fit.mean_x_m * fit.mean_x_m + blur_m * blur_m;
  const double yy = per_w * s.yy - fit.mean_y_m * fit.mean_y_m + blur_m * blur_m;
  const double xy = per_w * s.xy - fit.mean_x_m * fit.mean_y_m;
  const double xh = per_w * s.xh - fit.mean_x_m * mean_h;
  const double yh = per_w * s.yh - fit.mean_y_m * mean_h;
  const double determinant = xx * yy - xy * xy;  // positive, because of the blur
  fit.slope_x = (xh * yy - yh * xy) / determinant;
  fit.slope_y = (yh * xx - xh * xy) / determinant;
  const double slope = std::hypot(fit.slope_x, fit.slope_y);
  if (slope > kMaxSlope) {
    fit.slope_x *= kMaxSlope / slope;
    fit.slope_y *= kMaxSlope / slope;
  }
  fit.height_m = mean_h - fit.slope_x * fit.mean_x_m - fit.slope_y * fit.mean_y_m;
  fit.residual_m2 = std::max(0.0, per_w * s.hh - mean_h * mean_h - fit.slope_x * xh - fit.slope_y * yh);
  return fit;
}

Fit mixOf(const Fit& a, const Fit& b, double share_of_a) noexcept {
  const auto mix = [share_of_a](double of_a, double of_b) {
    return share_of_a * of_a + (1 - share_of_a) * of_b;
  };
  return {mix(a.height_m, b.height_m), mix(a.slope_x, b.slope_x),  mix(a.slope_y, b.slope_y), 0,
          mix(a.mean_x_m, b.mean_x_m), mix(a.mean_y_m, b.mean_y_m)};
}

/// Returns the large patch where it is flat up to noise, otherwise the small one.
Fit choose(const PlanePoints& points, const PatchSizes& sizes) noexcept {
  const double blur_m = sizes.pitch_m;
  if (points.small.w < kMinWeight) return fitOf(points.large, blur_m);
  const Fit small = fitOf(points.small, blur_m);
  const Fit large = fitOf(points.large, blur_m);
  const double variances = large.residual_m2 / (sizes.noise_m * sizes.noise_m);
  return mixOf(large, small, std::clamp((kNotFlat - variances) / (kNotFlat - kFlat), 0.0, 1.0));
}

}  // namespace

PatchSizes PatchSizes::at(const DepthModel& model, double depth_m, double min_radius_m,
                          double max_radius_m) noexcept {
  const DepthModelParameters& camera = model.parameters();
  PatchSizes sizes;
  sizes.pitch_m = depth_m / std::min(camera.fx_px, camera.fy_px);
  sizes.noise_m = std::max(kMinNoise_m, kNoise_raw * model.noiseUnit_m(depth_m));
  sizes.small_radius_m = std::min(max_radius_m, std::max(min_radius_m, kSmallRadius_px * sizes.pitch_m));
  sizes.large_radius_m = std::max(
      sizes.small_radius_m, std::min(max_radius_m, std::max(kLargeRadius_px * sizes.pitch_m, kMinLarge_m)));
  return sizes;
}

Patch patchAt(const Scene& scene, const Vec3& place_m_in_world, const Vec3& side_in_world,
              const PatchSizes& sizes, double band_m) HAPTICD_RT {
  const Vec3 local = place_m_in_world - scene.origin_m_in_world;
  const Vec3 from_camera = place_m_in_world - scene.depth_model->cameraPosition_m_in_world();
  const Vec3 sight = (1 / std::max(norm(from_camera), 1e-9)) * from_camera;
  const Frame frame(side_in_world);
  const LocalBall ball{static_cast<float>(local.x), static_cast<float>(local.y), static_cast<float>(local.z),
                       static_cast<float>(sizes.large_radius_m)};
  const PlanePoints points = sumForPlane(scene, {ball, frame.x, frame.y, frame.normal, sight,
                                                 sizes.small_radius_m, band_m, sizes.large_radius_m, band_m});
  Patch patch{.points = points.points, .nearest_m = points.nearest_m, .normal = {}};
  patch.exists = points.large.w >= kMinWeight;
  if (!patch.exists) return patch;
  const Fit fit = choose(points, sizes);
  const double scale = 1 / std::sqrt(1 + fit.slope_x * fit.slope_x + fit.slope_y * fit.slope_y);
  patch.normal = scale * (frame.normal - fit.slope_x * frame.x - fit.slope_y * frame.y);
  patch.height_m = -scale * fit.height_m;
  const double away = dot(patch.normal, sight);
  if (away > 0) {  // no camera sees a surface from behind
    const Vec3 across = patch.normal - away * sight;
    patch.normal = (1 / norm(across)) * across;
  }
  patch.supported = points.nearest_beside_m <= sizes.pitch_m;
  if (patch.supported) return patch;
  const double offset_m = std::hypot(fit.mean_x_m, fit.mean_y_m);
  if (offset_m < sizes.pitch_m) {
    patch.supported = true;  // in the middle of a hole
    return patch;
  }
  const Vec3 outward = (-1 / offset_m) * (fit.mean_x_m * frame.x + fit.mean_y_m * frame.y);
  const LocalBall hole{ball.x_m, ball.y_m, ball.z_m,
                       static_cast<float>(std::min(2 * kHole_m, sizes.large_radius_m))};
  patch.supported =
      points.nearest_m < kHole_m && reachOfPoints_m(scene, hole, patch.normal, band_m, outward) > 0;
  return patch;
}

namespace {

/// Shorter distances count as zero.
constexpr double kNoDistance_m = 1e-6;
/// Longest step between two looks, in radii of the small patch.
constexpr double kStepShare = 0.5;
/// After a shorter step, in radii of the small patch, the plane is still the same.
constexpr double kSettledShare = 0.1;
constexpr double kShareGrowth = 1.05;
/// Smallest sliding share; sufficient for a HIP as deep in a hollow as a hand can push (40 mm) and a hollow
/// of less than a millimetre.
constexpr double kMinSlideShare = 1.0 / 64;
/// In an oscillation between two slides the shorter one is at least this fraction of the longer one.
constexpr double kSwingShare = 0.25;
/// After this many points the proxy continues at the next tick, whatever distance is left.
constexpr std::uint32_t kMaxPointsPerTick = 20'000;
/// Half thickness of a plane in standard deviations of its noise.
constexpr double kBandOfNoise = 3;
/// A surface last seen nearer than near_m plus this fraction may have come too near to be measured.
constexpr double kAlmostTooNear = 0.1;

/// One tick of the law `proxy`.
class ProxyTick {
 public:
  ProxyTick(const LawInput& input, ProxyMemory& proxy) noexcept
      : input_(input),
        scene_(input.scene),
        proxy_(proxy),
        radii_(ProxyRadii::of(input.parameters.contact)),
        hip_(input.hip_m_in_world),
        p_(proxy.placed ? proxy.position_m_in_world : hip_),
        held_(!isZero(proxy.normal_in_world)),
        side_(held_ ? proxy.normal_in_world : proxy.side_in_world) {}

  ForceSample force() noexcept {
    ForceSample result;
    const bool modelled = scene_.covers(p_, radii_.most_m);
    if (modelled) comeBackIntoSight();
    if (!scene_.covers(p_, radii_.most_m)) {
      proxy_.placed = proxy_.placed && held_;
      if (modelled) proxy_.position_m_in_world = p_;  // so that the scene is modelled there next
      result.outside_model = true;
      result.proxy_m_in_world = p_;
      return result;
    }
    follow();
    remember();
    result.proxy_m_in_world = p_;
    result.points_used = here_.points;
    result.outside_model = cut_off_ && !in_contact_;
    if (!in_contact_) {
      if (proxy_.under || proxy_.behind) result.state = ContactState::behind;
      return result;
    }
    result.too_near = too_near_;
    result.state = entrenched_ ? ContactState::entrenched : ContactState::contact;
    result.normal_in_world = side_;
    result.force_n_in_world = contactForce(input_, p_, side_, here_.height_m);
    result.depth_m = depthBelow(p_, input_.hip_m_in_world, side_, here_.height_m);
    return result;
  }

 private:
  static bool isZero(const Vec3& v) noexcept { return v == Vec3{}; }

  Vec3 towardsCamera(const Vec3& p) const noexcept {
    const Vec3 to_camera = scene_.depth_model->cameraPosition_m_in_world() - p;
    const double length = norm(to_camera);
    return length > 0 ? (1 / length) * to_camera : Vec3{0, 0, 1};
  }

  /// The surface that the camera sees on the ray through a place.
  struct Sight {
    bool in_image = false;
    std::uint16_t raw = 0;  ///< of the pixel, if it is in the image
    double behind_m = -1;   ///< distance of the place behind that surface along the ray; -1: nothing is seen
    double depth_m = 0;     ///< of the place
  };

  Sight sightOf(const Vec3& p) const noexcept {
    const DepthModel& model = *scene_.depth_model;
    const DepthModelParameters& camera = model.parameters();
    const Vec3 local = model.positionInCamera(p);
    Sight sight;
    sight.depth_m = -local.z;
    if (sight.depth_m <= kNoDistance_m) return sight;
    const double u = camera.fx_px * local.x / sight.depth_m + camera.cx_px;
    const double v = camera.cy_px - camera.fy_px * local.y / sight.depth_m;
    const PixelWindow& window = scene_.image_window;
    sight.in_image = u > window.column_first - 0.5 && u < window.column_last + 0.5 &&
                     v > window.row_first - 0.5 && v < window.row_last + 0.5;
    if (!sight.in_image) return sight;
    const auto column = static_cast<std::size_t>(std::lround(u));
    const auto row = static_cast<std::size_t>(std::lround(v));
    sight.raw = scene_.image[row * static_cast<std::size_t>(model.stride_px()) + column];
    const double seen = model.depth_m(sight.raw);
    if (seen > 0) sight.behind_m = (sight.depth_m - seen) * norm(local) / sight.depth_m;
    return sight;
  }

  /// Handles a new frame that shows a surface in front of a proxy which was in sight: up to the distance that
  /// a surface can have moved, the proxy is brought to it. Anything farther in front is another body, which
  /// hides the surface.
  void comeBackIntoSight() noexcept {
    if (!proxy_.placed || proxy_.frame == scene_.frame || (proxy_.behind && !held_)) return;
    const double behind = sightOf(p_).behind_m;
    if (behind <= radii_.least_m || behind > radii_.swept_m) return;
    if (held_) {
      look();
      if (here_.exists && here_.supported && std::abs(here_.height_m) < radii_.least_m) return;
    }
    p_ = p_ + behind * towardsCamera(p_);
    held_ = true;
    entrenched_ = true;
  }

  bool mayLook() const noexcept { return looks_ < kMaxProxyMoves && points_looked_at_ < kMaxPointsPerTick; }

  void look() noexcept {
    ++looks_;
    const double depth = -scene_.depth_model->positionInCamera(p_).z;
    sizes_ = PatchSizes::at(*scene_.depth_model, depth, radii_.least_m, radii_.most_m);
    const double band_m =
        (held_ ? sizes_.small_radius_m : sizes_.large_radius_m) + kBandOfNoise * sizes_.noise_m;
    here_ = patchAt(scene_, p_, isZero(side_) ? towardsCamera(p_) : side_, sizes_, band_m);
    points_looked_at_ += here_.points;
    side_ = here_.exists ? here_.normal : Vec3{};
  }

  void follow() noexcept {
    look();
    under_ = isUnderAtFirst();
    for (bool moving = true; moving;) moving = takeStep();
    if (!in_contact_ && !isZero(proxy_.normal_in_world) && isTooNear()) hold();
  }

  /// Returns whether the proxy is on the far side of the surface next to it, which it reached around an edge.
  bool isUnderAtFirst() const noexcept {
    const bool was_under = proxy_.placed ? proxy_.under && !held_ : !held_;
    return was_under && here_.exists && here_.height_m < 0;
  }

  /// Takes one step towards the HIP; returns false if there is none to take.
  bool takeStep() noexcept {
    const Vec3 to_hip = hip_ - p_;
    hip_below_ = here_.exists && here_.height_m + dot(to_hip, here_.normal) < 0;
    // points far away determine the position of the surface only roughly
    const bool surface_known =
        held_ || here_.nearest_m <= sizes_.small_radius_m + kBandOfNoise * sizes_.noise_m;
    in_contact_ = hip_below_ && surface_known && here_.supported && !under_;
    return in_contact_ ? slide(to_hip) : moveFreely(to_hip);
  }

  /// Takes a step through free space.
  bool moveFreely(const Vec3& to_hip) noexcept {
    const double length = norm(to_hip);
    if (length < kNoDistance_m || !mayLook()) return false;
    const double longest =
        std::max(here_.nearest_m - sizes_.small_radius_m, kStepShare * sizes_.small_radius_m);
    const bool comes_beside = under_ || !here_.exists || (hip_below_ && !here_.supported);
    held_ = false;
    proxy_.slide_share = 1;
    proxy_.last_slide_m = {};
    if (!moveBy((std::min(length, longest) / length) * to_hip)) return false;
    under_ = comes_beside && here_.exists && here_.height_m < 0;
    return true;
  }

  /// Returns whether one slide undoes the other. A remainder of a completed slide may point anywhere, but it
  /// is short.
  static bool oscillates(const Vec3& before, const Vec3& now) noexcept {
    return -dot(before, now) > kSwingShare * std::max(dot(before, before), dot(now, now));
  }

  /// Takes a step along the surface and onto it.
  bool slide(const Vec3& to_hip) noexcept {
    Vec3 along = slideOf(to_hip, here_.normal, here_.height_m, input_.friction);
    // deep in a hollow narrower than that depth, whole steps would oscillate with growing amplitude
    proxy_.slide_share = oscillates(proxy_.last_slide_m, along)
                             ? std::max(kMinSlideShare, 0.5 * proxy_.slide_share)
                             : std::min(1.0, kShareGrowth * proxy_.slide_share);
    proxy_.last_slide_m = along;
    const double length = norm(along);
    const double longest = kStepShare * sizes_.small_radius_m;
    along = proxy_.slide_share * std::min(1.0, length > 0 ? longest / length : 1.0) * along;
    const Vec3 step = along - here_.height_m * here_.normal;
    held_ = true;
    const double settled_m = proxy_.slide_share * kSettledShare * sizes_.small_radius_m;
    const bool modelled = scene_.covers(p_ + step, radii_.most_m);
    if (norm(step) > settled_m && mayLook() && modelled) return moveBy(step);
    p_ += step;  // at the end of the model, stay on the same plane; the next tick requests another model
    here_.height_m = 0;
    return false;
  }

  /// Moves by `step`. Returns false at the end of the model, where the proxy waits for the next one.
  bool moveBy(const Vec3& step) noexcept {
    const double length = norm(step);
    const double modelled_m = scene_.ball_radius_m - radii_.most_m - norm(p_ - scene_.ball_centre_m_in_world);
    cut_off_ = modelled_m < length && !scene_.covers(p_ + step, radii_.most_m);
    p_ += (cut_off_ ? std::max(0.0, modelled_m) / length : 1) * step;
    if (!cut_off_) look();
    return !cut_off_;
  }

  /// Returns whether the surface that held the proxy may have come nearer than the camera can measure.
  bool isTooNear() const noexcept {
    const Sight sight = sightOf(proxy_.position_m_in_world);
    const DepthModel& model = *scene_.depth_model;
    if (!sight.in_image) return false;
    if (model.isMeasurement(sight.raw)) return model.isNearerThanLimit(sight.raw);
    return sight.depth_m < (1 + kAlmostTooNear) * model.parameters().near_m;
  }

  /// Keeps the contact where it was.
  void hold() noexcept {
    p_ = proxy_.position_m_in_world;
    side_ = proxy_.normal_in_world;
    here_.height_m = 0;
    in_contact_ = dot(hip_ - p_, side_) < 0;
    too_near_ = in_contact_;
  }

  void remember() noexcept {
    proxy_.placed = true;
    proxy_.position_m_in_world = p_;
    proxy_.normal_in_world = in_contact_ ? side_ : Vec3{};
    proxy_.side_in_world = side_;
    proxy_.frame = scene_.frame;
    proxy_.behind = sightOf(p_).behind_m > 0;
    proxy_.under = under_;
  }

  const LawInput& input_;
  const Scene& scene_;
  ProxyMemory& proxy_;
  const ProxyRadii radii_;
  const Vec3 hip_;
  Vec3 p_;
  bool held_;  // held by a surface at the last step
  Vec3 side_;  // normal of the surface next to the proxy
  Patch here_;
  PatchSizes sizes_{};
  bool hip_below_ = false;  // the HIP is below the surface
  bool in_contact_ = false;
  bool entrenched_ = false;
  bool under_ = false;
  bool too_near_ = false;
  bool cut_off_ = false;  // the step reached the end of the model
  int looks_ = 0;
  std::uint32_t points_looked_at_ = 0;
};

}  // namespace

ForceSample proxyForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT {
  return ProxyTick(input, proxy).force();
}

}  // namespace hapticd::rt
