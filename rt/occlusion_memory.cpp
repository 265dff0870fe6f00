#include "rt/occlusion_memory.h"

#include <algorithm>

#include "rt/occlusion_kernel.h"
#include "rt/scene.h"

namespace hapticd::rt {
namespace {

/// Measurements of a surface that rests differ by no more from frame to frame, but for 1 % of them.
constexpr std::uint16_t kNoise_raw = 2;
/// Where the shell's depth is less than that, far away, noise must not be taken for an occluder.
constexpr std::uint16_t kLeastShell_raw = 3;
/// Beyond, raw values mean nothing any more; they are taken for places that far away.
constexpr double kFarthest_m = 10;

/// Flags of a remembered visible value: there is no measurement now; its value is offered as hidden.
constexpr std::uint16_t kMissing = 0x8000;
constexpr std::uint16_t kOffered = 0x4000;
constexpr std::uint16_t kRawBits = kRawValues - 1;

double depthOf(const DepthModelParameters& camera, int raw) {
  const double inverse_depth = camera.a_per_m * raw + camera.b_per_m;
  return inverse_depth > 1 / kFarthest_m ? 1 / inverse_depth : kFarthest_m;
}

bool isMeasured(std::uint16_t raw) noexcept {
  return raw < kRawNoMeasurement;
}

bool differsByNoise(std::uint16_t a, std::uint16_t b) noexcept {
  return std::max(a, b) - std::min(a, b) <= kNoise_raw;
}

}  // namespace

OcclusionMemory::OcclusionMemory(const DepthModel& model)
    : falls_(model.parameters().a_per_m > 0),
      shell_end_{},
      visible_(std::make_unique<std::uint16_t[]>(kFramePixels + kVectorPadding)),
      hidden_(std::make_unique<std::uint16_t[]>(kFramePixels + kVectorPadding)),
      since_(std::make_unique<std::uint16_t[]>(kFramePixels)) {
  const auto depthOfNearness = [&](int nearness) {
    return depthOf(model.parameters(), nearnessOf(static_cast<std::uint16_t>(nearness)));
  };
  int end = 0;
  for (int nearness = 0; nearness < kRawNoMeasurement; ++nearness) {
    const double shell_from_m = depthOfNearness(nearness) - kShell_m;
    while (end < nearness && depthOfNearness(end) < shell_from_m) ++end;
    shell_end_[static_cast<std::size_t>(nearness)] =
        static_cast<std::uint16_t>(std::clamp(nearness - kLeastShell_raw, 0, end));
  }
  forget();
}

void OcclusionMemory::forget() noexcept {
  ++epoch_;
  hidden_count_ = 0;
  newest_ = 0;
  samples_of_strip_ = {};
}

bool OcclusionMemory::hidesAnything(const PixelWindow& window) const noexcept {
  if (hidden_count_ == 0 || window.empty()) return false;
  const auto first = static_cast<std::size_t>(window.column_first) / kTile;
  const auto last = static_cast<std::size_t>(window.column_last) / kTile;
  for (auto row = static_cast<std::size_t>(window.row_first);
       row <= static_cast<std::size_t>(window.row_last); ++row) {
    if (epoch_of_row_[row] != epoch_) continue;
    const std::uint8_t* const tiles = &hidden_of_tile_[row * kTilesAcross];
    if (std::any_of(tiles + first, tiles + last + 1, [](std::uint8_t count) { return count > 0; }))
      return true;
  }
  return false;
}

void OcclusionMemory::see(const DepthFrame& frame, const PixelWindow& window) noexcept {
  if (frame.sequence != newest_) {
    constexpr auto kMaxGap_ns = static_cast<std::int64_t>(kMaxGap_s * 1e9);
    const bool goes_on =
        newest_ != 0 && frame.sequence > newest_ && frame.arrival_ns - newest_ns_ <= kMaxGap_ns;
    if (!goes_on) forget();
    newest_ = frame.sequence;
    newest_ns_ = frame.arrival_ns;
    now_ = static_cast<std::uint16_t>(frame.sequence);
    if (cameraMoved(frame)) {
      forget();
      newest_ = frame.sequence;
    }
    const std::size_t strip = frame.sequence % kStripPeriod;
    for (std::size_t row = strip * kStripRows; row < (strip + 1) * kStripRows; ++row) {
      seeRow(frame, row, 0, kFrameWidth - 1);
    }
  }
  if (window.empty()) return;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    seeRow(frame, static_cast<std::size_t>(row), static_cast<std::size_t>(window.column_first),
           static_cast<std::size_t>(window.column_last));
  }
}

