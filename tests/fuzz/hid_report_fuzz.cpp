// SPDX-License-Identifier: Apache-2.0
// Reports of controllers and SpaceMouse devices: any bytes are accepted or rejected, and accepted values are
// in range.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "drivers/handle/hid/hid_controller.h"
#include "drivers/handle/hid/hid_spacemouse.h"
#include "drivers/handle/hid/report.h"

namespace {

using hapticd::drivers::HidController;
using hapticd::drivers::HidSpaceMouse;
using hapticd::drivers::kReportBytes;
using hapticd::drivers::Report;

constexpr double kFarthestM = 4;  // the corner of the cube of +-2 m

void require(bool condition) {
  if (!condition) std::abort();
}

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

}  // namespace

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
