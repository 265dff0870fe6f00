// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/report.h"

#include <algorithm>
#include <cmath>
#include <concepts>

#include "drivers/base/crc32.h"

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

}  // namespace hapticd::drivers
