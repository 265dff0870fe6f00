// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>

#include "rt/base/fields.h"
#include "rt/base/parameters.h"
#include "rt/base/words.h"

namespace hapticd::rt {

/// Encoding of the raw value of one pixel.
enum class DepthRawType : std::uint8_t {
  uint16,  ///< two bytes, little-endian
};
constexpr auto wordsOf(DepthRawType) {
  return words<DepthRawType>("uint16");
}

/// Model of the standard deviation of Z.
enum class DepthNoiseKind : std::uint8_t {
  unknown,
  polynomial,  ///< c0 + c1 Z + c2 Z^2 in m, Z in m
};
constexpr auto wordsOf(DepthNoiseKind) {
  return words<DepthNoiseKind>("unknown", "polynomial");
}

/// Describes a raw depth image: everything needed to convert its bytes to points.
///
/// Plain data of fixed layout, little-endian, without padding: the same bytes in memory, in a trace and in
/// memory shared with another process. A receiver calls faultOf() before it uses any other field. Any change
/// of the layout or of a field's meaning increments kVersion.
///
/// Camera frame: x right, y up, looking along -z; pixel (0, 0) is the upper left one.
struct DepthFrameHeader {
  static constexpr std::array<std::uint8_t, 4> kMagic{'H', 'D', 'E', 'P'};
  static constexpr std::uint16_t kVersion = 2;
  static constexpr std::uint32_t kMaxPixelsPerSide = 4096;
  static constexpr std::size_t kSerialBytes = 32;

  std::array<std::uint8_t, 4> magic = kMagic;
  std::uint16_t version = kVersion;
  std::uint16_t header_bytes = 280;  ///< size of this structure
  std::uint32_t width_px = 0;        ///< columns, 1..4096
  std::uint32_t height_px = 0;       ///< rows, 1..4096
  std::uint32_t stride_bytes = 0;    ///< distance between rows; a multiple of the pixel size
  DepthRawType raw_type = DepthRawType::uint16;
  DepthLawKind depth_law = DepthLawKind::reciprocal;
  DepthNoiseKind noise = DepthNoiseKind::unknown;
  DepthPrinciple principle = DepthPrinciple::structured_light;
  std::uint32_t raw_no_measurement = 0;  ///< the raw value that means no measurement
  std::uint32_t device_ticks = 0;        ///< the camera's own counter at this frame; 0 if it has none
  std::array<double, 2> depth_law_coefficients = {};  ///< see DepthLawKind
  double fx_px = 0;                                   ///< focal length along x
  double fy_px = 0;                                   ///< focal length along y
  double cx_px = 0;                                   ///< principal point, x
  double cy_px = 0;                                   ///< principal point, y
  std::array<double, 9> rotation_world_camera = {};   ///< rotation of T_world_camera, row by row
  std::array<double, 3> position_m_in_world = {};  ///< translation of T_world_camera: the camera's position
  std::array<double, 3> noise_coefficients = {};   ///< see DepthNoiseKind
  std::int64_t exposure_ns = 0;                    ///< CLOCK_MONOTONIC at mid-exposure; 0: unknown
  std::int64_t arrival_ns = 0;                     ///< CLOCK_MONOTONIC when the last byte arrived
  std::uint64_t frame = 0;                         ///< 1 for the first frame since the camera started
  std::uint64_t device_tick_hz = 0;                ///< frequency of device_ticks; 0: unknown
  std::array<std::uint8_t, kSerialBytes> serial = {};  ///< of the camera; ASCII, padded with zeros
  double standing_share = 0;                           ///< of the noise's variance, see DepthNoiseParameters
  /// Of the noise, see DepthNoiseParameters; 0: the noise model is what is usual, and not stated by the
  /// camera.
  double correlation_px = 0;

