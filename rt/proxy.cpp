// SPDX-License-Identifier: Apache-2.0
#include "rt/proxy.h"

#include <algorithm>
#include <cmath>

#include "rt/proxy_patch.h"

namespace hapticd::rt {
namespace {

/// Shorter distances are not gone.
constexpr double kNoDistance_m = 1e-6;
/// Longest step without a new look, in radii of the small patch.
constexpr double kStepShare = 0.5;
/// After a shorter step the plane still is the same.
constexpr double kSettledShare = 0.1;
constexpr double kShareGrowth = 1.05;
/// Enough for a HIP that is as deep in a hollow as the hand can push, 40 mm, and a hollow of less than a
/// millimetre.
constexpr double kLeastSlideShare = 1.0 / 64;
/// Of two slides that swing to and fro the shorter one is at least that share of the longer one.
constexpr double kSwingShare = 0.25;
/// After that many points the proxy goes on at the next tick, whatever distance is left.
constexpr std::uint32_t kMostPointsPerTick = 20'000;
/// A plane is as thick as that many standard deviations of its noise.
constexpr double kBandOfNoise = 3;
/// What had been seen nearer than near_m plus that share of it may have come too near to be measured at all.
constexpr double kAlmostTooNear = 0.1;

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
      if (modelled) proxy_.position_m_in_world = p_;  // there the scene is modelled next
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
    return result;
  }

 private:
  static bool isZero(const Vec3& v) noexcept { return v == Vec3{}; }

  Vec3 towardsCamera(const Vec3& p) const noexcept {
    const Vec3 to_camera = scene_.depth_model->cameraPosition_m_in_world() - p;
    const double length = norm(to_camera);
    return length > 0 ? (1 / length) * to_camera : Vec3{0, 0, 1};
  }

  /// What the camera sees on the ray to a place.
  struct Sight {
    bool in_image = false;
    std::uint16_t raw = kRawNoMeasurement;
    double behind_m = -1;  ///< of the place behind what is seen, along the ray; -1 where nothing is seen
    double depth_m = 0;    ///< of the place
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
    sight.raw = std::min<std::uint16_t>(scene_.image[row * kFrameWidth + column], kRawNoMeasurement);
    const double seen = model.depth_m(sight.raw);
    if (seen > 0) sight.behind_m = (sight.depth_m - seen) * norm(local) / sight.depth_m;
    return sight;
  }

  /// A new frame may show the surface in front of a proxy that was in sight. What is farther before it than a
  /// surface can have come is something else, which hides it.
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

  bool mayLook() const noexcept { return looks_ < kMaxProxyMoves && points_looked_at_ < kMostPointsPerTick; }

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
    for (bool moves = true; moves;) moves = moveOn();
    if (!in_contact_ && !isZero(proxy_.normal_in_world) && isTooNear()) hold();
  }

  /// Whether the proxy is on the far side of the surface next to it, having come there beside it.
  bool isUnderAtFirst() const noexcept {
    const bool was_under = proxy_.placed ? proxy_.under && !held_ : !held_;
    return was_under && here_.exists && here_.height_m < 0;
  }

  /// One step towards the HIP; false when there is none to take.
  bool moveOn() noexcept {
    const Vec3 to_hip = hip_ - p_;
    presses_ = here_.exists && here_.height_m + dot(to_hip, here_.normal) < 0;
    // what is far away says roughly at best where the surface is
    const bool knows = held_ || here_.nearest_m <= sizes_.small_radius_m + kBandOfNoise * sizes_.noise_m;
    in_contact_ = presses_ && knows && here_.supported && !under_;
    return in_contact_ ? slide(to_hip) : fly(to_hip);
  }

  /// A step through free space.
  bool fly(const Vec3& to_hip) noexcept {
    const double length = norm(to_hip);
    if (length < kNoDistance_m || !mayLook()) return false;
    const double longest =
        std::max(here_.nearest_m - sizes_.small_radius_m, kStepShare * sizes_.small_radius_m);
    const bool comes_beside = under_ || !here_.exists || (presses_ && !here_.supported);
    held_ = false;
    proxy_.slide_share = 1;
    proxy_.last_slide_m = {};
    if (!moveBy((std::min(length, longest) / length) * to_hip)) return false;
    under_ = comes_beside && here_.exists && here_.height_m < 0;
    return true;
  }

  /// One slide undoes the other. What is left of a slide that has arrived may point anywhere, but is short.
  static bool swings(const Vec3& before, const Vec3& now) noexcept {
    return -dot(before, now) > kSwingShare * std::max(dot(before, before), dot(now, now));
  }

  /// A step along the surface, and onto it.
  bool slide(const Vec3& to_hip) noexcept {
    Vec3 along = slideOf(to_hip, here_.normal, here_.height_m, input_.parameters.contact.friction);
    // deep in a hollow narrower than that depth, whole steps would swing to and fro ever farther
    proxy_.slide_share = swings(proxy_.last_slide_m, along)
                             ? std::max(kLeastSlideShare, 0.5 * proxy_.slide_share)
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
    p_ += step;  // where the model ends, onto the same plane; the next tick says that it needs another one
    here_.height_m = 0;
    return false;
  }

  /// False where the model ends, next to which the proxy waits for the next one.
  bool moveBy(const Vec3& step) noexcept {
    const double length = norm(step);
    const double modelled_m = scene_.ball_radius_m - radii_.most_m - norm(p_ - scene_.ball_centre_m_in_world);
    cut_off_ = modelled_m < length && !scene_.covers(p_ + step, radii_.most_m);
    p_ += (cut_off_ ? std::max(0.0, modelled_m) / length : 1) * step;
    if (!cut_off_) look();
    return !cut_off_;
  }

  /// True if the surface that held the proxy may have come nearer than the camera can measure.
  bool isTooNear() const noexcept {
    const Sight sight = sightOf(proxy_.position_m_in_world);
    const DepthModelParameters& camera = scene_.depth_model->parameters();
    if (!sight.in_image) return false;
    if (sight.raw == kRawNoMeasurement) return sight.depth_m < (1 + kAlmostTooNear) * camera.near_m;
    return camera.a_per_m * sight.raw + camera.b_per_m > 1 / camera.near_m;
  }

  /// The contact stays where it was.
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
  bool held_;  // by a surface, at the last step
  Vec3 side_;  // where the surface next to the proxy faces
  Patch here_;
  PatchSizes sizes_{};
  bool presses_ = false;  // the HIP is below the surface
  bool in_contact_ = false;
  bool entrenched_ = false;
  bool under_ = false;
  bool too_near_ = false;
  bool cut_off_ = false;  // the model ended on the way
  int looks_ = 0;
  std::uint32_t points_looked_at_ = 0;
};

}  // namespace

ForceSample proxyForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT {
  return ProxyTick(input, proxy).force();
}

}  // namespace hapticd::rt
