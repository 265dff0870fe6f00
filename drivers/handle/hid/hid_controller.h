// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <expected>
#include <optional>
#include <span>
#include <string>

#include "drivers/handle/command_gate.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_frame.h"
#include "rt/base/latency_histogram.h"
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

/// Converts a device's timestamps to this computer's clock. Reports arrive late when this computer is busy,
/// so arrival times are unsuitable. The report with the smallest latency determines the difference of the
/// clocks; the difference may grow by 0.1 %, more than two crystals differ, to follow their drift.
/// Thread: one.  RT: safe.
class DeviceClock {
 public:
  /// Longest plausible delay of a report; a larger deviation is a fault of the device's clock.
  static constexpr std::int64_t kMaxDelayNs = 50'000'000;

  void reset() { last_us_.reset(); }

  /// Returns the time of a measurement, at most `arrival_ns`. `device_us` wraps around.
  std::int64_t timeOf(std::uint32_t device_us, std::int64_t arrival_ns) {
    if (last_us_) {
      const std::int64_t step_ns = std::int64_t{1000} * static_cast<std::int32_t>(device_us - *last_us_);
      device_ns_ += step_ns;
      difference_ns_ += std::max<std::int64_t>(0, step_ns) / 1000;
    }
    const std::int64_t difference_ns = arrival_ns - device_ns_;
    if (!last_us_ || difference_ns - difference_ns_ > kMaxDelayNs) difference_ns_ = difference_ns;
    last_us_ = device_us;
    difference_ns_ = std::min(difference_ns_, difference_ns);
    return device_ns_ + difference_ns_;
  }

 private:
  std::optional<std::uint32_t> last_us_;  // nothing before the first report
  std::int64_t device_ns_ = 0;            // device time without wrapping
  std::int64_t difference_ns_ = 0;        // difference to this computer's clock
};

/// The protocol logic of a controller (reports.md): validates its reports and decides on the replies, without
/// waiting, reading or writing. Times are CLOCK_MONOTONIC of this computer. A session begins with the first
/// report after opened(), after a silence or a fault, and when the sequence number indicates a reset.
/// Thread: one, unless stated otherwise.
class HidController {
 public:
  /// Without a valid report for this long, the device is lost.
  static constexpr std::int64_t kSilenceNs = 200'000'000;

  HidController(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale)
      : frame_(settings, scale) {}

  /// Called when the device has been opened.
  void opened(std::int64_t now_ns);

  /// Processes an input report; returns the state to publish, if there is one.
  std::optional<rt::HandleState> take(ReportBytes report, std::int64_t arrival_ns);

  /// Called when time has passed without a report.
  void idle(std::int64_t now_ns);

  /// Returns the output report for the newest command; its force is zero if the command may not be exerted.
  Report answer(const rt::HandleCommand& command, std::int64_t now_ns);
  /// Called when the device has accepted the output report.
  void answered(std::int64_t now_ns) { gate_.sent(now_ns); }

  /// Returns the output report that switches the motors off.
  Report farewell(std::int64_t now_ns);

  HandlePresence presence() const { return presence_; }
  const std::string& detail() const { return detail_; }
  std::uint64_t measurements() const { return measurements_; }
  std::uint64_t rejected() const { return link_.rejected; }
  LinkStatus link() const;
  /// Returns the distribution of the command latency.  Thread: any.
  std::optional<rt::LatencySummary> lastHop() const { return gate_.lastHop(); }

 private:
  struct Sent {
    std::uint32_t sequence = 0;  // 0: none
    std::int64_t time_ns = 0;
  };
  static constexpr std::size_t kRemembered = 64;  // outputs on their way to the device and back
  // One input and one output interval; used until the round trip has been measured.
  static constexpr double kUnmeasuredDelayS = 0.002;

  bool isNext(std::uint32_t sequence);
  void beginSession(const InputReport& input);
  rt::HandleState publish(const InputReport& input, std::int64_t arrival_ns);
  void measureRoundTrip(const InputReport& input, std::int64_t arrival_ns);
  Report output(bool exert, const rt::Vec3& force_n, std::int64_t now_ns);
  void lose(std::string detail);

  HandleFrame frame_;
  DeviceClock clock_;
  HandlePresence presence_ = HandlePresence::absent;
  std::string detail_;
  std::uint64_t measurements_ = 0;
  LinkStatus link_;
  rt::LatencyHistogram round_trips_;

  bool in_session_ = false;
  std::int64_t last_valid_ns_ = 0;
  std::optional<ReportRefusal> last_refusal_;  // since the last valid report
  std::uint32_t last_input_ = 0;               // sequence number
  bool calibrated_ = false;

  std::uint32_t output_sequence_ = 0;
  std::array<Sent, kRemembered> sent_;
  std::uint32_t last_echo_ = 0;
  double delay_s_ = kUnmeasuredDelayS;

  CommandGate gate_;
};

}  // namespace hapticd::drivers
