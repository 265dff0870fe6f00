// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/hid_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <concepts>

#include "drivers/base/crc32.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using rt::Vec3;

constexpr std::uint16_t kInputMagic = 0x6948;   // "Hi"
constexpr std::uint16_t kOutputMagic = 0x6F48;  // "Ho"
constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kChecksumAt = kReportBytes - 4;

constexpr double kPositionUnitM = 1e-7;
constexpr double kSpeedUnitMPerS = 1e-6;
constexpr double kForceUnitN = 1e-4;

constexpr std::uint8_t kCalibrated = 1U << 0;
constexpr std::uint8_t kHoming = 1U << 1;
constexpr std::uint8_t kWatchdogActed = 1U << 2;
constexpr std::uint8_t kHasVelocity = 1U << 3;
constexpr std::uint8_t kInputFlags = kCalibrated | kHoming | kWatchdogActed | kHasVelocity;
constexpr std::uint8_t kExert = 1U << 0;

/// Offsets of the fields.
struct InputPlace {
  static constexpr std::size_t kFlags = 3, kSequence = 4, kTime = 8, kPosition = 12, kVelocity = 24,
                               kButtons = 36, kEcho = 40, kEchoAge = 44, kFaultCode = 48, kReserved = 50;
};
struct OutputPlace {
  static constexpr std::size_t kMode = 3, kSequence = 4, kForce = 8, kReserved = 20;
};

template <std::unsigned_integral T>
void put(Report& report, std::size_t at, T number) {
  for (std::size_t byte = 0; byte < sizeof number; ++byte) {
    report[at + byte] = static_cast<std::uint8_t>((number >> (8 * byte)) & 0xFF);
  }
}

template <std::unsigned_integral T>
T get(ReportBytes bytes, std::size_t at) {
  T number = 0;
  for (std::size_t byte = 0; byte < sizeof number; ++byte) {
    number = static_cast<T>(number | static_cast<T>(T{bytes[at + byte]} << (8 * byte)));
  }
  return number;
}

void putVector(Report& report, std::size_t at, const Vec3& v, double unit, double max) {
  for (const double value : {v.x, v.y, v.z}) {
    const double cut = std::isfinite(value) ? std::clamp(value, -max, max) : 0;
    put(report, at, static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(cut / unit))));
    at += 4;
  }
}

/// Returns nothing if a component is beyond `max`.
std::optional<Vec3> getVector(ReportBytes bytes, std::size_t at, double unit, double max) {
  const auto component = [&](std::size_t axis) {
    return unit * static_cast<std::int32_t>(get<std::uint32_t>(bytes, at + 4 * axis));
  };
  const Vec3 v{component(0), component(1), component(2)};
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return largest <= max + unit / 2 ? std::optional(v) : std::nullopt;
}

void seal(Report& report, std::uint16_t magic) {
  put(report, 0, magic);
  report[2] = kVersion;
  put(report, kChecksumAt, crc32(ReportBytes(report).first(kChecksumAt)));
}

std::optional<ReportRefusal> refusalOfSeal(ReportBytes bytes, std::uint16_t magic) {
  if (bytes.size() != kReportBytes) return ReportRefusal::size;
  if (get<std::uint16_t>(bytes, 0) != magic) return ReportRefusal::magic;
  if (bytes[2] != kVersion) return ReportRefusal::version;
  if (get<std::uint32_t>(bytes, kChecksumAt) != crc32(bytes.first(kChecksumAt))) {
    return ReportRefusal::checksum;
  }
  return std::nullopt;
}

bool isZeroFrom(ReportBytes bytes, std::size_t from) {
  return std::ranges::all_of(bytes.subspan(from, kChecksumAt - from), [](std::uint8_t b) { return b == 0; });
}

Vec3 withinForceRange(const Vec3& force_n) {
  if (!isFinite(force_n)) return {};
  const double largest = std::max({std::abs(force_n.x), std::abs(force_n.y), std::abs(force_n.z)});
  return largest > kMaxForceN ? (kMaxForceN / largest) * force_n : force_n;
}

}  // namespace

const char* textOf(ReportRefusal refusal) {
  switch (refusal) {
    case ReportRefusal::size:
      return "not 64 bytes long";
    case ReportRefusal::magic:
      return "not of this protocol";
    case ReportRefusal::version:
      return "of another version of the protocol";
    case ReportRefusal::checksum:
      return "with a wrong checksum";
    case ReportRefusal::reserved:
      return "with reserved bits set";
    case ReportRefusal::range:
      break;
  }
  return "with values out of range";
}

std::uint32_t crc32(ReportBytes bytes) {
  return crc32Of<0xEDB88320>(std::as_bytes(bytes));
}

