// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

/// The camera of a Kinect v1 (model 1414) as seen by USB and libfreenect.
namespace hapticd::test::kinect {

inline constexpr std::uint16_t kVendor = 0x045e;
inline constexpr std::uint16_t kProduct = 0x02ae;
inline constexpr std::uint16_t kRelease = 0x010b;  // any other release is treated as a later model
inline constexpr std::uint8_t kSerialString = 3;   // index of its string descriptor

inline constexpr std::uint8_t kVideoEndpoint = 0x81;
inline constexpr std::uint8_t kDepthEndpoint = 0x82;
inline constexpr std::size_t kMaxPacketBytes = 1920;  // two transactions of 960 bytes per microframe

inline constexpr std::size_t kPixels = 640 * 480;
inline constexpr std::size_t kPackedFrameBytes = kPixels * 11 / 8;
inline constexpr std::size_t kPacketHeaderBytes = 12;
inline constexpr std::size_t kPacketDataBytes = 1748;  // of every depth packet except the last
inline constexpr std::size_t kPacketsPerFrame = (kPackedFrameBytes + kPacketDataBytes - 1) / kPacketDataBytes;
static_assert(kPacketsPerFrame == 242);

inline constexpr std::size_t kMaxReplyBytes = 0x200;  // length requested by libfreenect

}  // namespace hapticd::test::kinect
