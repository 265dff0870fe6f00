// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/scene/search_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include "hwy/highway.h"
#include "rt/scene/compress-inl.h"
#include "rt/scene/grid_walk-inl.h"
#include "rt/scene/search_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using UintTag = hn::RebindToUnsigned<FloatTag>;

/// Appends those of the points [begin, end) that lie in the ball.
HWY_INLINE void appendPoints(const Scene& scene, const LocalBall& ball, std::uint32_t begin,
                             std::uint32_t end, Candidates& candidates) {
  const FloatTag df;
  const UintTag du;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(df));
  const auto centre_x = hn::Set(df, ball.x_m);
  const auto centre_y = hn::Set(df, ball.y_m);
  const auto centre_z = hn::Set(df, ball.z_m);
  const auto limit = hn::Set(df, ball.radius_m * ball.radius_m);
  for (std::uint32_t i = begin; i < end; i += lanes) {
    hn::Vec<FloatTag> x, y, z, pixel;
    hn::LoadInterleaved4(df, &scene.point[i].x_m, x, y, z, pixel);
    x = hn::Sub(x, centre_x);
    y = hn::Sub(y, centre_y);
    z = hn::Sub(z, centre_z);
    const auto distance_squared = hn::MulAdd(z, z, hn::MulAdd(y, y, hn::Mul(x, x)));
    auto inside = hn::Le(distance_squared, limit);
    if (end - i < lanes) inside = hn::And(inside, hn::FirstN(df, end - i));
    const auto found = static_cast<std::uint32_t>(hn::CountTrue(df, inside));
    if (found == 0) continue;
    hn::StoreU(compress(df, distance_squared, inside), df, candidates.distance_squared_m2 + candidates.count);
    hn::StoreU(compress(du, hn::BitCast(du, pixel), hn::RebindMask(du, inside)), du,
               candidates.pixel + candidates.count);
    candidates.count += found;
  }
}

void findInBallOfGrid(const Scene& scene, const LocalBall& ball, Candidates& candidates) {
  candidates.count = 0;
  walkBall(scene, ball, [&](std::uint32_t begin, std::uint32_t end) HWY_ATTR {
    appendPoints(scene, ball, begin, end, candidates);
  });
}

std::uint32_t countCandidatesWithin(const Candidates& candidates, float limit_m2) {
  const FloatTag df;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(df));
  const auto limit = hn::Set(df, limit_m2);
  std::uint32_t within = 0;
  for (std::uint32_t i = 0; i < candidates.count; i += lanes) {
    auto inside = hn::Le(hn::LoadU(df, candidates.distance_squared_m2 + i), limit);
    if (candidates.count - i < lanes) inside = hn::And(inside, hn::FirstN(df, candidates.count - i));
    within += static_cast<std::uint32_t>(hn::CountTrue(df, inside));
  }
  return within;
}

std::uint32_t takeCandidatesBetween(Candidates& candidates, float near_m2, float far_m2,
                                    std::uint32_t* between) {
  const FloatTag df;
  const UintTag du;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(df));
  const auto near_limit = hn::Set(df, near_m2);
  const auto far_limit = hn::Set(df, far_m2);
  std::uint32_t near = 0;
  std::uint32_t taken = 0;
  for (std::uint32_t i = 0; i < candidates.count; i += lanes) {
    const auto distance = hn::LoadU(df, candidates.distance_squared_m2 + i);
    const auto pixel = hn::LoadU(du, candidates.pixel + i);
    auto within = hn::Le(distance, far_limit);
    if (candidates.count - i < lanes) within = hn::And(within, hn::FirstN(df, candidates.count - i));
    const auto is_near = hn::And(within, hn::Le(distance, near_limit));
    const auto is_between = hn::AndNot(is_near, within);
    // In place: everything overwritten beyond `near` has been loaded already.
    hn::StoreU(compress(du, pixel, hn::RebindMask(du, is_near)), du, candidates.pixel + near);
    near += static_cast<std::uint32_t>(hn::CountTrue(df, is_near));
    if (hn::AllFalse(df, is_between)) continue;
    hn::StoreU(compress(du, pixel, hn::RebindMask(du, is_between)), du, between + taken);
    taken += static_cast<std::uint32_t>(hn::CountTrue(df, is_between));
  }
  candidates.count = near;
  return taken;
}

