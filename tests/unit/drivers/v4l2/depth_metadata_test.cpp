// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/depth_metadata.h"

#include <gtest/gtest.h>

#include "tests/support/video/realsense_tables.h"

namespace hapticd::drivers {
namespace {

using test::put;
using Message = std::vector<std::byte>;

// 10 bytes of the kernel, a UVC header of 12 bytes with both time stamps, then a block before the timing.
constexpr std::size_t kOther = 22;
constexpr std::size_t kTiming = kOther + 16;

Message buffer() {
  Message bytes(kTiming + 40);
  bytes[10] = std::byte{68};
  bytes[11] = std::byte{0x0C};
  put(bytes, kOther, 0x80000000U);
  put(bytes, kOther + 4, 16U);
  put(bytes, kTiming, 0x80000001U);
  put(bytes, kTiming + 4, 40U);
  put(bytes, kTiming + 20, 8'000U);
  put(bytes, kTiming + 28, 15'000U);
  put(bytes, kTiming + 36, 30'000U);
  return bytes;
}

TEST(DepthMetadata, TheExposureIsOlderThanTheTransmissionByThePipeWithoutTheTimeToItsMiddle) {
  const auto metadata = depthMetadataFrom(buffer());
  ASSERT_TRUE(metadata);
  EXPECT_EQ(metadata->exposure_us, 15'000U);
  EXPECT_EQ(exposureAge_ns(*metadata), 22'000'000);
}

TEST(DepthMetadata, TimesThatDoNotFitTogetherGiveNoAge) {
  EXPECT_EQ(exposureAge_ns({30'000, 0, 8'000}), std::nullopt);
  EXPECT_EQ(exposureAge_ns({0, 0, 4'000'000'000}), std::nullopt);
}

TEST(DepthMetadata, DamagedBuffersHoldNone) {
  for (std::size_t size = 0; size < buffer().size(); ++size) {
    Message shorter = buffer();
    shorter.resize(size);
    EXPECT_FALSE(depthMetadataFrom(shorter)) << size;
  }
  for (const std::uint32_t size : {0U, 7U, 57U, 0xFFFFFFFFU}) {
    Message bytes = buffer();
    put(bytes, kOther + 4, size);
    EXPECT_FALSE(depthMetadataFrom(bytes)) << size;
  }
}

}  // namespace
}  // namespace hapticd::drivers
