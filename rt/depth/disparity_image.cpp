// SPDX-License-Identifier: Apache-2.0
#include "rt/depth/disparity_image.h"

#include <algorithm>

#include "rt/depth/filter_kernel.h"

namespace hapticd::rt {

DisparityImage::DisparityImage(const DepthModel& model)
    : model_(model),
      size_(model.rawIsDisparity() ? 0 : model.pixels() + kVectorPadding),
      disparity_(std::make_unique<std::uint16_t[]>(size_)) {
  std::fill_n(disparity_.get(), size_, kNoRawDisparity);
}

DisparityFrame DisparityImage::of(const DepthFrame& frame) const noexcept {
  return {model_.rawIsDisparity() ? frame.raw : disparity_.get(), frame};
}

void DisparityImage::convert(const DepthFrame& frame, const PixelWindow& window) noexcept {
  if (model_.rawIsDisparity() || window.empty()) return;
  const DisparityScale& scale = model_.disparity();
  RawConversion conversion{
      .raw_first = model_.firstRaw(), .raw_last = model_.lastRaw(), .none = kNoRawDisparity};
  if (model_.isLinear()) {
    conversion.per_raw = 0;
    conversion.per_inverse = static_cast<float>(1 / (scale.a_per_m * model_.parameters().unit_m));
    conversion.offset = static_cast<float>(-scale.b_per_m / scale.a_per_m);
  } else {
    conversion.per_raw = static_cast<float>(model_.parameters().a_per_m / scale.a_per_m);
    conversion.per_inverse = 0;
    conversion.offset = static_cast<float>((model_.parameters().b_per_m - scale.b_per_m) / scale.a_per_m);
  }
  const int first = window.column_first / kRowAlignment_px * kRowAlignment_px;
  const int end = std::min(model_.stride_px(), strideOf(window.column_last + 1));
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(row) * model_.stride_px() + first;
    convertRaw(frame.raw + at, end - first, conversion, disparity_.get() + at);
  }
}

}  // namespace hapticd::rt