/// Computes V of eq. (9) for each pixel.
HWY_INLINE void vectorsToHip(const Scene& scene, const std::uint32_t* pixels, std::uint32_t count,
                             const Vec3& hip_m_in_world, WorkVector* work) {
  const hn::CappedTag<double, 4> d4;  // one point; two vectors on machines with short registers
  constexpr std::size_t kCoordinates = 4;
  const std::size_t lanes = hn::Lanes(d4);
  const DepthModel& model = *scene.depth_model;
  const Vec3 from_camera = hip_m_in_world - model.cameraPosition_m_in_world();
  const double offset[kCoordinates] = {from_camera.x, from_camera.y, from_camera.z, 0};
  const DepthModel::Ray* const columns = model.columnRays();
  const DepthModel::Ray* const rows = model.rowRays();
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t pixel = pixels[i];
    const auto raw = static_cast<std::uint16_t>(PackedPixel::raw(pixel, scene.raw_first));
    const auto depth = hn::Set(d4, model.depth_m(raw));
    const double* const column = &columns[PackedPixel::column(pixel)].x;
    const double* const row = &rows[PackedPixel::row(pixel)].x;
    for (std::size_t part = 0; part < kCoordinates; part += lanes) {
      const auto ray = hn::Add(hn::LoadU(d4, column + part), hn::LoadU(d4, row + part));
      hn::StoreU(hn::NegMulAdd(depth, ray, hn::LoadU(d4, offset + part)), d4, &work[i].x + part);
    }
  }
}

Vec3 sumOfSprings(const Scene& scene, const std::uint32_t* pixels, std::uint32_t count,
                  const Vec3& hip_m_in_world, double radius_m, WorkVector* work) {
  const hn::ScalableTag<double> dd;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(dd));
  vectorsToHip(scene, pixels, count, hip_m_in_world, work);
  for (std::uint32_t i = count; i % lanes != 0; ++i) work[i] = {};  // coincident points add nothing
  const auto radius = hn::Set(dd, radius_m);
  const auto coincident = hn::Set(dd, kCoincident_m);
  auto sum_x = hn::Zero(dd);
  auto sum_y = hn::Zero(dd);
  auto sum_z = hn::Zero(dd);
  for (std::uint32_t i = 0; i < count; i += lanes) {
    hn::Vec<hn::ScalableTag<double>> x, y, z, unused;
    hn::LoadInterleaved4(dd, &work[i].x, x, y, z, unused);
    const auto s = hn::Sqrt(hn::MulAdd(z, z, hn::MulAdd(y, y, hn::Mul(x, x))));
    const auto factor =
        hn::IfThenElseZero(hn::Ge(s, coincident), hn::Sub(hn::Div(radius, s), hn::Set(dd, 1.0)));
    sum_x = hn::MulAdd(factor, x, sum_x);
    sum_y = hn::MulAdd(factor, y, sum_y);
    sum_z = hn::MulAdd(factor, z, sum_z);
  }
  return {hn::GetLane(hn::SumOfLanes(dd, sum_x)), hn::GetLane(hn::SumOfLanes(dd, sum_y)),
          hn::GetLane(hn::SumOfLanes(dd, sum_z))};
}

using DoubleTag = hn::ScalableTag<double>;
using Doubles = hn::Vec<DoubleTag>;

/// Weight of a point at a given distance, and the factor of its V in the sum.
struct Terms {
  Doubles weight;
  Doubles factor;
};

