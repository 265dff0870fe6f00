// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/depth_use.h"

#include <fmt/format.h>

#include <cstdlib>

namespace hapticd::drivers {
namespace {

/// One row in so many is looked at for its bytes, with the row below it.
constexpr int kRowStep = 16;
/// Pairs of neighbours that must speak for swapped bytes, and how many times as often as against them.
constexpr std::size_t kMinPairs = 100;
constexpr std::size_t kMaxPairsAgainst = 4;
/// By how much a step between neighbours must be smaller for it to count.
constexpr int kSmoother = 8;
/// Limits for an image without steps: the usable share as it is, and with the bytes swapped.
constexpr std::size_t kMaxUsable_percent = 25;
constexpr std::size_t kMinIfSwapped_percent = 95;

std::uint16_t swapped(std::uint16_t raw) {
  return static_cast<std::uint16_t>(raw << 8 | raw >> 8);
}

/// Depth changes little from pixel to pixel. Where its bytes are swapped, small steps become multiples of
/// 256.
struct Steps {
  std::size_t smoother_if_swapped = 0;
  std::size_t rougher_if_swapped = 0;

  void add(std::uint16_t a, std::uint16_t b) {
    const int as_is = std::abs(int{a} - int{b});
    const int if_swapped = std::abs(int{swapped(a)} - int{swapped(b)});
    if (if_swapped < as_is / kSmoother) ++smoother_if_swapped;
    if (as_is < if_swapped / kSmoother) ++rougher_if_swapped;
  }
  bool speakForSwapping() const {
    return smoother_if_swapped >= kMinPairs && smoother_if_swapped > kMaxPairsAgainst * rougher_if_swapped;
  }
  bool areSilent() const { return smoother_if_swapped + rougher_if_swapped < kMinPairs; }
};

/// Pixels with a depth; without branches, so that the compiler vectorises it.
template <typename Raw>
std::size_t countUsable(const rt::DepthFrame& frame, const rt::DepthModel& model, Raw rawOf) {
  const std::uint16_t first = model.firstRaw(), none = frame.camera.raw_no_measurement;
  const auto range = static_cast<std::uint16_t>(model.lastRaw() - first);
  std::uint32_t count = 0;
  for (const std::uint16_t pixel : frame.image()) {
    const std::uint16_t raw = rawOf(pixel);
    const bool in_range = static_cast<std::uint16_t>(raw - first) <= range;
    count += static_cast<std::uint32_t>(in_range) & static_cast<std::uint32_t>(pixel != none);
  }
  return count;
}

std::size_t countMeasured(const rt::DepthFrame& frame) {
  std::uint32_t count = 0;
  for (const std::uint16_t pixel : frame.image()) {
    count += static_cast<std::uint32_t>(pixel != frame.camera.raw_no_measurement);
  }
  return count;
}

Steps stepsOf(const rt::DepthFrame& frame, const rt::DepthModel& model) {
  Steps steps;
  const std::uint16_t none = frame.camera.raw_no_measurement;
  const auto stride = static_cast<std::size_t>(model.stride_px());
  const auto width = static_cast<std::size_t>(model.width_px());
  for (int row = 1; row < model.height_px(); row += kRowStep) {
    const std::uint16_t* const below = frame.raw + static_cast<std::size_t>(row) * stride;
    const std::uint16_t* const pixels = below - stride;
    for (std::size_t column = 1; column < width; ++column) {
      if (pixels[column] == none) continue;
      if (pixels[column - 1] != none) steps.add(pixels[column - 1], pixels[column]);
      if (below[column] != none) steps.add(pixels[column], below[column]);
    }
  }
  return steps;
}

std::size_t percent(std::size_t part, const DepthUse& use) {
  return use.measured == 0 ? 0 : 100 * part / use.measured;
}

std::string swappedText(const DepthUse& use) {
  return fmt::format(
      "the two bytes of the raw values of frame {} seem to be swapped: {} % of what it measured lies between "
      "camera.near_m and camera.far_m, and {} % with the bytes the other way round (PNG and PGM images hold "
      "the more significant byte first)",
      use.frame, percent(use.usable, use), percent(use.if_swapped, use));
}

std::string unusableText(std::uint64_t frames, bool measured) {
  const std::string which = frames == 1 ? "the frame" : fmt::format("{} frames", frames);
  return measured ? fmt::format(
                        "no pixel of {} lies between camera.near_m and camera.far_m, so that no force comes "
                        "(check the scene, the two limits, and the depth of one raw unit)",
                        which)
                  : fmt::format(
                        "nothing was measured in {}, so that no force comes (check that the camera sees the "
                        "scene, and that it is not too near)",
                        which);
}

}  // namespace

DepthUse DepthUse::of(const rt::DepthFrame& frame, const rt::DepthModel& model) {
  DepthUse use{.frame = frame.sequence};
  use.measured = countMeasured(frame);
  use.usable = countUsable(frame, model, [](std::uint16_t raw) { return raw; });
  const Steps steps = stepsOf(frame, model);
  if (!steps.speakForSwapping() && !steps.areSilent()) return use;
  use.if_swapped = countUsable(frame, model, swapped);
  const bool is_better =
      percent(use.usable, use) < kMaxUsable_percent && percent(use.if_swapped, use) >= kMinIfSwapped_percent;
  // a flat image without noise has no steps
  use.looks_swapped = steps.speakForSwapping() ? use.if_swapped > use.measured / 2 : is_better;
  return use;
}

void DepthUseWatch::add(const DepthUse& use) {
  last_ = use;
  ++frames_;
  if (use.looks_swapped && !swapped_.looks_swapped) swapped_ = use;
  if (use.usable > 0) {
    unusable_in_row_ = 0;
    measured_ = false;
    return;
  }
  ++unusable_;
  ++unusable_in_row_;
  measured_ = measured_ || use.measured > 0;
}

std::string DepthUseWatch::newest() const {
  if (last_.looks_swapped) return swappedText(last_);
  return unusable_in_row_ < kMin ? "" : unusableText(unusable_in_row_, measured_);
}

std::string DepthUseWatch::all() const {
  if (swapped_.looks_swapped) return swappedText(swapped_);
  return unusable_ == 0 || unusable_ < frames_ ? "" : unusableText(frames_, measured_);
}

}  // namespace hapticd::drivers