Report encode(const InputReport& input) {
  using Place = InputPlace;
  Report report{};
  report[Place::kFlags] = static_cast<std::uint8_t>(
      (input.calibrated ? kCalibrated : 0) | (input.homing ? kHoming : 0) |
      (input.watchdog_acted ? kWatchdogActed : 0) | (input.velocity_m_per_s ? kHasVelocity : 0));
  put(report, Place::kSequence, input.sequence);
  put(report, Place::kTime, input.time_us);
  putVector(report, Place::kPosition, input.position_m, kPositionUnitM, kMaxPositionM);
  putVector(report, Place::kVelocity, input.velocity_m_per_s.value_or(Vec3{}), kSpeedUnitMPerS,
            kMaxSpeedMPerS);
  put(report, Place::kButtons, input.buttons);
  put(report, Place::kEcho, input.echo);
  put(report, Place::kEchoAge, input.echo_age_us);
  put(report, Place::kFaultCode, input.fault_code);
  seal(report, kInputMagic);
  return report;
}

Report encode(const OutputReport& output) {
  Report report{};
  report[OutputPlace::kMode] = output.exert ? kExert : 0;
  put(report, OutputPlace::kSequence, output.sequence);
  putVector(report, OutputPlace::kForce, withinForceRange(output.force_n), kForceUnitN, kMaxForceN);
  seal(report, kOutputMagic);
  return report;
}

std::expected<InputReport, ReportRefusal> inputFrom(ReportBytes bytes) {
  using Place = InputPlace;
  if (const auto refusal = refusalOfSeal(bytes, kInputMagic)) return std::unexpected(*refusal);
  const std::uint8_t flags = bytes[Place::kFlags];
  if ((flags & ~kInputFlags) != 0 || !isZeroFrom(bytes, Place::kReserved)) {
    return std::unexpected(ReportRefusal::reserved);
  }
  const auto position = getVector(bytes, Place::kPosition, kPositionUnitM, kMaxPositionM);
  const auto velocity = getVector(bytes, Place::kVelocity, kSpeedUnitMPerS, kMaxSpeedMPerS);
  if (!position || !velocity) return std::unexpected(ReportRefusal::range);

  InputReport input;
  input.calibrated = (flags & kCalibrated) != 0;
  input.homing = (flags & kHoming) != 0;
  input.watchdog_acted = (flags & kWatchdogActed) != 0;
  input.fault_code = get<std::uint16_t>(bytes, Place::kFaultCode);
  input.sequence = get<std::uint32_t>(bytes, Place::kSequence);
  input.time_us = get<std::uint32_t>(bytes, Place::kTime);
  input.position_m = *position;
  if ((flags & kHasVelocity) != 0) input.velocity_m_per_s = *velocity;
  input.buttons = get<std::uint32_t>(bytes, Place::kButtons);
  input.echo = get<std::uint32_t>(bytes, Place::kEcho);
  input.echo_age_us = get<std::uint32_t>(bytes, Place::kEchoAge);
  return input;
}

std::expected<OutputReport, ReportRefusal> outputFrom(ReportBytes bytes) {
  if (const auto refusal = refusalOfSeal(bytes, kOutputMagic)) return std::unexpected(*refusal);
  const std::uint8_t mode = bytes[OutputPlace::kMode];
  if ((mode & ~kExert) != 0 || !isZeroFrom(bytes, OutputPlace::kReserved)) {
    return std::unexpected(ReportRefusal::reserved);
  }
  const auto force = getVector(bytes, OutputPlace::kForce, kForceUnitN, kMaxForceN);
  const auto sequence = get<std::uint32_t>(bytes, OutputPlace::kSequence);
  if (!force || sequence == 0) return std::unexpected(ReportRefusal::range);
  return OutputReport{mode == kExert, sequence, *force};
}

namespace {

/// A sequence number farther ahead than this, or farther behind than the kernel's queue of 64 reports, starts
/// a new count.
constexpr std::int32_t kFarthestAhead = 1000;
constexpr std::int32_t kFarthestBehind = 64;

constexpr double kMaxDelayS = 0.1;
constexpr double kDelaySmoothing = 1.0 / 32;

constexpr const char* kWaiting = "opened, but it has not sent a valid report yet";

}  // namespace

void HidController::opened(std::int64_t now_ns) {
  in_session_ = false;
  last_valid_ns_ = now_ns;
  last_refusal_.reset();
  if (presence_ != HandlePresence::absent) presence_ = HandlePresence::lost;
  detail_ = kWaiting;
}

void HidController::lose(std::string detail) {
  in_session_ = false;
  if (presence_ != HandlePresence::absent) presence_ = HandlePresence::lost;
  detail_ = std::move(detail);
}

