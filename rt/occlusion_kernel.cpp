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

std::size_t takeUnchangedBlocks(const OcclusionRow& row, std::uint8_t* changed) {
  const RawTag dr;
  const std::size_t lanes = hn::Lanes(dr);
  const auto nothing = hn::Set(dr, kNothingSeen);
  const auto last = hn::Set(dr, row.last_raw);
  const auto none_hidden = hn::Set(dr, row.no_hidden);
  const auto noise = hn::Set(dr, row.noise_raw);
  std::size_t changed_blocks = 0;
  for (std::size_t block = 0; block < row.blocks; ++block) {
    const std::size_t begin = block * kOcclusionBlock;
    bool unchanged = true;
    for (std::size_t part = 0; part < kOcclusionBlock; part += lanes) {
      const auto raw = hn::LoadU(dr, row.raw + begin + part);
      const auto seen = hn::IfThenElse(hn::Gt(raw, last), nothing, raw);
      const auto hidden = hn::LoadU(dr, row.hidden + begin + part);
      const auto still =
          hn::Eq(hn::Max(distance(seen, hn::LoadU(dr, row.visible + begin + part)), noise), noise);
      const auto apart = hn::Or(hn::Eq(hidden, none_hidden), hn::Gt(distance(seen, hidden), noise));
      unchanged = unchanged && hn::AllTrue(dr, hn::And(still, apart));
    }
    if (!unchanged) {
      changed[changed_blocks++] = static_cast<std::uint8_t>(block);
      continue;
    }
    for (std::size_t part = 0; part < kOcclusionBlock; part += lanes) {
      const auto raw = hn::LoadU(dr, row.raw + begin + part);
      const auto missing = hn::Gt(raw, last);
      hn::StoreU(hn::IfThenElse(missing, nothing, raw), dr, row.visible + begin + part);
    }
  }
  return changed_blocks;
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(takeUnchangedBlocks);

std::size_t takeUnchanged(const OcclusionRow& row, std::uint8_t* changed) noexcept {
  return HWY_DYNAMIC_DISPATCH(takeUnchangedBlocks)(row, changed);
}

}  // namespace hapticd::rt
#endif
