// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/orbbec_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace hapticd::drivers::orbbec {
namespace {

constexpr std::uint16_t kRequestMagic = 0x4D47;
constexpr std::uint16_t kResponseMagic = 0x4252;
constexpr std::size_t kRequestHeaderBytes = 8;
constexpr std::size_t kResponseHeaderBytes = 10;
constexpr std::size_t kErrorBytes = 2;  // the last field of the response's header, which its length counts

constexpr std::size_t kSmallControl = 64;
constexpr std::size_t kMediumControl = 512;
constexpr std::size_t kLargeControl = 1024;

constexpr std::size_t kCalibrationBytes = 152;  // two intrinsics, two distortions, one transform
constexpr std::size_t kDepthCalibrationBytes = 28;

constexpr const char* kConfigure =
    "set camera.intrinsics to configured and camera.unit_um to the camera's unit, or update its firmware";

std::unexpected<base::Error> refuse(const char* where, std::string what) {
  return std::unexpected(base::Error{where, std::move(what), kConfigure});
}

/// Text in a field of a fixed size, which may lack the terminating NUL.
std::string textAt(Bytes data, std::size_t offset, std::size_t bytes) {
  const Bytes field = data.subspan(offset, bytes);
  const auto end = std::ranges::find(field, std::byte{0});
  std::string text;
  for (const std::byte byte : std::span(field.begin(), end)) {
    const char letter = static_cast<char>(byte);
    text += letter >= ' ' && letter <= '~' ? letter : '?';
  }
  return text;
}

struct ListedMode {
  FrameSize size;
  Pinhole pinhole;
};

ListedMode modeAt(Bytes list, std::size_t offset) {
  const auto number = [&](std::size_t index) {
    return static_cast<double>(numberAt<float>(list, offset + index * sizeof(float)));
  };
  return {{numberAt<std::int16_t>(list, offset + 16), numberAt<std::int16_t>(list, offset + 18)},
          {number(0), number(1), number(2), number(3)}};
}

}  // namespace

std::vector<std::byte> encoded(const Request& request) {
  std::vector<std::byte> bytes;
  append(bytes, kRequestMagic);
  append(bytes, static_cast<std::uint16_t>((1 + request.words.size()) * sizeof(std::uint32_t) / 2));
  append(bytes, static_cast<std::uint16_t>(request.operation));
  append(bytes, request.id);
  append(bytes, request.property);
  for (const std::uint32_t word : request.words) append(bytes, word);
  bytes.resize(bytes.size() <= kSmallControl    ? kSmallControl
               : bytes.size() <= kMediumControl ? kMediumControl
                                                : kLargeControl);
  return bytes;
}

std::size_t responseBytes(Operation operation) {
  switch (operation) {
    case Operation::get_structure:
      return kMediumControl;
    case Operation::read_list:
      return kLargeControl;
    default:
      return kSmallControl;
  }
}

std::uint8_t selectorOf(std::size_t control_bytes) {
  if (control_bytes <= kSmallControl) return 2;
  return control_bytes <= kMediumControl ? 1 : 3;
}

base::Result<std::vector<std::byte>> responseData(const Request& request, Bytes response) {
  constexpr const char* kWhere = "Orbbec protocol";
  if (response.size() < kResponseHeaderBytes) {
    return refuse(kWhere, fmt::format("the response has only {} bytes", response.size()));
  }
  if (const auto magic = numberAt<std::uint16_t>(response, 0); magic != kResponseMagic) {
    return refuse(
        kWhere, fmt::format("the response begins with 0x{:04x} instead of 0x{:04x}", magic, kResponseMagic));
  }
  const auto operation = static_cast<std::uint16_t>(request.operation);
  if (const auto answered = numberAt<std::uint16_t>(response, 4); answered != operation) {
    return refuse(kWhere, fmt::format("the response to operation {} is to {}", operation, answered));
  }
  if (const auto id = numberAt<std::uint16_t>(response, 6); id != request.id) {
    return refuse(kWhere, fmt::format("the response to request {} is to {}", request.id, id));
  }
  if (const auto error = numberAt<std::uint16_t>(response, 8); error != 0) {
    return refuse(kWhere,
                  fmt::format("the camera refuses property {} with error 0x{:04x}", request.property, error));
  }
  const std::size_t stated = std::size_t{numberAt<std::uint16_t>(response, 2)} * 2;
  if (stated < kErrorBytes || stated - kErrorBytes > response.size() - kResponseHeaderBytes) {
    return refuse(kWhere,
                  fmt::format("the response to property {} states {} bytes", request.property, stated));
  }
  const Bytes data = response.subspan(kResponseHeaderBytes, stated - kErrorBytes);
  return std::vector<std::byte>(data.begin(), data.end());
}