/// Sums `terms(s)` over the points with s up to the radius.
template <typename TermsOf>
HWY_INLINE WeightedSum sumOfTerms(const Scene& scene, const std::uint32_t* pixels, std::uint32_t count,
                                  const Vec3& centre_m_in_world, double radius_m, WorkVector* work,
                                  const TermsOf& terms) {
  const DoubleTag dd;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(dd));
  vectorsToHip(scene, pixels, count, centre_m_in_world, work);
  // padding of the last vector, out of reach
  for (std::uint32_t i = count; i % lanes != 0; ++i) work[i] = {2 * radius_m, 0, 0, 0};
  const auto radius = hn::Set(dd, radius_m);
  auto sum_x = hn::Zero(dd);
  auto sum_y = hn::Zero(dd);
  auto sum_z = hn::Zero(dd);
  auto weight = hn::Zero(dd);
  auto nearest = radius;
  for (std::uint32_t i = 0; i < count; i += lanes) {
    Doubles x, y, z, unused;
    hn::LoadInterleaved4(dd, &work[i].x, x, y, z, unused);
    const auto s = hn::Sqrt(hn::MulAdd(z, z, hn::MulAdd(y, y, hn::Mul(x, x))));
    const auto near = hn::Le(s, radius);
    const Terms point = terms(s);
    const auto factor = hn::IfThenElseZero(near, point.factor);
    sum_x = hn::MulAdd(factor, x, sum_x);
    sum_y = hn::MulAdd(factor, y, sum_y);
    sum_z = hn::MulAdd(factor, z, sum_z);
    weight = hn::Add(weight, hn::IfThenElseZero(near, point.weight));
    nearest = hn::Min(nearest, s);
  }
  return {{hn::GetLane(hn::SumOfLanes(dd, sum_x)), hn::GetLane(hn::SumOfLanes(dd, sum_y)),
           hn::GetLane(hn::SumOfLanes(dd, sum_z))},
          hn::GetLane(hn::SumOfLanes(dd, weight)),
          hn::GetLane(hn::MinOfLanes(dd, nearest))};
}

WeightedSum sumOfSmoothTerms(const Scene& scene, const std::uint32_t* pixels, std::uint32_t count,
                             const Vec3& hip_m_in_world, double radius_m, double fade_m, WorkVector* work) {
  const DoubleTag dd;
  const auto per_radius = hn::Set(dd, 1 / radius_m);
  return sumOfTerms(scene, pixels, count, hip_m_in_world, radius_m, work, [&](Doubles s) HWY_ATTR {
    const auto weight = hn::NegMulAdd(s, per_radius, hn::Set(dd, 1.0));
    const auto spring = hn::Sub(hn::Set(dd, radius_m), s);
    return Terms{weight, hn::Div(hn::Mul(weight, spring), hn::Max(s, hn::Set(dd, fade_m)))};
  });
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(findInBallOfGrid);
HWY_EXPORT(countCandidatesWithin);
HWY_EXPORT(takeCandidatesBetween);
HWY_EXPORT(sumOfSprings);
HWY_EXPORT(sumOfSmoothTerms);

// clang cannot see through Highway's dispatch table, and the table does not accept pointers to functions with
// the attribute. The kernels are arithmetic on memory owned by their caller.
HAPTICD_RT_TRUSTED_BEGIN

void findInBall(const Scene& scene, const LocalBall& ball, Candidates& candidates) HAPTICD_RT {
  HWY_DYNAMIC_DISPATCH(findInBallOfGrid)(scene, ball, candidates);
}

std::uint32_t countWithin(const Candidates& candidates, float limit_m2) HAPTICD_RT {
  return HWY_DYNAMIC_DISPATCH(countCandidatesWithin)(candidates, limit_m2);
}

std::uint32_t takeBetween(Candidates& candidates, float near_m2, float far_m2,
                          std::uint32_t* between) HAPTICD_RT {
  return HWY_DYNAMIC_DISPATCH(takeCandidatesBetween)(candidates, near_m2, far_m2, between);
}

Vec3 sumOfUnitSprings(const Scene& scene, const std::uint32_t* pixels, std::uint32_t count,
                      const Vec3& hip_m_in_world, double radius_m, WorkVector* work) HAPTICD_RT {
  return HWY_DYNAMIC_DISPATCH(sumOfSprings)(scene, pixels, count, hip_m_in_world, radius_m, work);
}

WeightedSum sumOfSmoothSprings(const Scene& scene, const std::uint32_t* pixels, std::uint32_t count,
                               const Vec3& hip_m_in_world, double radius_m, double fade_m,
                               WorkVector* work) HAPTICD_RT {
  return HWY_DYNAMIC_DISPATCH(sumOfSmoothTerms)(scene, pixels, count, hip_m_in_world, radius_m, fade_m, work);
}

HAPTICD_RT_TRUSTED_END

}  // namespace hapticd::rt
#endif
