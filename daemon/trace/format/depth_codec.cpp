// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/format/depth_codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>
#include <vector>

#include "daemon/trace/mcap/mcap_format.h"

namespace hapticd::trace {
namespace {

constexpr std::size_t kPixelBytes = 2;
constexpr std::size_t kMaxSymbolBytes = 3;  ///< of a pixel
constexpr std::uint8_t kNoMeasurement = 254;
constexpr std::uint8_t kRawFollows = 255;

std::string_view textOf(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::uint16_t pixelAt(const char* row, std::size_t column) {
  std::uint16_t raw = 0;
  std::memcpy(&raw, row + column * kPixelBytes, sizeof raw);
  return raw;
}

/// Maps 0, -1, 1, -2, 2, ... to 0, 1, 2, 3, 4, ...
std::uint32_t folded(std::int32_t difference) {
  const auto bits = static_cast<std::uint32_t>(difference);
  return (bits << 1) ^ (difference < 0 ? ~std::uint32_t{0} : 0);
}
std::int32_t unfolded(std::uint32_t folded) {
  return static_cast<std::int32_t>((folded >> 1) ^ ((folded & 1) != 0 ? ~std::uint32_t{0} : 0));
}

/// Returns whether the padding of the rows is zero, because padding is not encoded.
bool paddingIsZero(const rt::DepthFrameHeader& header, std::string_view image) {
  const std::size_t pixels = std::size_t{header.width_px} * kPixelBytes;
  if (pixels == header.stride_bytes) return true;
  for (std::size_t row = 0; row < header.height_px; ++row) {
    const std::string_view rest =
        image.substr(row * header.stride_bytes + pixels, header.stride_bytes - pixels);
    if (rest.find_first_not_of('\0') != std::string_view::npos) return false;
  }
  return true;
}

void toSymbols(const rt::DepthFrameHeader& header, std::string_view image, std::string& symbols) {
  symbols.resize(std::size_t{header.width_px} * header.height_px * kMaxSymbolBytes);
  std::vector<std::uint16_t> above(header.width_px);
  char* to = symbols.data();
  for (std::size_t row = 0; row < header.height_px; ++row) {
    const char* const pixels = image.data() + row * header.stride_bytes;
    for (std::size_t column = 0; column < header.width_px; ++column) {
      const std::uint16_t raw = pixelAt(pixels, column);
      if (raw == header.raw_no_measurement) {
        *to++ = static_cast<char>(kNoMeasurement);
        continue;
      }
      const std::uint32_t symbol = folded(std::int32_t{raw} - above[column]);
      above[column] = raw;
      if (symbol < kNoMeasurement) {
        *to++ = static_cast<char>(symbol);
        continue;
      }
      *to++ = static_cast<char>(kRawFollows);
      std::memcpy(to, &raw, sizeof raw);
      to += sizeof raw;
    }
  }
  symbols.resize(static_cast<std::size_t>(to - symbols.data()));
}

/// Returns false if the symbols are not those of one image.
bool fromSymbols(const rt::DepthFrameHeader& header, std::string_view symbols, std::string& image) {
  image.assign(header.imageBytes(), '\0');
  std::vector<std::uint16_t> above(header.width_px);
  const char* from = symbols.data();
  const char* const end = from + symbols.size();
  for (std::size_t row = 0; row < header.height_px; ++row) {
    char* const pixels = image.data() + row * header.stride_bytes;
    for (std::size_t column = 0; column < header.width_px; ++column) {
      if (from == end) return false;
      const auto symbol = static_cast<std::uint8_t>(*from++);
      auto raw = static_cast<std::uint16_t>(header.raw_no_measurement);
      if (symbol == kRawFollows) {
        if (end - from < static_cast<std::ptrdiff_t>(kPixelBytes)) return false;
        raw = pixelAt(from, 0);
        from += kPixelBytes;
      } else if (symbol != kNoMeasurement) {
        raw = static_cast<std::uint16_t>(above[column] + unfolded(symbol));
      }
      if (symbol != kNoMeasurement) above[column] = raw;
      std::memcpy(pixels + column * kPixelBytes, &raw, sizeof raw);
    }
  }
  return from == end;
}

}  // namespace

void DepthEncoder::encode(const rt::DepthFrameHeader& header, std::span<const std::byte> image,
                          DepthRecord& record) {
  const std::string_view raw = textOf(image);
  record.header = header;
  record.raw_crc32 = mcap::crcOf(raw);
  record.encoding = DepthEncoding::above_zstd;
  bool shorter = paddingIsZero(header, raw);
  if (shorter) {
    toSymbols(header, raw, symbols_);
    shorter = compressor_.compress(symbols_, record.image.bytes) && record.image.bytes.size() < raw.size();
  }
  if (shorter) return;
  record.encoding = DepthEncoding::plain;
  record.image.bytes = raw;
}

std::string DepthDecoder::decode(const DepthRecord& record, std::string& image) {
  const rt::DepthFrameHeader& header = record.header;
  if (std::string fault = depthHeaderFault(header); !fault.empty()) return fault;
  if (record.encoding == DepthEncoding::plain) {
    image = record.image.bytes;
  } else {
    const std::size_t max_bytes = std::size_t{header.width_px} * header.height_px * kMaxSymbolBytes;
    if (!decompressUpTo(record.image.bytes, max_bytes, symbols_) || !fromSymbols(header, symbols_, image)) {
      return fmt::format("depth frame {} cannot be decoded", header.frame);
    }
  }
  if (image.size() == header.imageBytes() && mcap::crcOf(image) == record.raw_crc32) return "";
  return fmt::format("the checksum of depth frame {} does not match", header.frame);
}

namespace {

/// Returns the camera that a header describes; `limits`: states near_m and far_m, which headers do not.
rt::DepthModelParameters cameraOf(const rt::DepthFrameHeader& header,
                                  const rt::DepthModelParameters& limits) {
  rt::DepthModelParameters camera;
  camera.near_m = limits.near_m;
  camera.far_m = limits.far_m;
  camera.width_px = static_cast<int>(header.width_px);
  camera.height_px = static_cast<int>(header.height_px);
  camera.fx_px = header.fx_px;
  camera.fy_px = header.fy_px;
  camera.cx_px = header.cx_px;
  camera.cy_px = header.cy_px;
  camera.law = header.depth_law;
  camera.raw_no_measurement = static_cast<std::uint16_t>(header.raw_no_measurement);
  camera.principle = header.principle;
  constexpr std::uint32_t kAllRaws = 65536;
  camera.raw_values = kAllRaws;
  if (header.depth_law == rt::DepthLawKind::reciprocal) {
    camera.a_per_m = header.depth_law_coefficients[0];
    camera.b_per_m = header.depth_law_coefficients[1];
    // The greatest value of a sensor that measures disparity means that it measured none.
    if (header.raw_no_measurement > 0) camera.raw_values = header.raw_no_measurement + 1;
  } else {
    camera.unit_m = header.depth_law_coefficients[0];
  }
  const bool is_stated = header.correlation_px > 0;
  if (header.noise == rt::DepthNoiseKind::polynomial && is_stated) {
    camera.noise = {.c0_m = header.noise_coefficients[0],
                    .c1 = header.noise_coefficients[1],
                    .c2_per_m = header.noise_coefficients[2],
                    .standing_share = header.standing_share,
                    .correlation_px = header.correlation_px};
  }
  return camera;
}

}  // namespace

std::string DepthDecoder::decode(const DepthRecord& record, rt::DepthFrame& frame) {
  if (std::string wrong = decode(record, image_); !wrong.empty()) return wrong;
  const rt::DepthFrameHeader& header = record.header;
  frame.camera = cameraOf(header, frame.camera);
  if (const rt::CameraFault fault = rt::faultOf(frame.camera); fault != rt::CameraFault::none) {
    return fmt::format("depth frame {} is of a camera that cannot be modelled: {}", header.frame,
                       rt::wordOf(fault));
  }
  const std::size_t row_bytes = header.width_px * kPixelBytes;
  const std::span<std::uint16_t> image = frame.image();
  if (header.stride_bytes != row_bytes || image.size_bytes() != image_.size())
    std::ranges::fill(image, frame.camera.raw_no_measurement);
  for (std::size_t row = 0; row < header.height_px; ++row) {
    std::memcpy(image.data() + row * static_cast<std::size_t>(rt::strideOf(frame.camera.width_px)),
                image_.data() + row * header.stride_bytes, row_bytes);
  }
  if (std::ranges::any_of(image, [&](std::uint16_t raw) { return raw >= frame.camera.raw_values; })) {
    return fmt::format("depth frame {} has a raw value above {}", header.frame, frame.camera.raw_values - 1);
  }
  frame.sequence = header.frame;
  frame.arrival_ns = header.arrival_ns;
  frame.exposure_ns = header.exposure_ns;
  frame.device_ticks = header.device_ticks;
  return "";
}

std::string depthHeaderFault(const rt::DepthFrameHeader& header) {
  switch (rt::faultOf(header)) {
    case rt::DepthHeaderFault::none:
      return "";
    case rt::DepthHeaderFault::no_header:
      return "a depth frame whose header does not begin with its magic bytes";
    case rt::DepthHeaderFault::unknown_version:
      return fmt::format("a depth frame of header version {}; this hapticd reads {}", header.version,
                         rt::DepthFrameHeader::kVersion);
    case rt::DepthHeaderFault::wrong_size:
      return fmt::format("a depth frame whose header has {} bytes; those of version {} have {}",
                         header.header_bytes, header.version, sizeof header);
    case rt::DepthHeaderFault::unknown_type:
      return "a depth frame of a raw type, depth law or noise model that this hapticd does not know";
    case rt::DepthHeaderFault::impossible_image:
      return fmt::format("a depth frame of {} x {} pixels in rows of {} bytes", header.width_px,
                         header.height_px, header.stride_bytes);
  }
  return "a depth frame with an unknown fault";
}

rt::DepthFrameHeader headerOf(const rt::DepthFrameHeader& common, const rt::DepthFrame& frame) {
  rt::DepthFrameHeader header = common;
  const rt::DepthModelParameters& camera = frame.camera;
  header.width_px = static_cast<std::uint32_t>(camera.width_px);
  header.height_px = static_cast<std::uint32_t>(camera.height_px);
  header.stride_bytes = static_cast<std::uint32_t>(rt::strideOf(camera.width_px)) * kPixelBytes;
  header.raw_no_measurement = camera.raw_no_measurement;
  header.depth_law = camera.law;
  header.principle = camera.principle;
  const bool linear = camera.law == rt::DepthLawKind::linear;
  header.depth_law_coefficients = {linear ? camera.unit_m : camera.a_per_m, linear ? 0 : camera.b_per_m};
  header.fx_px = camera.fx_px;
  header.fy_px = camera.fy_px;
  header.cx_px = camera.cx_px;
  header.cy_px = camera.cy_px;
  if (camera.noise.isKnown()) {
    header.noise = rt::DepthNoiseKind::polynomial;
    header.noise_coefficients = {camera.noise.c0_m, camera.noise.c1, camera.noise.c2_per_m};
    header.standing_share = camera.noise.standing_share;
    header.correlation_px = camera.noise.correlation_px;
  } else if (linear) {
    header.noise = rt::DepthNoiseKind::unknown;
  }
  header.exposure_ns = frame.exposure_ns;
  header.arrival_ns = frame.arrival_ns;
  header.frame = frame.sequence;
  header.device_ticks = frame.device_ticks;
  return header;
}

}  // namespace hapticd::trace
