// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/surface/column_shift_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/surface/column_shift_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include "hwy/highway.h"
#include "rt/depth/depth_frame.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void compareRows(const RowComparison& rows, std::int16_t* sum_raw, std::int16_t* count) {
  const hn::CappedTag<std::uint16_t, kRowAlignment_px> d;
  const hn::RebindToSigned<decltype(d)> ds;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto last = hn::Set(d, rows.last_raw);
  const auto most = hn::Set(ds, rows.max_difference_raw);
  // Column by column, so that the sums stay in registers and all rows are fetched at once.
  for (int column = 0; column < rows.columns; column += lanes) {
    auto sum = hn::Zero(ds);
    auto number = hn::Zero(ds);
    const std::uint16_t* now = rows.now + column;
    std::uint16_t* before = rows.before + column;
    for (int row = 0; row < rows.rows; ++row) {
      const auto value = hn::LoadU(d, now);
      const auto old = hn::LoadU(d, before);
      hn::StoreU(value, d, before);
      const auto difference = hn::BitCast(ds, hn::Sub(value, old));
      const auto measured = hn::Not(hn::Or(hn::Gt(value, last), hn::Gt(old, last)));
      const auto same = hn::Not(hn::Or(hn::Gt(difference, most), hn::Gt(hn::Neg(most), difference)));
      const auto counts = hn::And(hn::RebindMask(ds, measured), same);
      sum = hn::Add(sum, hn::IfThenElseZero(counts, difference));
      number = hn::Add(number, hn::IfThenElseZero(counts, hn::Set(ds, std::int16_t{1})));
      now += rows.now_stride_px;
      before += rows.before_stride_px;
    }
    hn::StoreU(sum, ds, sum_raw + column);
    hn::StoreU(number, ds, count + column);
  }
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(compareRows);

void sumUpDifferences(const RowComparison& rows, std::int16_t* sum_raw, std::int16_t* count) noexcept {
  HWY_DYNAMIC_DISPATCH(compareRows)(rows, sum_raw, count);
}

}  // namespace hapticd::rt
#endif