std::optional<rt::HandleState> HidController::take(ReportBytes report, std::int64_t arrival_ns) {
  const auto input = inputFrom(report);
  if (!input) {
    ++link_.rejected;
    last_refusal_ = input.error();
    idle(arrival_ns);
    return std::nullopt;
  }
  if (in_session_ && !isNext(input->sequence)) return std::nullopt;
  ++link_.received;
  last_valid_ns_ = arrival_ns;
  last_refusal_.reset();
  if (input->fault_code != 0) {
    presence_ = HandlePresence::lost;
    lose(fmt::format("it reports the fault {} (see its own manual)", input->fault_code));
    return std::nullopt;
  }
  if (!in_session_) beginSession(*input);
  measureRoundTrip(*input, arrival_ns);
  return publish(*input, arrival_ns);
}

void HidController::idle(std::int64_t now_ns) {
  if (now_ns - last_valid_ns_ <= kSilenceNs) return;
  if (last_refusal_) {
    lose(
        fmt::format("its reports are rejected: they are {} (load firmware that sends those of "
                    "hid-reports.md, /usr/share/doc/hapticd)",
                    textOf(*last_refusal_)));
  } else if (in_session_) {
    lose("it is connected but sends no reports (reset it, or unplug it and plug it in again)");
  }
}

/// Checks the sequence number of a report within a session; returns false if the report is to be ignored.
bool HidController::isNext(std::uint32_t sequence) {
  const auto step = static_cast<std::int32_t>(sequence - last_input_);
  if (step == 0) {
    ++link_.duplicated;
    return false;
  }
  if (step < 0 && step >= -kFarthestBehind) {
    ++link_.reordered;
    return false;
  }
  if (step < 0 || step > kFarthestAhead) {
    in_session_ = false;  // the device was reset
    return true;
  }
  link_.lost += static_cast<std::uint64_t>(step - 1);
  return true;
}

void HidController::beginSession(const InputReport& input) {
  in_session_ = true;
  frame_.beginSession();
  clock_.reset();
  last_echo_ = input.echo;
  delay_s_ = kUnmeasuredDelayS;
}

rt::HandleState HidController::publish(const InputReport& input, std::int64_t arrival_ns) {
  last_input_ = input.sequence;
  calibrated_ = input.calibrated && !input.homing;
  presence_ = calibrated_ ? HandlePresence::present : HandlePresence::calibrating;
  detail_ = calibrated_ ? ""
            : input.homing
                ? "it is homing (do not touch it until it has finished)"
                : "its position is not known yet (move it to its reference position, see its manual)";
  ++measurements_;
  HandleMeasurement measurement;
  measurement.position_m_in_handle = input.position_m;
  measurement.time_ns = clock_.timeOf(input.time_us, arrival_ns);
  measurement.buttons = input.buttons;
  measurement.calibrated = calibrated_;
  measurement.velocity_m_per_s_in_handle = input.velocity_m_per_s;
  measurement.delay_s = delay_s_;
  measurement.command_latency_ns = gate_.latency_ns();
  return frame_.stateOf(measurement);
}

/// Measures the time from writing an output to reading its echo, minus the time that it spent in the device.
/// This round trip is also the delay between a motion and the force that responds to it.
void HidController::measureRoundTrip(const InputReport& input, std::int64_t arrival_ns) {
  if (input.echo == last_echo_) return;
  last_echo_ = input.echo;
  const Sent& sent = sent_[input.echo % kRemembered];
  const std::int64_t round_trip_ns = arrival_ns - sent.time_ns - std::int64_t{1000} * input.echo_age_us;
  if (input.echo == 0 || sent.sequence != input.echo || round_trip_ns < 0) return;
  round_trips_.add(round_trip_ns);
  const double seconds = static_cast<double>(round_trip_ns) / static_cast<double>(rt::kNsPerSecond);
  delay_s_ += kDelaySmoothing * (std::min(seconds, kMaxDelayS) - delay_s_);
}

Report HidController::answer(const rt::HandleCommand& command, std::int64_t now_ns) {
  const auto force_n_in_world = gate_.pass(command, frame_.session(), now_ns);
  const bool exert = force_n_in_world && in_session_ && calibrated_;
  return output(exert, exert ? frame_.forceInHandle(*force_n_in_world) : rt::Vec3{}, now_ns);
}

Report HidController::farewell(std::int64_t now_ns) {
  return output(false, {}, now_ns);
}

Report HidController::output(bool exert, const rt::Vec3& force_n, std::int64_t now_ns) {
  if (++output_sequence_ == 0) ++output_sequence_;
  sent_[output_sequence_ % kRemembered] = {output_sequence_, now_ns};
  ++link_.sent;
  return encode(OutputReport{exert, output_sequence_, force_n});
}

LinkStatus HidController::link() const {
  LinkStatus link = link_;
  link.round_trip = rt::summaryOf(round_trips_);
  return link;
}

}  // namespace hapticd::drivers
