// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/v4l2/little_endian.h"
#include "drivers/camera/v4l2/pinhole.h"

namespace hapticd::drivers::realsense {

/// The messages of a RealSense D400's hardware monitor, and the tables that it returns, as bytes. Layouts:
/// librealsense, src/hw-monitor.h, src/ds/ds-private.h and src/ds/d400/d400-private.h.
/// Size of the control through which requests and replies pass.
inline constexpr std::size_t kMonitorBytes = 1024;

enum class Command : std::uint32_t {
  device_data = 0x10,        ///< GVD: firmware and serial number
  calibration_table = 0x15,  ///< GETINTCAL; p1: id of the table
  set_advanced = 0x2B,       ///< p1: group
  get_advanced = 0x2C,       ///< p1: group; p2: 0 value, 1 least, 2 largest
  set_sync = 0x69,           ///< p1: role
  depth_modes = 0x7E,        ///< RECPARAMSGET: intrinsics of every depth mode
};

inline constexpr std::uint32_t kCoefficientsTable = 25;
inline constexpr std::uint32_t kDepthTableGroup = 9;

struct Request {
  Command command;
  std::array<std::uint32_t, 4> parameters{};
  std::vector<std::byte> data{};
};

/// Returns the request as kMonitorBytes bytes, padded with zeros.
std::vector<std::byte> encoded(const Request& request);

/// Returns the data of a reply.
/// Errors: a reply of another size, to another request, with an error code, or with an impossible length.
base::Result<std::vector<std::byte>> replyData(Command command, Bytes reply);

/// Returns the intrinsics of a depth mode from the reply to Command::depth_modes; nothing if it does not list
/// the mode.
/// Errors: no list of modes, implausible intrinsics.
base::Result<std::optional<Pinhole>> pinholeOfMode(Bytes modes, FrameSize size);

/// What table 25 says of a mode.
struct Coefficients {
  Pinhole pinhole;
  double baseline_m = 0;
};

/// Reads table 25 for a depth mode; modes that it does not list are scaled from 1920 x 1080, of which they
/// show a part.
/// Errors: wrong size, type or checksum, implausible intrinsics or baseline.
base::Result<Coefficients> coefficientsOf(Bytes table, FrameSize size);

/// Reads the baseline of table 25 alone, in metres.
base::Result<double> baselineOf(Bytes table);

/// The depth table: the unit of raw values, and the mode.
struct DepthTable {
  std::uint32_t unit_um = 0;
  std::int32_t clamp_min = 0;
  std::int32_t clamp_max = 0;
  std::int32_t disparity_mode = 0;
  std::int32_t disparity_shift = 0;
};
/// Errors: wrong size, a unit outside 1 um to 100 mm.
base::Result<DepthTable> depthTableFrom(Bytes data);
std::vector<std::byte> encoded(const DepthTable& table);

/// Firmware and serial number of the depth module.
struct DeviceData {
  std::string firmware;  ///< "5.15.1.0"
  std::string serial;    ///< 12 digits
};
/// Errors: too short.
base::Result<DeviceData> deviceDataFrom(Bytes data);

/// Returns the temperature of the depth processor in degrees Celsius from its control of 4 bytes; nothing if
/// the camera does not know it, as while it does not stream.
std::optional<double> temperatureFrom(Bytes control);

}  // namespace hapticd::drivers::realsense

namespace hapticd::drivers {

/// What a buffer of a metadata node in the format D4XX says of a frame, in microseconds. Layout: the kernel's
/// metafmt-d4xx.rst.
struct DepthMetadata {
  std::uint32_t optical_time_us = 0;  ///< from the start of the frame to mid-exposure
  std::uint32_t exposure_us = 0;      ///< duration
  std::uint32_t pipe_latency_us = 0;  ///< from the start of the frame to its data in the buffer for USB
};

/// Returns the metadata with a block "capture timing" of one buffer; nothing if it holds none or is damaged.
std::optional<DepthMetadata> depthMetadataFrom(Bytes buffer);

/// Returns the time from mid-exposure to the start of the transmission; nothing if the two times do not fit
/// together.
std::optional<std::int64_t> exposureAge_ns(const DepthMetadata& metadata);

}  // namespace hapticd::drivers
