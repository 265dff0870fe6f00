// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/scene/plane_fit_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include "hwy/highway.h"
#include "rt/scene/grid_walk-inl.h"
#include "rt/scene/plane_fit_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using PlaneTag = hn::ScalableTag<float>;
using PlaneFloats = hn::Vec<PlaneTag>;

HWY_INLINE PlaneFloats broadcast(double value) {
  return hn::Set(PlaneTag(), static_cast<float>(value));
}

struct Axis {
  HWY_INLINE explicit Axis(const Vec3& v) : x(broadcast(v.x)), y(broadcast(v.y)), z(broadcast(v.z)) {}
  HWY_INLINE PlaneFloats along(PlaneFloats vx, PlaneFloats vy, PlaneFloats vz) const {
    return hn::MulAdd(vz, z, hn::MulAdd(vy, y, hn::Mul(vx, x)));
  }
  PlaneFloats x, y, z;
};

HWY_INLINE double total(PlaneFloats v) {
  const PlaneTag df;
  return static_cast<double>(hn::GetLane(hn::SumOfLanes(df, v)));
}

/// The sums for one radius and band.
class Accumulator {
 public:
  HWY_INLINE Accumulator(double radius_m, double band_m)
      : per_radius_squared_(broadcast(1 / (radius_m * radius_m))),
        per_band_squared_(broadcast(1 / (band_m * band_m))) {}

  HWY_INLINE void add(PlaneFloats x, PlaneFloats y, PlaneFloats h, PlaneFloats s_squared) {
    const PlaneTag df;
    const auto one = hn::Set(df, 1.0F);
    const auto zero = hn::Zero(df);
    const auto h_squared = hn::Mul(h, h);
    const auto near = hn::Max(hn::NegMulAdd(s_squared, per_radius_squared_, one), zero);
    const auto flat = hn::Max(hn::NegMulAdd(h_squared, per_band_squared_, one), zero);
    const auto root = hn::Mul(near, flat);
    const auto weight = hn::Mul(root, root);
    const auto wx = hn::Mul(weight, x);
    const auto wy = hn::Mul(weight, y);
    w_ = hn::Add(w_, weight);
    x_ = hn::Add(x_, wx);
    y_ = hn::Add(y_, wy);
    h_ = hn::MulAdd(weight, h, h_);
    xx_ = hn::MulAdd(wx, x, xx_);
    xy_ = hn::MulAdd(wx, y, xy_);
    yy_ = hn::MulAdd(wy, y, yy_);
    xh_ = hn::MulAdd(wx, h, xh_);
    yh_ = hn::MulAdd(wy, h, yh_);
    hh_ = hn::MulAdd(weight, h_squared, hh_);
  }
  HWY_INLINE PlaneSums sums() const {
    return {total(w_),  total(x_),  total(y_),  total(h_),  total(xx_),
            total(xy_), total(yy_), total(xh_), total(yh_), total(hh_)};
  }

 private:
  PlaneFloats per_radius_squared_, per_band_squared_;
  PlaneFloats w_ = hn::Zero(PlaneTag()), x_ = w_, y_ = w_, h_ = w_, xx_ = w_, xy_ = w_, yy_ = w_, xh_ = w_,
              yh_ = w_, hh_ = w_;
};

/// Calls `visit(vx, vy, vz, s_squared, inside)` for vectors of points relative to the ball's centre; `inside`
/// marks those in the ball.
template <typename Visit>
HWY_INLINE void visitBall(const Scene& scene, const LocalBall& ball, const Visit& visit) {
  const PlaneTag df;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(df));
  const auto centre_x = hn::Set(df, ball.x_m);
  const auto centre_y = hn::Set(df, ball.y_m);
  const auto centre_z = hn::Set(df, ball.z_m);
  const auto limit = hn::Set(df, ball.radius_m * ball.radius_m);
  walkBall(scene, ball, [&](std::uint32_t begin, std::uint32_t end) HWY_ATTR {
    for (std::uint32_t i = begin; i < end; i += lanes) {
      PlaneFloats x, y, z, pixel;
      hn::LoadInterleaved4(df, &scene.point[i].x_m, x, y, z, pixel);
      x = hn::Sub(x, centre_x);
      y = hn::Sub(y, centre_y);
      z = hn::Sub(z, centre_z);
      const auto s_squared = hn::MulAdd(z, z, hn::MulAdd(y, y, hn::Mul(x, x)));
      auto inside = hn::Le(s_squared, limit);
      if (end - i < lanes) inside = hn::And(inside, hn::FirstN(df, end - i));
      if (hn::AllFalse(df, inside)) continue;
      visit(x, y, z, s_squared, inside);
    }
  });
}

