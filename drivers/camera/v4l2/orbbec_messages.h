// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/camera/v4l2/little_endian.h"
#include "drivers/camera/v4l2/pinhole.h"

/// The messages of an Orbbec Gemini 330, as bytes. Layouts: OrbbecSDK_v2, src/device/protocol and
/// src/shared/InternalTypes.hpp. Not tested with a camera.
namespace hapticd::drivers::orbbec {

enum class Operation : std::uint16_t {
  get_property = 1,
  set_property = 2,
  get_structure = 3,
  begin_list = 29,
  read_list = 30,
  end_list = 31,
};

inline constexpr std::uint32_t kDepthUnitProperty = 176;       ///< float, in mm
inline constexpr std::uint32_t kLaserProperty = 182;           ///< 0 off, 1 on, 2 automatic
inline constexpr std::uint32_t kVersionStructure = 1000;       ///< firmware, serial number
inline constexpr std::uint32_t kDepthCalibrationList = 4026;   ///< baseline
inline constexpr std::uint32_t kCameraCalibrationList = 4027;  ///< intrinsics of the modes

/// Largest part of a list that one message carries.
inline constexpr std::uint32_t kListPartBytes = 768;

struct Request {
  Operation operation;
  std::uint16_t id = 0;  ///< repeated in the response
  std::uint32_t property = 0;
  std::vector<std::uint32_t> words{};  ///< a new value, or offset and size of a part of a list
};

/// Returns the request as the bytes of the smallest control that holds it, padded with zeros.
std::vector<std::byte> encoded(const Request& request);
/// Returns the size of the control in which the response arrives: 64, 512 or 1024 bytes.
std::size_t responseBytes(Operation operation);
/// Returns the selector of the control with this size.
std::uint8_t selectorOf(std::size_t control_bytes);

/// Returns the data of a response.
/// Errors: wrong size, magic, operation, id or length; an error code.
base::Result<std::vector<std::byte>> responseData(const Request& request, Bytes response);

/// Returns the value of a property, the first of the five numbers in the response.
base::Result<std::uint32_t> propertyFrom(Bytes data);

/// Returns the depth unit in metres.  Errors: not a number, or outside 1 um to 100 mm.
base::Result<double> depthUnit_mFrom(Bytes data);

struct ListSize {
  std::uint16_t version = 0;
  std::uint32_t bytes = 0;
};
/// Reads the response to Operation::begin_list.  Errors: too short, more than 64 KiB.
base::Result<ListSize> listSizeFrom(Bytes data);

/// Returns the intrinsics of a depth mode from the list of camera calibrations: of the same size, else scaled
/// from one with the same proportions.
/// Errors: no list, none that fits, implausible intrinsics.
base::Result<Pinhole> pinholeOfMode(Bytes list, FrameSize size);

/// Returns the baseline in metres from the list of depth calibrations.  Errors: too short, implausible.
base::Result<double> baseline_mFrom(Bytes list);

struct Version {
  std::string firmware;
  std::string serial;
  std::string device;
};
/// Errors: too short.
base::Result<Version> versionFrom(Bytes data);

}  // namespace hapticd::drivers::orbbec
