// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/focus/body_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include "hwy/highway.h"
#include "rt/modelling/focus/body_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using SampleTag = hn::CappedTag<float, FocusSamples::kAlignment>;
using Values = hn::Vec<SampleTag>;

HWY_INLINE Values all(double value) {
  return hn::Set(SampleTag(), static_cast<float>(value));
}
HWY_INLINE double total(Values v) {
  const SampleTag d;
  return static_cast<double>(hn::GetLane(hn::SumOfLanes(d, v)));
}

/// Returns 1 / v to single precision. Two of Newton's steps suffice for the estimate of every processor,
/// which has at least 8 bits, and are faster than a division.
HWY_INLINE Values reciprocal(Values v) {
  const auto two = all(2);
  auto estimate = hn::ApproximateReciprocal(v);
  for (int step = 0; step < 2; ++step) estimate = hn::Mul(estimate, hn::NegMulAdd(v, estimate, two));
  return estimate;
}

/// Returns 1 / sqrt(v), as reciprocal().
HWY_INLINE Values reciprocalRoot(Values v) {
  const auto half_v = hn::Mul(all(0.5), v);
  auto estimate = hn::ApproximateReciprocalSqrt(v);
  for (int step = 0; step < 2; ++step)
    estimate = hn::Mul(estimate, hn::NegMulAdd(half_v, hn::Mul(estimate, estimate), all(1.5)));
  return estimate;
}

