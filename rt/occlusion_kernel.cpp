#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/occlusion_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include "hwy/highway.h"
#include "rt/occlusion_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using RawTag = hn::CappedTag<std::uint16_t, kOcclusionBlock>;
using Raws = hn::Vec<RawTag>;

HWY_INLINE Raws distance(Raws a, Raws b) {
  return hn::Sub(hn::Max(a, b), hn::Min(a, b));
}

HWY_INLINE Raws seenAt(const OcclusionRow& row, std::size_t at, Raws last, Raws nothing) {
  const auto raw = hn::LoadU(RawTag(), row.raw + at);
  return hn::IfThenElse(hn::Gt(raw, last), nothing, raw);
}

template <bool kHidden>
HWY_INLINE std::size_t takeUnchangedBlocks(const OcclusionRow& row, std::uint8_t* changed) {
  const RawTag dr;
  const std::size_t lanes = hn::Lanes(dr);
  const auto nothing = hn::Set(dr, kNothingSeen);
  const auto last = hn::Set(dr, row.last_raw);
  const auto none_hidden = hn::Set(dr, row.no_hidden);
  const auto most = hn::Set(dr, row.most_raw);
  std::size_t changed_blocks = 0;
  for (std::size_t block = 0; block < row.blocks; ++block) {
    const std::size_t begin = block * kOcclusionBlock;
    auto farthest = hn::Zero(dr);
    for (std::size_t part = 0; part < kOcclusionBlock; part += lanes) {
      const auto seen = seenAt(row, begin + part, last, nothing);
      farthest = hn::Max(farthest, distance(seen, hn::LoadU(dr, row.visible + begin + part)));
      if constexpr (kHidden) {
        const auto hidden = hn::LoadU(dr, row.hidden + begin + part);
        const auto near =
            hn::AndNot(hn::Eq(hidden, none_hidden), hn::Eq(hn::Max(distance(seen, hidden), most), most));
        farthest = hn::IfThenElse(near, nothing, farthest);
      }
    }
    if (!hn::AllTrue(dr, hn::Eq(hn::Max(farthest, most), most))) {
      changed[changed_blocks++] = static_cast<std::uint8_t>(block);
      continue;
    }
    for (std::size_t part = 0; part < kOcclusionBlock; part += lanes) {
      hn::StoreU(seenAt(row, begin + part, last, nothing), dr, row.visible + begin + part);
    }
  }
  return changed_blocks;
}

std::size_t takeUnchangedRow(const OcclusionRow& row, std::uint8_t* changed) {
  return row.hidden == nullptr ? takeUnchangedBlocks<false>(row, changed)
                               : takeUnchangedBlocks<true>(row, changed);
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(takeUnchangedRow);

std::size_t takeUnchanged(const OcclusionRow& row, std::uint8_t* changed) noexcept {
  return HWY_DYNAMIC_DISPATCH(takeUnchangedRow)(row, changed);
}

}  // namespace hapticd::rt
#endif