bool OcclusionMemory::cameraMoved(const DepthFrame& frame) noexcept {
  const std::size_t strip = frame.sequence % kStripPeriod;
  samples_of_strip_[strip] = {};
  for (std::size_t row = strip * kStripRows; row < (strip + 1) * kStripRows; ++row) {
    if (epoch_of_row_[row] == epoch_) compare(frame, row, samples_of_strip_[strip]);
  }
  Samples all;
  for (const Samples& of_strip : samples_of_strip_) {
    all.comparable += of_strip.comparable;
    all.moved += of_strip.moved;
  }
  return all.moved > kMovedShare * all.comparable;
}

void OcclusionMemory::compare(const DepthFrame& frame, std::size_t row, Samples& samples) noexcept {
  for (std::size_t tile = row * kTilesAcross; tile < (row + 1) * kTilesAcross; ++tile) {
    const std::uint16_t raw = frame.raw[tile * kTile];
    std::uint16_t& first = first_shown_[tile];
    if (!isMeasured(raw)) continue;
    if (first == kNothingSeen || isNearer(raw, first) || isNearer(first, raw)) {
      first = raw;  // another surface
      continue;
    }
    ++samples.comparable;
    if (!differsByNoise(raw, first)) ++samples.moved;
  }
}

bool OcclusionMemory::rowHides(std::size_t row) const noexcept {
  const std::uint8_t* const tiles = &hidden_of_tile_[row * kTilesAcross];
  return hidden_count_ > 0 &&
         std::any_of(tiles, tiles + kTilesAcross, [](std::uint8_t count) { return count > 0; });
}

void OcclusionMemory::startRow(std::size_t row) noexcept {
  epoch_of_row_[row] = epoch_;
  std::fill_n(visible_.get() + row * kFrameWidth, kFrameWidth, kNothingSeen);
  std::fill_n(hidden_.get() + row * kFrameWidth, kFrameWidth, kRawNoMeasurement);
  std::fill_n(&first_shown_[row * kTilesAcross], kTilesAcross, kNothingSeen);
  std::fill_n(&hidden_of_tile_[row * kTilesAcross], kTilesAcross, std::uint8_t{0});
}

void OcclusionMemory::seeRow(const DepthFrame& frame, std::size_t row, std::size_t column_first,
                             std::size_t column_last) noexcept {
  if (epoch_of_row_[row] != epoch_) startRow(row);
  const std::uint16_t* const raw_row = frame.raw + row * kFrameWidth;
  const std::size_t first_block = column_first / kOcclusionBlock;
  const std::size_t blocks = column_last / kOcclusionBlock - first_block + 1;
  const std::size_t first = row * kFrameWidth + first_block * kOcclusionBlock;
  const OcclusionRow pixels{.raw = frame.raw + first,
                            .visible = visible_.get() + first,
                            .hidden = rowHides(row) ? hidden_.get() + first : nullptr,
                            .blocks = blocks,
                            .last_raw = kRawNoMeasurement - 1,
                            .no_hidden = kRawNoMeasurement,
                            .most_raw = kLeastShell_raw};
  std::array<std::uint8_t, kFrameWidth / kOcclusionBlock> changed;
  const std::size_t changed_blocks = takeUnchanged(pixels, changed.data());
  Gap gap;
  for (std::size_t i = 0; i < changed_blocks; ++i) {
    seeBlock(raw_row, row, (first_block + changed[i]) * kOcclusionBlock, gap);
  }
}