/// See FocusBody::crossing(), whose equations these are, and BodyEquations.
BodyEquations equationsOfSamples(const FocusSamples& samples, const FocusBody& body,
                                 const BodyMeasure& measure) {
  const SampleTag d;
  const std::size_t lanes = hn::Lanes(d);
  constexpr int kN = BodyEquations::kParameters;
  constexpr int kProducts = BodyEquations::kProducts;
  const Vec3 r0 = body.ray();
  const Vec3 a_r0 = body.a * r0;
  const Vec3& n = body.normal;
  const Vec3& e = body.tangent;
  const Vec3 f = body.otherTangent();
  const auto per_column = all(1 / measure.focal_x_px), per_row = all(1 / measure.focal_y_px);
  const auto axx = all(body.a.xx), two_axy = all(2 * body.a.xy), ayy = all(body.a.yy);
  const auto a_r0_x = all(a_r0.x), a_r0_y = all(a_r0.y), r0_a_r0 = all(dot(r0, a_r0));
  const auto nx = all(n.x), ny = all(n.y), n_r0 = all(dot(n, r0));
  const auto ex = all(e.x), ey = all(e.y), ez = all(e.z);
  const auto fx = all(f.x), fy = all(f.y), fz = all(f.z);
  const auto ray_x = all(r0.x), ray_y = all(r0.y);
  const auto w0_by_a = all(body.inverse_depth_per_m / measure.a_per_m);
  const auto at_zero = all(measure.b_per_m / measure.a_per_m);
  const auto per_tolerance = all(1 / measure.tolerance_raw);
  const auto one = all(1), two = all(2), half = all(0.5), zero = hn::Zero(d);
  constexpr double kLeastStretch = FocusBody::kLeastStretch;
  const auto least_square = all(FocusBody::kLeastCosine * FocusBody::kLeastCosine);

  Values products[kProducts];
  Values residuals[kN];
  for (auto& sum : products) sum = zero;
  for (auto& sum : residuals) sum = zero;
  auto squares = zero;
  auto explained = zero;
  auto beside = zero;
  auto of_x = zero, of_y = zero, of_xx = zero, of_xy = zero, of_yy = zero;
  const auto tolerance = all(measure.tolerance_raw), beside_raw = all(measure.beside_raw);
  BodyEquations result;
  for (int cell = 0; cell < FocusSamples::kCells; ++cell) {
    auto cell_residual = zero;
    auto cell_weight = zero;
    for (std::size_t i = samples.cell_begin[cell]; i < samples.cell_begin[cell + 1]; i += lanes) {
      const auto x_px = hn::Load(d, samples.column_px + i);
      const auto y_px = hn::Load(d, samples.row_px + i);
      const auto dx = hn::Mul(x_px, per_column);
      const auto dy = hn::Mul(y_px, per_row);
      const auto tilt = hn::MulAdd(nx, dx, hn::Mul(ny, dy));
      const auto linear = hn::MulAdd(a_r0_x, dx, hn::Mul(a_r0_y, dy));
      const auto square =
          hn::MulAdd(dx, hn::MulAdd(axx, dx, hn::Mul(two_axy, dy)), hn::Mul(ayy, hn::Mul(dy, dy)));
      const auto two_a = hn::Add(hn::MulAdd(two, linear, r0_a_r0), square);
      const auto b = hn::Add(hn::Add(n_r0, tilt), hn::Add(linear, square));
      const auto c = hn::MulAdd(half, square, tilt);
      const auto discriminant = hn::NegMulAdd(hn::Mul(two, two_a), c, hn::Mul(b, b));
      const auto meets = hn::Gt(discriminant, least_square);
      const auto known = hn::IfThenElse(meets, discriminant, one);
      const auto per_cosine = reciprocalRoot(known);
      const auto t = hn::Mul(hn::Mul(two, c), reciprocal(hn::MulSub(known, per_cosine, b)));
      const auto in_front = hn::Gt(t, all(kLeastStretch - 1));
      const auto stretch = hn::Max(hn::Add(one, t), all(kLeastStretch));
      const auto shrink = reciprocal(stretch);
      const auto expected = hn::MulSub(w0_by_a, shrink, at_zero);
      const auto residual = hn::Sub(hn::Load(d, samples.disparity_raw + i), expected);
      const auto relative = hn::Mul(residual, per_tolerance);
      const auto near = hn::Max(zero, hn::NegMulAdd(relative, relative, one));
      const auto counted = hn::IfThenElseZero(hn::And(meets, in_front), hn::Load(d, samples.weight + i));
      const auto distance = hn::Abs(residual);
      const auto belongs = hn::IfThenElseZero(hn::Lt(distance, tolerance), counted);
      explained = hn::Add(explained, belongs);
      const auto belongs_x = hn::Mul(belongs, x_px), belongs_y = hn::Mul(belongs, y_px);
      of_x = hn::Add(of_x, belongs_x);
      of_y = hn::Add(of_y, belongs_y);
      of_xx = hn::MulAdd(belongs_x, x_px, of_xx);
      of_xy = hn::MulAdd(belongs_x, y_px, of_xy);
      of_yy = hn::MulAdd(belongs_y, y_px, of_yy);
      beside = hn::Add(beside, hn::IfThenElseZero(hn::Lt(distance, beside_raw), counted));
      const auto weight = hn::Mul(counted, hn::Mul(near, near));
      const auto y_x = hn::MulAdd(t, hn::Add(ray_x, dx), dx);
      const auto y_y = hn::MulAdd(t, hn::Add(ray_y, dy), dy);
      const auto along_1 = hn::MulAdd(ex, y_x, hn::MulAdd(ey, y_y, hn::Mul(ez, t)));
      const auto along_2 = hn::MulAdd(fx, y_x, hn::MulAdd(fy, y_y, hn::Mul(fz, t)));
      // The disparity changes by -w0 / (a stretch^2 cosine) per unit of the quadric's value.
      const auto gain = hn::Neg(hn::Mul(hn::Mul(w0_by_a, per_cosine), hn::Mul(shrink, shrink)));
      Values of[kN];
      of[0] = shrink;
      of[1] = hn::Mul(gain, along_1);
      of[2] = hn::Mul(gain, along_2);
      of[3] = hn::Mul(half, hn::Mul(of[1], along_1));
      of[4] = hn::Mul(of[1], along_2);
      of[5] = hn::Mul(half, hn::Mul(of[2], along_2));
      const auto weighted = hn::Mul(weight, residual);
      cell_residual = hn::Add(cell_residual, weighted);
      cell_weight = hn::Add(cell_weight, weight);
      squares = hn::MulAdd(weighted, residual, squares);
      int product = 0;
      for (int row = 0; row < kN; ++row) {
        const auto left = hn::Mul(weight, of[row]);
        residuals[row] = hn::MulAdd(weighted, of[row], residuals[row]);
        for (int column = row; column < kN; ++column, ++product)
          products[product] = hn::MulAdd(left, of[column], products[product]);
      }
    }
    result.sums.cell_residual[cell] = total(cell_residual);
    result.sums.cell_weight[cell] = total(cell_weight);
    result.sums.weight += result.sums.cell_weight[cell];
  }
  for (int i = 0; i < kProducts; ++i) result.products[i] = total(products[i]);
  for (int i = 0; i < kN; ++i) result.residuals[i] = total(residuals[i]);
  result.sums.square = total(squares);
  result.sums.explained = total(explained);
  result.sums.unexplained = total(beside) - result.sums.explained;
  result.extent = {
      .x = total(of_x), .y = total(of_y), .xx = total(of_xx), .xy = total(of_xy), .yy = total(of_yy)};
  return result;
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(equationsOfSamples);

BodyEquations equationsOf(const FocusSamples& samples, const FocusBody& body,
                          const BodyMeasure& measure) noexcept {
  return HWY_DYNAMIC_DISPATCH(equationsOfSamples)(samples, body, measure);
}

}  // namespace hapticd::rt
#endif
