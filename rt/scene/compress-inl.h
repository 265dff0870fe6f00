// SPDX-License-Identifier: Apache-2.0
// Included once per vector target, after the kernels' includes and before their HWY_BEFORE_NAMESPACE.
#if defined(HAPTICD_RT_COMPRESS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef HAPTICD_RT_COMPRESS_INL_H_
#undef HAPTICD_RT_COMPRESS_INL_H_
#else
#define HAPTICD_RT_COMPRESS_INL_H_
#endif

#include "hwy/highway.h"
#include "rt/scene/compress_table.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {

/// Moves the lanes of `v` selected by `mask` to the front; the other lanes are unspecified. 32-bit lanes
/// only. Highway's own function does the same, but g++ 12 compiles it to a copy of its table (8 KiB on AVX2)
/// to the stack at each call.
template <typename D>
HWY_INLINE hwy::HWY_NAMESPACE::Vec<D> compress(D d, hwy::HWY_NAMESPACE::Vec<D> v,
                                               hwy::HWY_NAMESPACE::Mask<D> mask) {
  namespace hn = hwy::HWY_NAMESPACE;
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_SSSE3
  std::uint8_t bits = 0;
  hn::StoreMaskBits(d, mask, &bits);
  return hn::TableLookupLanes(v, hn::SetTableIndices(d, kCompressLanes[bits].data()));
#else
  static_cast<void>(d);
  return hn::Compress(v, mask);
#endif
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