void OcclusionMemory::seeBlock(const std::uint16_t* raw_row, std::size_t row, std::size_t column,
                               Gap& gap) noexcept {
  const std::size_t first = row * kFrameWidth + column;
  const auto hiddenPixels = [&] {
    return static_cast<std::uint32_t>(kOcclusionBlock) -
           static_cast<std::uint32_t>(
               std::count(&hidden_[first], &hidden_[first] + kOcclusionBlock, kRawNoMeasurement));
  };
  const std::uint32_t before = hiddenPixels();
  for (std::size_t i = 0; i < kOcclusionBlock; ++i) {
    const std::uint16_t raw = raw_row[column + i];
    if (isMeasured(raw)) {
      seePixel(raw, first + i);
    } else {
      missPixel(raw_row, row, column + i, gap);
    }
  }
  const std::uint32_t change = hiddenPixels() - before;  // negative ones wrap around, and back
  std::uint8_t& of_tile = hidden_of_tile_[first / kTile];
  of_tile = static_cast<std::uint8_t>(of_tile + change);
  hidden_count_ += change;
}

void OcclusionMemory::seePixel(std::uint16_t raw, std::size_t pixel) noexcept {
  const std::uint16_t before = visible_[pixel];
  const auto before_raw = static_cast<std::uint16_t>(before & kRawBits);
  visible_[pixel] = raw;
  if (before == kNothingSeen) {
    since_[pixel] = now_;
  } else if (isNearer(raw, before_raw)) {
    const bool settled = static_cast<std::uint16_t>(now_ - since_[pixel]) >= kSettledFrames;
    if (hidden_[pixel] == kRawNoMeasurement || ((before & kMissing) == 0 && settled))
      hidden_[pixel] = before_raw;
    since_[pixel] = now_;
  } else {
    if ((before & kOffered) != 0) hidden_[pixel] = kRawNoMeasurement;
    if (isNearer(before_raw, raw)) {
      since_[pixel] = now_;
    } else if ((before & kMissing) != 0) {
      since_[pixel] = static_cast<std::uint16_t>(now_ - kSettledFrames);  // as before the flicker
    }
  }
  const std::uint16_t hidden = hidden_[pixel];
  if (hidden != kRawNoMeasurement && nearnessOf(raw) + kNoise_raw >= nearnessOf(hidden)) {
    hidden_[pixel] = kRawNoMeasurement;
  }
}

void OcclusionMemory::missPixel(const std::uint16_t* raw_row, std::size_t row, std::size_t column,
                                Gap& gap) noexcept {
  const std::size_t pixel = row * kFrameWidth + column;
  const std::uint16_t before = visible_[pixel];
  if (before == kNothingSeen) return;
  if ((before & kMissing) == 0) {
    since_[pixel] = now_;
    visible_[pixel] = before | kMissing;
    if (hidden_[pixel] != kRawNoMeasurement) return;
    visible_[pixel] = before | kMissing | kOffered;
    hidden_[pixel] = before;
    return;
  }
  if (static_cast<std::uint16_t>(now_ - since_[pixel]) < kHoldFrames) return;
  if (inShadow(raw_row, column, hidden_[pixel], gap)) {
    since_[pixel] = now_;
    return;
  }
  visible_[pixel] = kNothingSeen;
  hidden_[pixel] = kRawNoMeasurement;
}

bool OcclusionMemory::inShadow(const std::uint16_t* raw_row, std::size_t column, std::uint16_t raw,
                               Gap& gap) const noexcept {
  if (column < gap.begin || column >= gap.end) {
    gap.begin = column;
    while (gap.begin > 0 && !isMeasured(raw_row[gap.begin - 1])) --gap.begin;
    gap.end = column + 1;
    while (gap.end < kFrameWidth && !isMeasured(raw_row[gap.end])) ++gap.end;
    gap.nearest_beside = kNothingSeen;
    if (gap.begin > 0) gap.nearest_beside = nearnessOf(raw_row[gap.begin - 1]);
    if (gap.end < kFrameWidth)
      gap.nearest_beside = std::min(gap.nearest_beside, nearnessOf(raw_row[gap.end]));
  }
  return raw != kRawNoMeasurement && gap.nearest_beside < shell_end_[nearnessOf(raw)];
}

}  // namespace hapticd::rt
