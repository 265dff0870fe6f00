// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <expected>
#include <optional>
#include <span>

#include "rt/base/vec3.h"

namespace hapticd::drivers {

/// The input and output reports of a controller as described in reports.md.
inline constexpr std::size_t kReportBytes = 64;
inline constexpr std::uint16_t kControllerUsagePage = 0xFFAB;
inline constexpr std::uint16_t kControllerUsage = 0x0200;
/// A controller switches its motors off when it has received no valid output report for this long.
inline constexpr std::int64_t kControllerWatchdogNs = 20'000'000;

/// Largest values that a report may contain, per axis.
inline constexpr double kMaxPositionM = 2;
inline constexpr double kMaxSpeedMPerS = 20;
inline constexpr double kMaxForceN = 100;

using Report = std::array<std::uint8_t, kReportBytes>;
using ReportBytes = std::span<const std::uint8_t>;

/// A measurement of a controller, in its own axes.
struct InputReport {
  bool calibrated = true;
  bool homing = false;
  bool watchdog_acted = false;  ///< the motors are off because output reports are missing
  /// 0: none; other codes are defined by the controller, whose motors are then off.
  std::uint16_t fault_code = 0;
  std::uint32_t sequence = 0;  ///< incremented with each report, wraps around
  std::uint32_t time_us = 0;   ///< of the measurement, by the controller's clock; wraps around
  rt::Vec3 position_m;
  std::optional<rt::Vec3> velocity_m_per_s = {};
  std::uint32_t buttons = 0;
  std::uint32_t echo = 0;         ///< sequence number of the last valid output report; 0: none
  std::uint32_t echo_age_us = 0;  ///< time from its arrival until this report was sent
};

/// A command to a controller.
struct OutputReport {
  bool exert = false;          ///< false: motors off
  std::uint32_t sequence = 0;  ///< incremented with each report, wraps around, never 0
  rt::Vec3 force_n;            ///< in the controller's axes
};

/// Reasons to reject a report.
enum class ReportRefusal { size, magic, version, checksum, reserved, range };

/// Returns a short description for people.
const char* textOf(ReportRefusal refusal);

/// Computes the CRC-32 used by Ethernet, zlib and PNG.
std::uint32_t crc32(ReportBytes bytes);

/// Encodes a report. Numbers out of range are clamped; a force out of range keeps its direction; a value that
/// is not finite becomes zero.  RT: safe.
Report encode(const InputReport& input);
Report encode(const OutputReport& output);

/// Decodes and checks a report.  Errors: the first fault, in the order of the enumerators.  RT: safe.
std::expected<InputReport, ReportRefusal> inputFrom(ReportBytes bytes);
std::expected<OutputReport, ReportRefusal> outputFrom(ReportBytes bytes);

}  // namespace hapticd::drivers
