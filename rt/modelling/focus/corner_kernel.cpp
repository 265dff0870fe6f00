// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/focus/corner_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include "hwy/highway.h"
#include "rt/modelling/focus/corner_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using CornerTag = hn::CappedTag<float, FocusSamples::kAlignment>;
using CornerValues = hn::Vec<CornerTag>;

HWY_INLINE CornerValues everywhere(double value) {
  return hn::Set(CornerTag(), static_cast<float>(value));
}
HWY_INLINE double sumOf(CornerValues v) {
  return static_cast<double>(hn::GetLane(hn::SumOfLanes(CornerTag(), v)));
}

template <FaceChoice kChoice>
CornerSums sumsBy(const FocusSamples& samples, const FocusCorner& corner, double tolerance_raw,
                  double beside_raw) {
  const CornerTag d;
  const std::size_t lanes = hn::Lanes(d);
  constexpr int kFaces = FocusCorner::kMaxFaces;
  constexpr int kSums = 9;
  const auto zero = hn::Zero(d), one = everywhere(1);
  const auto tolerance = everywhere(tolerance_raw), beside_limit = everywhere(beside_raw);
  const auto per_tolerance = everywhere(1 / tolerance_raw);
  CornerValues at_focus[kFaces], per_column[kFaces], per_row[kFaces];
  for (int i = 0; i < kFaces; ++i) {
    const FocusCorner::Face& face = corner.face[i < corner.faces ? i : 0];
    at_focus[i] = everywhere(face.disparity);
    per_column[i] = everywhere(face.per_column);
    per_row[i] = everywhere(face.per_row);
  }
  CornerValues sums[kFaces][kSums];
  for (auto& of_face : sums) {
    for (auto& sum : of_face) sum = zero;
  }
  auto squares = zero, explained = zero, beside = zero;
  CornerSums result{};
  for (int cell = 0; cell < FocusSamples::kCells; ++cell) {
    auto cell_residual = zero, cell_weight = zero;
    for (std::size_t i = samples.cell_begin[cell]; i < samples.cell_begin[cell + 1]; i += lanes) {
      const auto x = hn::Load(d, samples.column_px + i);
      const auto y = hn::Load(d, samples.row_px + i);
      const auto disparity = hn::Load(d, samples.disparity_raw + i);
      const auto counted = hn::Load(d, samples.weight + i);
      CornerValues of[kFaces];
      for (int k = 0; k < kFaces; ++k)
        of[k] = hn::Sub(disparity, hn::MulAdd(per_column[k], x, hn::MulAdd(per_row[k], y, at_focus[k])));
      const auto isBefore = [](CornerValues a, CornerValues b) {
        if constexpr (kChoice == FaceChoice::greatest) return hn::Lt(a, b);
        if constexpr (kChoice == FaceChoice::least) return hn::Gt(a, b);
        if constexpr (kChoice == FaceChoice::nearest) return hn::Lt(hn::Abs(a), hn::Abs(b));
      };
      const auto is_second = isBefore(of[1], of[0]);
      const auto of_two = hn::IfThenElse(is_second, of[1], of[0]);
      const auto is_third = isBefore(of[2], of_two);
      const auto residual = hn::IfThenElse(is_third, of[2], of_two);
      const auto distance = hn::Abs(residual);
      explained = hn::Add(explained, hn::IfThenElseZero(hn::Lt(distance, tolerance), counted));
      beside = hn::Add(beside, hn::IfThenElseZero(hn::Lt(distance, beside_limit), counted));
      const auto relative = hn::Mul(residual, per_tolerance);
      const auto near = hn::Max(zero, hn::NegMulAdd(relative, relative, one));
      const auto weight = hn::Mul(counted, hn::Mul(near, near));
      const auto weighted = hn::Mul(weight, residual);
      cell_residual = hn::Add(cell_residual, weighted);
      cell_weight = hn::Add(cell_weight, weight);
      squares = hn::MulAdd(weighted, residual, squares);
      const auto of_third = hn::IfThenElseZero(is_third, weight);
      const auto of_first_two = hn::Sub(weight, of_third);
      const auto of_second = hn::IfThenElseZero(is_second, of_first_two);
      const CornerValues of_face[kFaces] = {hn::Sub(of_first_two, of_second), of_second, of_third};
      for (int k = 0; k < kFaces; ++k) {
        const auto w = of_face[k];
        const auto wx = hn::Mul(w, x), wy = hn::Mul(w, y), wr = hn::Mul(w, residual);
        sums[k][0] = hn::Add(sums[k][0], w);
        sums[k][1] = hn::Add(sums[k][1], wx);
        sums[k][2] = hn::Add(sums[k][2], wy);
        sums[k][3] = hn::MulAdd(wx, x, sums[k][3]);
        sums[k][4] = hn::MulAdd(wx, y, sums[k][4]);
        sums[k][5] = hn::MulAdd(wy, y, sums[k][5]);
        sums[k][6] = hn::Add(sums[k][6], wr);
        sums[k][7] = hn::MulAdd(wr, x, sums[k][7]);
        sums[k][8] = hn::MulAdd(wr, y, sums[k][8]);
      }
    }
    result.fit.cell_residual[cell] = sumOf(cell_residual);
    result.fit.cell_weight[cell] = sumOf(cell_weight);
    result.fit.weight += result.fit.cell_weight[cell];
  }
  for (int k = 0; k < corner.faces; ++k) {
    const auto at = [&sums, k](int i) { return sumOf(sums[k][i]); };
    result.face[k] = {.w = at(0),
                      .wx = at(1),
                      .wy = at(2),
                      .wxx = at(3),
                      .wxy = at(4),
                      .wyy = at(5),
                      .wr = at(6),
                      .wrx = at(7),
                      .wry = at(8)};
  }
  result.fit.square = sumOf(squares);
  result.fit.explained = sumOf(explained);
  result.fit.unexplained = sumOf(beside) - result.fit.explained;
  return result;
}

CornerSums cornerSums(const FocusSamples& samples, const FocusCorner& corner, FaceChoice choice,
                      double tolerance_raw, double beside_raw) {
  switch (choice) {
    case FaceChoice::greatest:
      return sumsBy<FaceChoice::greatest>(samples, corner, tolerance_raw, beside_raw);
    case FaceChoice::least:
      return sumsBy<FaceChoice::least>(samples, corner, tolerance_raw, beside_raw);
    case FaceChoice::nearest:
      break;
  }
  return sumsBy<FaceChoice::nearest>(samples, corner, tolerance_raw, beside_raw);
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(cornerSums);

CornerSums cornerSumsOf(const FocusSamples& samples, const FocusCorner& corner, FaceChoice choice,
                        double tolerance_raw, double beside_raw) noexcept {
  return HWY_DYNAMIC_DISPATCH(cornerSums)(samples, corner, choice, tolerance_raw, beside_raw);
}

}  // namespace hapticd::rt
#endif
