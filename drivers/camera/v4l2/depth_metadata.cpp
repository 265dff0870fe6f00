// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/depth_metadata.h"

namespace hapticd::drivers {
namespace {

// uvc_meta_buf: host time, frame number of the bus, then the payload's header
constexpr std::size_t kHostBytes = 10;
constexpr std::size_t kMinimalHeader = 2;
constexpr std::size_t kPresentationBytes = 4;
constexpr std::size_t kClockBytes = 6;
constexpr std::uint8_t kHasPresentation = 1U << 2;
constexpr std::uint8_t kHasClock = 1U << 3;

constexpr std::size_t kBlockHeader = 8;  // id, size including this header
constexpr std::uint32_t kCaptureTiming = 0x80000001;
constexpr std::size_t kTimingBytes = 40;

// An exposure is never older than this when the camera sends it.
constexpr std::uint32_t kOldest_us = 500'000;

DepthMetadata timingFrom(Bytes block) {
  // id, size, version, flags and the frame counter come first
  return {numberAt<std::uint32_t>(block, 20), numberAt<std::uint32_t>(block, 28),
          numberAt<std::uint32_t>(block, 36)};
}

}  // namespace

std::optional<DepthMetadata> depthMetadataFrom(Bytes buffer) {
  if (buffer.size() < kHostBytes + kMinimalHeader) return std::nullopt;
  Bytes header = buffer.subspan(kHostBytes);
  const auto length = std::to_integer<std::size_t>(header[0]);
  if (length < kMinimalHeader || length > header.size()) return std::nullopt;
  const auto flags = std::to_integer<std::uint8_t>(header[1]);
  header = header.subspan(kMinimalHeader, length - kMinimalHeader);

  const std::size_t standard = ((flags & kHasPresentation) != 0 ? kPresentationBytes : 0) +
                               ((flags & kHasClock) != 0 ? kClockBytes : 0);
  if (header.size() < standard) return std::nullopt;
  for (Bytes blocks = header.subspan(standard); blocks.size() >= kBlockHeader;) {
    const auto bytes = numberAt<std::uint32_t>(blocks, 4);
    if (bytes < kBlockHeader || bytes > blocks.size()) return std::nullopt;
    if (numberAt<std::uint32_t>(blocks, 0) == kCaptureTiming && bytes >= kTimingBytes) {
      return timingFrom(blocks);
    }
    blocks = blocks.subspan(bytes);
  }
  return std::nullopt;
}

std::optional<std::int64_t> exposureAge_ns(const DepthMetadata& metadata) {
  if (metadata.pipe_latency_us < metadata.optical_time_us) return std::nullopt;
  const std::uint32_t age_us = metadata.pipe_latency_us - metadata.optical_time_us;
  if (age_us > kOldest_us) return std::nullopt;
  return std::int64_t{age_us} * 1000;
}

}  // namespace hapticd::drivers