base::Result<std::uint32_t> propertyFrom(Bytes data) {
  if (data.size() < sizeof(std::uint32_t)) {
    return refuse("Orbbec property", fmt::format("has only {} bytes", data.size()));
  }
  return numberAt<std::uint32_t>(data, 0);
}

base::Result<double> depthUnit_mFrom(Bytes data) {
  if (auto present = propertyFrom(data); !present) return std::unexpected(present.error());
  const double unit_m = static_cast<double>(numberAt<float>(data, 0)) / 1000;
  if (!(unit_m >= 1e-6 && unit_m <= 0.1)) {
    return refuse("Orbbec depth unit", fmt::format("is {} m", unit_m));
  }
  return unit_m;
}

base::Result<ListSize> listSizeFrom(Bytes data) {
  constexpr std::uint32_t kMax = 64 * 1024;
  if (data.size() < 6) return refuse("Orbbec list", fmt::format("its size has only {} bytes", data.size()));
  const ListSize size{numberAt<std::uint16_t>(data, 0), numberAt<std::uint32_t>(data, 2)};
  if (size.bytes == 0 || size.bytes > kMax) {
    return refuse("Orbbec list", fmt::format("states {} bytes", size.bytes));
  }
  return size;
}

base::Result<Pinhole> pinholeOfMode(Bytes list, FrameSize size) {
  constexpr const char* kWhere = "Orbbec calibration";
  if (list.empty() || list.size() % kCalibrationBytes != 0) {
    return refuse(
        kWhere, fmt::format("{} bytes are not a list of items of {} bytes", list.size(), kCalibrationBytes));
  }
  std::optional<ListedMode> proportional;
  for (std::size_t offset = 0; offset < list.size(); offset += kCalibrationBytes) {
    const ListedMode mode = modeAt(list, offset);
    if (mode.size == size) return plausiblePinhole(mode.pinhole, size, kWhere);
    if (mode.size.width_px > 0 &&
        mode.size.width_px * size.height_px == mode.size.height_px * size.width_px) {
      proportional = mode;
    }
  }
  if (!proportional) {
    return refuse(kWhere,
                  fmt::format("has no mode of the proportions of {} x {}", size.width_px, size.height_px));
  }
  const double factor = static_cast<double>(size.width_px) / proportional->size.width_px;
  return plausiblePinhole(scaled(proportional->pinhole, factor), size, kWhere);
}

base::Result<double> baseline_mFrom(Bytes list) {
  constexpr const char* kWhere = "Orbbec depth calibration";
  constexpr std::size_t kBaselineOffset = 4;
  if (list.size() < kDepthCalibrationBytes) {
    return refuse(kWhere, fmt::format("has only {} bytes", list.size()));
  }
  const double baseline_m = std::abs(static_cast<double>(numberAt<float>(list, kBaselineOffset))) / 1000;
  if (!(baseline_m >= 0.005 && baseline_m <= 0.5)) {
    return refuse(kWhere, fmt::format("has a baseline of {} m", baseline_m));
  }
  return baseline_m;
}

base::Result<Version> versionFrom(Bytes data) {
  constexpr std::size_t kField = 16;
  constexpr std::size_t kSerialOffset = 5 * kField;
  constexpr std::size_t kDeviceOffset = 6 * kField + 4;
  if (data.size() < kDeviceOffset + kField) {
    return refuse("Orbbec version", fmt::format("has only {} bytes", data.size()));
  }
  return Version{textAt(data, 0, kField), textAt(data, kSerialOffset, kField),
                 textAt(data, kDeviceOffset, kField)};
}

}  // namespace hapticd::drivers::orbbec
