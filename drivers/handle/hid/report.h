// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <expected>
#include <optional>
#include <span>

#include "rt/vec3.h"

namespace hapticd::drivers {

/// The pair of reports that reports.md describes: a controller's input and output.
inline constexpr std::size_t kReportBytes = 64;
inline constexpr std::uint16_t kControllerUsagePage = 0xFFAB;
inline constexpr std::uint16_t kControllerUsage = 0x0200;
/// The controller exerts nothing when it got no valid output report for that long.
inline constexpr std::int64_t kControllerWatchdogNs = 20'000'000;

/// Largest values that a report may carry, per axis.
inline constexpr double kMostPositionM = 2;
inline constexpr double kMostSpeedMPerS = 20;
inline constexpr double kMostForceN = 100;

using Report = std::array<std::uint8_t, kReportBytes>;
using ReportBytes = std::span<const std::uint8_t>;

/// What a controller measured, in its own axes.
struct InputReport {
  bool calibrated = true;
  bool homing = false;
  bool watchdog_acted = false;   ///< the motors are off for want of output reports
  std::uint16_t fault_code = 0;  ///< 0: none; others are the controller's own, its motors are off
  std::uint32_t sequence = 0;    ///< +1 with each, wraps
  std::uint32_t time_us = 0;     ///< of the measurement, by the controller's clock; wraps
  rt::Vec3 position_m;
  std::optional<rt::Vec3> velocity_m_per_s = {};
  std::uint32_t buttons = 0;
  std::uint32_t echo = 0;         ///< sequence number of the last valid output report; 0: none
  std::uint32_t echo_age_us = 0;  ///< from its arrival to the sending of this report
};

/// What a controller is to do.
struct OutputReport {
  bool exert = false;          ///< false: motors off
  std::uint32_t sequence = 0;  ///< +1 with each, wraps, never 0
  rt::Vec3 force_n;            ///< in the controller's axes
};

/// Why a report is refused.
enum class ReportRefusal { size, magic, version, checksum, reserved, range };

/// A few words for people.
const char* textOf(ReportRefusal refusal);

/// CRC-32 as Ethernet, zlib and PNG use it.
std::uint32_t crc32(ReportBytes bytes);

/// Numbers out of range are cut to it. A force beyond the range keeps its direction; what is not finite
/// becomes zero.  RT: safe.
Report encode(const InputReport& input);
Report encode(const OutputReport& output);

/// Errors: the first reason that holds, in the order of the enumerators.  RT: safe.
std::expected<InputReport, ReportRefusal> inputFrom(ReportBytes bytes);
std::expected<OutputReport, ReportRefusal> outputFrom(ReportBytes bytes);

}  // namespace hapticd::drivers
