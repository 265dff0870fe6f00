// SPDX-License-Identifier: Apache-2.0
// Reports of controllers and SpaceMouse devices: any bytes are accepted or rejected, and accepted values are
// in range.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/handle/hid/hid_controller.h"
#include "drivers/handle/hid/hid_spacemouse.h"
#include "tests/fuzz/seeds.h"

namespace {

using hapticd::drivers::HidController;
using hapticd::drivers::HidSpaceMouse;
using hapticd::drivers::InputReport;
using hapticd::drivers::kReportBytes;
using hapticd::drivers::OutputReport;
using hapticd::drivers::Report;

constexpr double kFarthestM = 4;  // the corner of the cube of +-2 m

/// Returns the bytes as a report with a correct checksum, so that its fields are reached.
Report sealed(std::span<const std::uint8_t> bytes) {
  Report report{};
  for (std::size_t i = 0; i < bytes.size() && i < kReportBytes; ++i) report[i] = bytes[i];
  report[0] = 0x48;
  report[1] = 0x69;
  report[2] = 1;
  const std::uint32_t crc = hapticd::drivers::crc32(std::span<const std::uint8_t>(report).first(60));
  for (std::size_t i = 0; i < 4; ++i) report[60 + i] = static_cast<std::uint8_t>(crc >> (8 * i));
  return report;
}

template <typename Value>
std::string encoded(const Value& value) {
  const Report report = hapticd::drivers::encode(value);
  return {report.begin(), report.end()};
}

InputReport inputOf(std::uint32_t sequence, std::uint32_t time_us) {
  InputReport input;
  input.sequence = sequence;
  input.time_us = time_us;
  input.position_m = {0.01 * sequence, -0.02, 0.03};
  input.buttons = 5;
  return input;
}

/// A sequence of reports, of which each has the number and the clock of the device that stand here.
std::string session(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& numbers_and_times_us) {
  std::string reports;
  for (const auto& [sequence, time_us] : numbers_and_times_us) reports += encoded(inputOf(sequence, time_us));
  return reports;
}

/// Reports of a SpaceMouse; all but the last in the place of 64 bytes, in which the target looks for the
/// next.
std::string spaceMouse(const std::vector<std::vector<std::uint8_t>>& reports) {
  std::string bytes;
  for (const auto& report : reports) {
    bytes.resize((bytes.size() + kReportBytes - 1) / kReportBytes * kReportBytes);
    bytes.append(report.begin(), report.end());
  }
  return bytes;
}

std::vector<std::string> controllerSeeds() {
  std::vector<std::string> all{
      session({{1, 1'000}, {2, 2'000}, {3, 3'000}, {4, 4'000}}),
      session({{5, 1'000}, {5, 1'000}, {4, 500}, {9, 5'000}, {9'000, 6'000}, {1, 0}}),  // again, late, lost,
                                                                                        // reset
      session({{1, 4'000}, {2, 5'000}, {3, 6'000}, {4, 1'000}, {5, 1'001}}),            // its clock goes back
      session({{0xFFFFFFFF, 0xFFFFFF00}, {0, 100}, {1, 1'000}}),                        // both wrap around
      session({{1, 1'000}, {2, 1'000}, {3, 4'000'000'000}}),
      encoded(OutputReport{true, 1, {1, -2, 3}}),
      encoded(OutputReport{false, 1, {}}),
      encoded(OutputReport{true, 0, {100, -100, 100}}),
  };
  InputReport input = inputOf(1, 1'000);
  input.velocity_m_per_s = hapticd::rt::Vec3{0.1, -20, 20};
  input.position_m = {2, -2, 2};
  all.push_back(encoded(input));
  input.homing = true;
  all.push_back(encoded(input));
  input = inputOf(1, 1'000);
  input.calibrated = false;
  all.push_back(encoded(input) + encoded(inputOf(2, 2'000)));
  input.watchdog_acted = true;
  input.fault_code = 3;
  all.push_back(encoded(inputOf(1, 1'000)) + encoded(input) + encoded(inputOf(2, 2'000)));
  std::string echoes = encoded(inputOf(1, 1'000));
  for (std::uint32_t sequence = 2; sequence < 7; ++sequence) {
    input = inputOf(sequence, 1'000 * sequence);
    input.echo = sequence - 1;
    input.echo_age_us = sequence == 6 ? std::numeric_limits<std::uint32_t>::max() : 300;
    echoes += encoded(input);
  }
  all.push_back(echoes);
  std::string contradictions;  // a velocity that the positions do not show
  for (std::uint32_t sequence = 1; sequence <= 60; ++sequence) {
    input = inputOf(sequence, 1'000 * sequence);
    input.position_m.x = 0.001 * sequence;
    input.velocity_m_per_s = hapticd::rt::Vec3{-5, 0, 0};
    contradictions += encoded(input);
  }
  all.push_back(contradictions);
  for (const std::size_t place : {3U, 12U, 24U, 50U}) {  // flags, position, velocity, what is reserved
    std::string report = encoded(inputOf(1, 1'000));
    report.replace(place, 4, "\xFF\xFF\xFF\x7F");
    all.push_back(report);
  }
  all.push_back(std::string(encoded(inputOf(1, 1'000)), 0, 40));
  return all;
}

std::vector<std::string> spaceMouseSeeds() {
  return {
      spaceMouse({{1, 94, 1, 0, 0, 0xA2, 0xFE}, {2, 0, 0, 10, 0, 0, 0}, {3, 1, 0}}),
      spaceMouse({{1, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0}, {3, 0xFF, 0xFF, 0xFF, 0xFF, 1, 0}}),
      spaceMouse({{1, 0xE8, 3, 0x18, 0xFC, 0, 0}}),  // +-1000, the most that is possible
      spaceMouse({{1, 0xE9, 3, 0, 0, 0, 0}}),        // more
      spaceMouse({{1, 0, 0, 0, 0, 0, 0, 0xFF, 0x7F, 0, 0, 0, 0}}),
      spaceMouse({{2, 0, 0, 0, 0x80, 0, 0}}),
      spaceMouse({{2, 0, 0, 0}}),
      spaceMouse({{3}}),
      spaceMouse({{3, 1, 2, 3, 4, 5, 6}}),
      spaceMouse({{3, 1, 2, 3, 4, 5, 6, 7}}),
      spaceMouse({{0x17, 50, 0}}),  // the state of its battery
  };
}

}  // namespace

std::vector<std::string> seeds() {
  std::vector<std::string> all = controllerSeeds();
  for (std::string& seed : spaceMouseSeeds()) all.push_back(std::move(seed));
  return all;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  HidController controller({}, {});
  HidSpaceMouse spacemouse({}, {});
  std::int64_t now_ns = 1'000'000'000;
  controller.opened(now_ns);
  spacemouse.opened(now_ns);
  static_cast<void>(controller.take(bytes, now_ns));
  static_cast<void>(hapticd::drivers::outputFrom(bytes));
  for (std::size_t begin = 0; begin < size; begin += kReportBytes) {
    const auto part = bytes.subspan(begin, std::min(kReportBytes, size - begin));
    now_ns += 1'000'000;
    if (const auto state = controller.take(sealed(part), now_ns)) {
      require(norm(state->position_m_in_world) < kFarthestM && isFinite(state->velocity_m_per_s_in_world));
      require(state->time_ns <= now_ns && state->delay_s >= 0 && state->delay_s <= 0.1);
    }
    static_cast<void>(controller.answer({{1, 1, 1}, begin}, now_ns));
    spacemouse.take(part);
    require(norm(spacemouse.state(now_ns).position_m_in_world) < 1);
  }
  return 0;
}
