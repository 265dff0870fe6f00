#include "rt/proxy.h"

#include <algorithm>
#include <cmath>

#include "rt/search_kernel.h"

namespace hapticd::rt {
namespace {

/// Shorter ways are not gone.
constexpr double kNoWay_m = 1e-6;
/// Longest step along the surface, in r1: the ball still overlaps where it was.
constexpr double kSlideShare = 0.5;
/// Points that one look takes the mean of: a wall 0.4 m away has 1,800 within r3.
constexpr std::uint32_t kMostPoints = 4096;
/// After that many points the proxy goes on at the next tick, whatever way is left.
constexpr std::uint32_t kMostPointsPerTick = 20'000;
/// Out of what a step along the surface ran into.
constexpr int kMaxPushes = 2;
/// A mean that is nearer than that gives no direction.
constexpr double kNoDirection_m = 1e-4;

/// Rounded, so that the order in which points were summed up does not decide which way the proxy takes.
Vec3 toNanometres(const Vec3& v_m) noexcept {
  const auto rounded = [](double m) { return std::nearbyint(m * 1e9) * 1e-9; };
  return {rounded(v_m.x), rounded(v_m.y), rounded(v_m.z)};
}

/// What the points within r3 of a place say.
struct Surroundings {
  std::uint32_t points = 0;
  double nearest_m = 0;  ///< r3 when there are none
  Vec3 normal;           ///< unit vector from the points' mean to the place; zero when there is no direction
  double height_m = 0;   ///< of the place above the points' mean, along the normal
};

class ProxyTick {
 public:
  ProxyTick(const LawInput& input, SearchMemory& memory, ProxyMemory& proxy) noexcept
      : input_(input),
        scene_(input.scene),
        memory_(memory),
        proxy_(proxy),
        radii_(ProxyRadii::of(input.parameters.contact)),
        hip_(input.hip_m_in_world),
        p_(proxy.placed ? proxy.position_m_in_world : hip_),
        normal_(proxy.normal_in_world) {}

  ForceSample force() noexcept {
    ForceSample result;
    if (!scene_.covers(p_, radii_.search_m)) {
      proxy_.placed = proxy_.placed && !isZero(normal_);
      result.outside_model = true;
      result.proxy_m_in_world = p_;
      return result;
    }
    comeBackIntoSight();
    follow();
    remember();
    result.proxy_m_in_world = p_;
    result.points_used = here_.points;
    result.outside_model = cut_off_ && !in_contact_;
    if (!in_contact_) return result;
    result.state = entrenched_ ? ContactState::entrenched : ContactState::contact;
    result.normal_in_world = normal_;
    result.force_n_in_world = contactForce(input_, p_, normal_, here_.height_m);
    return result;
  }

 private:
  static bool isZero(const Vec3& v) noexcept { return v == Vec3{}; }

  Vec3 towardsCamera(const Vec3& p) const noexcept {
    const Vec3 way = scene_.depth_model->cameraPosition_m_in_world() - p;
    const double length = norm(way);
    return length > 0 ? (1 / length) * way : Vec3{};
  }

  /// How far behind what the camera sees on its ray a place is, metres along the ray; negative in front, and
  /// where nothing is seen.
  double behindSurface_m(const Vec3& p) const noexcept {
    constexpr double kInFront_m = -1;
    const DepthModel& model = *scene_.depth_model;
    const DepthModelParameters& camera = model.parameters();
    const Vec3 local = model.positionInCamera(p);
    const double depth = -local.z;
    if (depth < camera.near_m) return kInFront_m;
    const double u = camera.fx_px * local.x / depth + camera.cx_px;
    const double v = camera.cy_px - camera.fy_px * local.y / depth;
    const PixelWindow& window = scene_.image_window;
    const bool inside = u > window.column_first - 0.5 && u < window.column_last + 0.5 &&
                        v > window.row_first - 0.5 && v < window.row_last + 0.5;
    if (!inside) return kInFront_m;
    const auto column = static_cast<std::size_t>(std::lround(u));
    const auto row = static_cast<std::size_t>(std::lround(v));
    const std::uint16_t raw =
        std::min<std::uint16_t>(scene_.image[row * kFrameWidth + column], kRawNoMeasurement);
    const double seen = model.depth_m(raw);
    return seen > 0 ? (depth - seen) * norm(local) / depth : kInFront_m;
  }

  /// A new frame may show the surface in front of a proxy that was in sight.
  void comeBackIntoSight() noexcept {
    if (!proxy_.placed || proxy_.frame == scene_.frame || proxy_.behind) return;
    const double behind = behindSurface_m(p_);
    if (behind <= 0 || behind > radii_.swept_m) return;
    const Vec3 back = p_ + (behind + radii_.touch_m) * towardsCamera(p_);
    if (!scene_.covers(back, radii_.search_m)) return;
    p_ = back;
    entrenched_ = true;
  }

