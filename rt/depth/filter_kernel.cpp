// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/depth/filter_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include "hwy/highway.h"
#include "rt/depth/filter_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using IntTag = hn::RebindToSigned<FloatTag>;
using RawTag = hn::Rebind<std::uint16_t, FloatTag>;

void fromRaw(const std::uint16_t* raw, int count, std::uint16_t first, std::uint16_t last, float* disparity) {
  const FloatTag df;
  const IntTag di;
  const RawTag dr;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const auto low = hn::Set(df, static_cast<float>(first));
  const auto high = hn::Set(df, static_cast<float>(last));
  for (int i = 0; i < count; i += lanes) {
    const auto value = hn::ConvertTo(df, hn::PromoteTo(di, hn::LoadU(dr, raw + i)));
    const auto seen = hn::And(hn::Ge(value, low), hn::Le(value, high));
    hn::StoreU(hn::IfThenElse(seen, value, hn::Set(df, kNoDisparity)), df, disparity + i);
  }
}

void toRaw(const float* disparity, int count, std::uint16_t none, std::uint16_t* raw) {
  const FloatTag df;
  const IntTag di;
  const RawTag dr;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  for (int i = 0; i < count; i += lanes) {
    const auto value = hn::LoadU(df, disparity + i);
    const auto seen = hn::Ge(value, hn::Zero(df));
    const auto nearest = hn::ConvertTo(di, hn::Add(value, hn::Set(df, 0.5F)));
    const auto kept = hn::IfThenElse(hn::RebindMask(di, seen), nearest, hn::Set(di, none));
    hn::StoreU(hn::DemoteTo(dr, kept), dr, raw + i);
  }
}

void toDisparity(const std::uint16_t* raw, int count, const RawConversion& conversion,
                 std::uint16_t* disparity) {
  const FloatTag df;
  const IntTag di;
  const RawTag dr;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const auto first = hn::Set(dr, conversion.raw_first);
  const auto range = hn::Set(dr, static_cast<std::uint16_t>(conversion.raw_last - conversion.raw_first));
  const auto none = hn::Set(dr, conversion.none);
  const auto one = hn::Set(dr, std::uint16_t{1});
  const auto per_raw = hn::Set(df, conversion.per_raw);
  const auto per_inverse = hn::Set(df, conversion.per_inverse);
  const auto offset = hn::Set(df, conversion.offset + 0.5F);
  for (int i = 0; i < count; i += lanes) {
    const auto value = hn::LoadU(dr, raw + i);
    const auto unseen = hn::Gt(hn::Sub(value, first), range);  // or below the first
    const auto number = hn::ConvertTo(df, hn::PromoteTo(di, hn::Max(value, one)));
    const auto real = hn::MulAdd(number, per_raw, hn::Add(hn::Div(per_inverse, number), offset));
    const auto rounded = hn::DemoteTo(dr, hn::ConvertTo(di, real));
    hn::StoreU(hn::IfThenElse(unseen, none, rounded), dr, disparity + i);
  }
}

HWY_INLINE hn::Vec<FloatTag> gateAt(const Gate& gate, hn::Vec<FloatTag> disparity) {
  const FloatTag df;
  return hn::MulAdd(disparity, hn::Set(df, gate.per_raw), hn::Set(df, gate.at_zero));
}