void sumPlanes(const Scene& scene, const PlaneQuery& query, PlanePoints& out) {
  const PlaneTag df;
  const Axis along_x(query.along_x);
  const Axis along_y(query.along_y);
  const Axis normal(query.normal);
  const Axis sight(query.line_of_sight);
  Accumulator small(query.small_radius_m, query.small_band_m);
  Accumulator large(query.large_radius_m, query.large_band_m);
  const auto band = broadcast(query.large_band_m);
  const auto beyond = hn::Set(df, query.ball.radius_m * query.ball.radius_m);
  auto nearest = beyond;
  auto beside = beyond;
  std::uint32_t points = 0;
  visitBall(scene, query.ball,
            [&](PlaneFloats vx, PlaneFloats vy, PlaneFloats vz, PlaneFloats s_squared, auto inside) HWY_ATTR {
              points += static_cast<std::uint32_t>(hn::CountTrue(df, inside));
              const auto h = normal.along(vx, vy, vz);
              const auto distance = hn::IfThenElse(inside, s_squared, beyond);
              nearest = hn::Min(nearest, distance);
              const auto depth = sight.along(vx, vy, vz);
              const auto off_sight = hn::Max(hn::NegMulAdd(depth, depth, s_squared), hn::Zero(df));
              const auto in_band = hn::And(inside, hn::Lt(hn::Abs(h), band));
              beside = hn::Min(beside, hn::IfThenElse(in_band, off_sight, beyond));
              const auto x = along_x.along(vx, vy, vz);
              const auto y = along_y.along(vx, vy, vz);
              // a point outside the ball has no weight
              small.add(x, y, h, distance);
              large.add(x, y, h, distance);
            });
  out.small = small.sums();
  out.large = large.sums();
  out.points = points;
  out.nearest_m = std::sqrt(static_cast<double>(hn::GetLane(hn::MinOfLanes(df, nearest))));
  out.nearest_beside_m = std::sqrt(static_cast<double>(hn::GetLane(hn::MinOfLanes(df, beside))));
}

void reach(const Scene& scene, const LocalBall& ball, const Vec3& normal_of_plane, double band_m,
           const Vec3& direction, double& out_m) {
  const PlaneTag df;
  const Axis normal(normal_of_plane);
  const Axis axis(direction);
  const auto band = broadcast(band_m);
  const auto none = hn::Set(df, -ball.radius_m);
  auto farthest = none;
  visitBall(scene, ball,
            [&](PlaneFloats vx, PlaneFloats vy, PlaneFloats vz, PlaneFloats, auto inside) HWY_ATTR {
              const auto in_band = hn::And(inside, hn::Lt(hn::Abs(normal.along(vx, vy, vz)), band));
              farthest = hn::Max(farthest, hn::IfThenElse(in_band, axis.along(vx, vy, vz), none));
            });
  out_m = static_cast<double>(hn::GetLane(hn::MaxOfLanes(df, farthest)));
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(sumPlanes);
HWY_EXPORT(reach);

// As in search_kernel.cpp: clang cannot see through Highway's dispatch table; the kernels are arithmetic on
// memory owned by their caller.
HAPTICD_RT_TRUSTED_BEGIN

PlanePoints sumForPlane(const Scene& scene, const PlaneQuery& query) HAPTICD_RT {
  PlanePoints points;
  HWY_DYNAMIC_DISPATCH(sumPlanes)(scene, query, points);
  return points;
}

double reachOfPoints_m(const Scene& scene, const LocalBall& ball, const Vec3& normal, double band_m,
                       const Vec3& direction) HAPTICD_RT {
  double out_m = 0;
  HWY_DYNAMIC_DISPATCH(reach)(scene, ball, normal, band_m, direction, out_m);
  return out_m;
}

HAPTICD_RT_TRUSTED_END

}  // namespace hapticd::rt
#endif