  void look() noexcept {
    ++looks_;
    Candidates found = memory_.candidates();
    const Vec3 local = p_ - scene_.origin_m_in_world;
    findInBall(scene_,
               {static_cast<float>(local.x), static_cast<float>(local.y), static_cast<float>(local.z),
                static_cast<float>(radii_.search_m + scene_.depth_model->singlePrecisionError_m())},
               found);
    points_looked_at_ += found.count;
    thinOut(found, kMostPoints);
    const WeightedSum sum =
        sumOfOffsets(*scene_.depth_model, found.pixel, found.count, p_, radii_.search_m, memory_.work());
    here_ = {.points = sum.weight > 0 ? found.count : 0, .nearest_m = radii_.search_m, .normal = {}};
    if (here_.points == 0) return;
    here_.nearest_m = sum.nearest_m;
    const Vec3 from_mean = toNanometres((1 / sum.weight) * sum.sum);
    here_.height_m = norm(from_mean);
    if (here_.height_m > kNoDirection_m) here_.normal = (1 / here_.height_m) * from_mean;
    orient();
  }

  bool mayLook() const noexcept { return looks_ < kMaxProxyMoves && points_looked_at_ < kMostPointsPerTick; }

  /// An entrenched proxy is pushed to the side that it came from.
  void orient() noexcept {
    const bool entrenched = here_.nearest_m < radii_.touch_m;
    if (!entrenched && !isZero(here_.normal)) return;
    const Vec3 side = isZero(normal_) ? towardsCamera(p_) : normal_;
    if (isZero(here_.normal)) {
      here_.normal = side;
      here_.height_m = 0;
    } else if (dot(here_.normal, side) < 0) {
      here_.normal = -here_.normal;
      here_.height_m = -here_.height_m;
    }
  }

  void follow() noexcept {
    look();
    entrenched_ = entrenched_ || (proxy_.placed && isEntrenched());
    while (mayLook()) {
      if (!moveOn()) break;
    }
    const bool rests = here_.points > 0 && here_.nearest_m <= radii_.rest_m;
    in_contact_ = rests && dot(hip_ - p_, here_.normal) < 0;
    normal_ = in_contact_ ? here_.normal : Vec3{};
  }

  /// One step towards the HIP, or out of the points; false when there is none to take.
  bool moveOn() noexcept {
    if (isEntrenched()) return pushOut();
    const Vec3 way = hip_ - p_;
    const bool slides = here_.points > 0 && here_.nearest_m <= radii_.rest_m && dot(way, here_.normal) < 0;
    return slides ? slide(way) : fly(way);
  }

  bool isEntrenched() const noexcept { return here_.points > 0 && here_.nearest_m < radii_.touch_m; }

  /// A safe step through free space.
  bool fly(const Vec3& way) noexcept {
    const double length = norm(way);
    if (length < kNoWay_m) return false;
    const double longest = std::min(here_.nearest_m - radii_.touch_m, radii_.search_m - travelled_m_);
    if (longest < kNoWay_m) return false;
    const double step = std::min(length, longest);
    travelled_m_ += step;
    return moveTo(p_ + (step / length) * way);
  }

  /// A step along the tangent plane, which must bring the proxy nearer to the HIP; else it is taken back.
  bool slide(const Vec3& way) noexcept {
    normal_ = here_.normal;
    Vec3 step = slideOf(way, here_.normal, here_.height_m, input_.parameters.contact.friction);
    const double length = norm(step);
    if (length < kNoWay_m) return false;
    const double longest = kSlideShare * radii_.touch_m;
    if (length > longest) step = (longest / length) * step;
    const Vec3 from = p_;
    const Surroundings from_here = here_;
    const double before = dot(way, way);
    if (!moveTo(p_ + step)) return false;
    for (int push = 0; push < kMaxPushes && isEntrenched() && mayLook(); ++push) {
      if (!pushOut()) break;
    }
    const Vec3 left = hip_ - p_;
    if (!isEntrenched() && dot(left, left) < before) return true;
    p_ = from;
    here_ = from_here;
    return false;
  }

  bool pushOut() noexcept {
    const double into_rest_m = 0.25 * (radii_.rest_m - radii_.touch_m);
    const double way_m =
        here_.height_m < 0 ? radii_.touch_m - here_.height_m : radii_.touch_m - here_.nearest_m;
    return moveTo(p_ + (way_m + into_rest_m) * here_.normal);
  }

  bool moveTo(const Vec3& p) noexcept {
    if (!scene_.covers(p, radii_.search_m)) {
      cut_off_ = true;
      return false;
    }
    p_ = p;
    look();
    return true;
  }

  void remember() noexcept {
    proxy_.placed = true;
    proxy_.position_m_in_world = p_;
    proxy_.normal_in_world = normal_;
    proxy_.frame = scene_.frame;
    proxy_.behind = behindSurface_m(p_) > 0;
  }

  const LawInput& input_;
  const Scene& scene_;
  SearchMemory& memory_;
  ProxyMemory& proxy_;
  const ProxyRadii radii_;
  const Vec3 hip_;
  Vec3 p_;
  Vec3 normal_;
  Surroundings here_;
  bool in_contact_ = false;
  bool entrenched_ = false;
  bool cut_off_ = false;  // the model ended on the way
  int looks_ = 0;
  std::uint32_t points_looked_at_ = 0;
  double travelled_m_ = 0;  // through free space; no farther than what is modelled around the proxy
};

}  // namespace

ForceSample proxyForce(const LawInput& input, SearchMemory& memory, ProxyMemory& proxy) HAPTICD_RT {
  return ProxyTick(input, memory, proxy).force();
}

}  // namespace hapticd::rt