void temporal(const float* disparity, int count, const TemporalLimits& limits, const TemporalRow& row,
              Innovation& innovation) {
  const FloatTag df;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const auto zero = hn::Zero(df);
  const auto one = hn::Set(df, 1.0F);
  auto sum = zero;
  auto pixels = zero;
  auto gates = zero;
  for (int i = 0; i < count; i += lanes) {
    const auto measured = hn::LoadU(df, disparity + i);
    const auto mean = hn::LoadU(df, row.mean + i);
    const auto seen = hn::Ge(measured, zero);
    const auto known = hn::Ge(mean, zero);
    const auto difference = hn::Sub(measured, mean);
    const auto gate = gateAt(limits.gate, mean);
    const auto same = hn::And(hn::And(seen, known), hn::Le(hn::Abs(difference), gate));
    const auto more = hn::Min(hn::Add(hn::LoadU(df, row.frames + i), one), hn::Set(df, limits.max_frames));
    const auto frames = hn::IfThenElse(same, more, one);
    const auto missing = hn::IfThenZeroElse(seen, hn::Add(hn::LoadU(df, row.missing + i), one));
    const auto kept =
        hn::IfThenElse(hn::Le(missing, hn::Set(df, limits.hold_frames)), mean, hn::Set(df, kNoDisparity));
    const auto restarted = hn::IfThenElse(seen, measured, kept);
    hn::StoreU(hn::IfThenElse(same, hn::Add(mean, hn::Div(difference, frames)), restarted), df, row.mean + i);
    hn::StoreU(hn::IfThenElse(seen, frames, hn::LoadU(df, row.frames + i)), df, row.frames + i);
    hn::StoreU(missing, df, row.missing + i);
    sum = hn::Add(sum, hn::IfThenElseZero(same, difference));
    pixels = hn::Add(pixels, hn::IfThenElseZero(same, one));
    gates = hn::Add(gates, hn::IfThenElseZero(same, gate));
  }
  innovation.sum_raw += hn::GetLane(hn::SumOfLanes(df, sum));
  innovation.pixels += hn::GetLane(hn::SumOfLanes(df, pixels));
  innovation.sum_of_gates += hn::GetLane(hn::SumOfLanes(df, gates));
}

void similar(const float* centre, int stride, int count, int radius, const Gate& limit, float* out) {
  const FloatTag df;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  for (int i = 0; i < count; i += lanes) {
    const auto own = hn::LoadU(df, centre + i);
    const auto gate = gateAt(limit, own);
    auto sum = hn::Zero(df);
    auto weight = hn::Zero(df);
    for (int dv = -radius; dv <= radius; ++dv) {
      for (int du = -radius; du <= radius; ++du) {
        const auto other = hn::LoadU(df, centre + i + dv * stride + du);
        const auto difference = hn::Sub(other, own);
        const auto same = hn::And(hn::Le(hn::Abs(difference), gate), hn::Ge(other, hn::Zero(df)));
        sum = hn::Add(sum, hn::IfThenElseZero(same, difference));
        weight = hn::Add(weight, hn::IfThenElseZero(same, hn::Set(df, 1.0F)));
      }
    }
    const auto seen = hn::Ge(own, hn::Zero(df));
    const auto mean = hn::Add(own, hn::Div(sum, hn::Max(weight, hn::Set(df, 1.0F))));
    hn::StoreU(hn::IfThenElse(seen, mean, own), df, out + i);
  }
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(fromRaw);
HWY_EXPORT(toRaw);
HWY_EXPORT(toDisparity);
HWY_EXPORT(temporal);
HWY_EXPORT(similar);

void disparityOfRaw(const std::uint16_t* raw, int count, std::uint16_t first, std::uint16_t last,
                    float* disparity) noexcept {
  HWY_DYNAMIC_DISPATCH(fromRaw)(raw, count, first, last, disparity);
}

void rawOfDisparity(const float* disparity, int count, std::uint16_t none, std::uint16_t* raw) noexcept {
  HWY_DYNAMIC_DISPATCH(toRaw)(disparity, count, none, raw);
}

void convertRaw(const std::uint16_t* raw, int count, const RawConversion& conversion,
                std::uint16_t* disparity) noexcept {
  HWY_DYNAMIC_DISPATCH(toDisparity)(raw, count, conversion, disparity);
}

void updateMeans(const float* disparity, int count, const TemporalLimits& limits, const TemporalRow& row,
                 Innovation& innovation) noexcept {
  HWY_DYNAMIC_DISPATCH(temporal)(disparity, count, limits, row, innovation);
}

void meanOfSimilar(const float* centre, int stride, int count, int radius, const Gate& gate,
                   float* out) noexcept {
  HWY_DYNAMIC_DISPATCH(similar)(centre, stride, count, radius, gate, out);
}

}  // namespace hapticd::rt
#endif