  /// Returns the size of the image in bytes.
  std::size_t imageBytes() const noexcept { return std::size_t{stride_bytes} * height_px; }
};
template <std::same_as<DepthFrameHeader> Header>
constexpr auto fieldsOf(std::type_identity<Header>) {
  return std::tuple{HAPTICD_TRACED(magic),
                    HAPTICD_TRACED(version).tracedAs("header_version"),
                    HAPTICD_TRACED(header_bytes),
                    HAPTICD_TRACED(width_px),
                    HAPTICD_TRACED(height_px),
                    HAPTICD_TRACED(stride_bytes),
                    HAPTICD_TRACED(raw_type),
                    HAPTICD_TRACED(depth_law),
                    HAPTICD_TRACED(noise),
                    HAPTICD_TRACED(principle),
                    HAPTICD_TRACED(raw_no_measurement),
                    HAPTICD_TRACED(device_ticks),
                    HAPTICD_TRACED(depth_law_coefficients),
                    HAPTICD_TRACED(fx_px),
                    HAPTICD_TRACED(fy_px),
                    HAPTICD_TRACED(cx_px),
                    HAPTICD_TRACED(cy_px),
                    HAPTICD_TRACED(rotation_world_camera),
                    HAPTICD_TRACED(position_m_in_world),
                    HAPTICD_TRACED(noise_coefficients),
                    HAPTICD_TRACED(exposure_ns),
                    HAPTICD_TRACED(arrival_ns),
                    HAPTICD_TRACED(frame),
                    HAPTICD_TRACED(device_tick_hz),
                    HAPTICD_TRACED(serial),
                    HAPTICD_TRACED(standing_share),
                    HAPTICD_TRACED(correlation_px)};
}

// The layout is an interface that other programs and other versions read.
static_assert(std::endian::native == std::endian::little);
static_assert(std::is_trivially_copyable_v<DepthFrameHeader> && std::is_standard_layout_v<DepthFrameHeader>);
static_assert(std::has_unique_object_representations_v<decltype(DepthFrameHeader::serial)>);
static_assert(sizeof(DepthFrameHeader) == 280 && alignof(DepthFrameHeader) == 8);
static_assert(offsetof(DepthFrameHeader, version) == 4 && offsetof(DepthFrameHeader, header_bytes) == 6);
static_assert(offsetof(DepthFrameHeader, width_px) == 8 && offsetof(DepthFrameHeader, height_px) == 12);
static_assert(offsetof(DepthFrameHeader, stride_bytes) == 16 && offsetof(DepthFrameHeader, raw_type) == 20);
static_assert(offsetof(DepthFrameHeader, depth_law) == 21 && offsetof(DepthFrameHeader, noise) == 22);
static_assert(offsetof(DepthFrameHeader, principle) == 23);
static_assert(offsetof(DepthFrameHeader, raw_no_measurement) == 24);
static_assert(offsetof(DepthFrameHeader, device_ticks) == 28);
static_assert(offsetof(DepthFrameHeader, depth_law_coefficients) == 32);
static_assert(offsetof(DepthFrameHeader, fx_px) == 48 && offsetof(DepthFrameHeader, cy_px) == 72);
static_assert(offsetof(DepthFrameHeader, rotation_world_camera) == 80);
static_assert(offsetof(DepthFrameHeader, position_m_in_world) == 152);
static_assert(offsetof(DepthFrameHeader, noise_coefficients) == 176);
static_assert(offsetof(DepthFrameHeader, exposure_ns) == 200 &&
              offsetof(DepthFrameHeader, arrival_ns) == 208);
static_assert(offsetof(DepthFrameHeader, frame) == 216 && offsetof(DepthFrameHeader, device_tick_hz) == 224);
static_assert(offsetof(DepthFrameHeader, serial) == 232);
static_assert(offsetof(DepthFrameHeader, standing_share) == 264);

/// Reasons why a header cannot be used.
enum class DepthHeaderFault : std::uint8_t {
  none,
  no_header,        ///< it does not begin with kMagic
  unknown_version,  ///< only `magic` and `version` are valid
  wrong_size,       ///< header_bytes does not match the version
  unknown_type,     ///< raw_type, depth_law, noise or principle has a value unknown to this version
  impossible_image  ///< width, height or stride out of range
};

/// Returns the first fault of a received header, or `none` if it can be used.
/// Thread: any.  Progress: wait-free.  RT: safe.
constexpr DepthHeaderFault faultOf(const DepthFrameHeader& header) noexcept {
  if (header.magic != DepthFrameHeader::kMagic) return DepthHeaderFault::no_header;
  if (header.version != DepthFrameHeader::kVersion) return DepthHeaderFault::unknown_version;
  if (header.header_bytes != sizeof(DepthFrameHeader)) return DepthHeaderFault::wrong_size;
  if (header.raw_type > DepthRawType::uint16 || header.depth_law > DepthLawKind::linear ||
      header.noise > DepthNoiseKind::polynomial || header.principle > DepthPrinciple::time_of_flight) {
    return DepthHeaderFault::unknown_type;
  }
  constexpr std::uint32_t kPixelBytes = 2;
  constexpr std::uint32_t kMax = DepthFrameHeader::kMaxPixelsPerSide;
  const bool possible = header.width_px > 0 && header.width_px <= kMax && header.height_px > 0 &&
                        header.height_px <= kMax && header.stride_bytes % kPixelBytes == 0 &&
                        header.stride_bytes >= kPixelBytes * header.width_px &&
                        header.stride_bytes <= 2 * kPixelBytes * kMax;
  return possible ? DepthHeaderFault::none : DepthHeaderFault::impossible_image;
}

}  // namespace hapticd::rt
