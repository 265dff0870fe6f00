// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/hid/hid_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

namespace hapticd::test::hid {
namespace {

constexpr std::uint16_t kVendor = 0x256F;
constexpr std::uint16_t kProduct = 0xC62E;
constexpr std::uint64_t kTicksPerReport = 16;  // 62.5 Hz
constexpr int kMaxDeflection = 350;

// Multi-axis controller: id 1 with six 16-bit axes, id 3 with two buttons in two bytes, id 4 with a LED.
constexpr std::uint8_t kDescriptor[] = {
    0x05, 0x01, 0x09, 0x08, 0xA1, 0x01,                                      // generic desktop, multi-axis
    0xA1, 0x00, 0x85, 0x01, 0x16, 0xA2, 0xFE, 0x26, 0x5E, 0x01, 0x09, 0x30,  // id 1, -350..350, X
    0x09, 0x31, 0x09, 0x32, 0x09, 0x33, 0x09, 0x34, 0x09, 0x35, 0x75, 0x10,  // Y, Z, Rx, Ry, Rz
    0x95, 0x06, 0x81, 0x06, 0xC0,                                            // relative, as the old ones say
    0xA1, 0x02, 0x85, 0x03, 0x05, 0x09, 0x19, 0x01, 0x29, 0x02, 0x15, 0x00,  // id 3, buttons 1 and 2
    0x25, 0x01, 0x75, 0x01, 0x95, 0x02, 0x81, 0x02, 0x95, 0x0E, 0x81, 0x03,  //
    0xC0,                                                                    //
    0xA1, 0x02, 0x85, 0x04, 0x05, 0x08, 0x09, 0x4B, 0x15, 0x00, 0x25, 0x01,  // id 4, LED
    0x75, 0x01, 0x95, 0x01, 0x91, 0x02, 0x95, 0x07, 0x91, 0x03, 0xC0,        //
    0xC0};

/// The cap is never turned.
Bytes axesReport(const std::array<int, 3>& translation) {
  Bytes report{1};
  for (const int axis : translation) {
    const auto bits = static_cast<std::uint16_t>(axis);
    report.push_back(static_cast<std::uint8_t>(bits & 0xFF));
    report.push_back(static_cast<std::uint8_t>(bits >> 8));
  }
  report.resize(13);
  return report;
}

}  // namespace

SpaceMouse::SpaceMouse(const std::string& serial)
    : identity_{"3Dconnexion SpaceMouse Wireless",
                serial,
                kVendor,
                kProduct,
                {std::begin(kDescriptor), std::end(kDescriptor)}} {}

std::optional<Bytes> SpaceMouse::tick(std::int64_t /*now_ns*/) {
  const bool deflected = cap_ != std::array<int, 3>{};
  if (++ticks_ % kTicksPerReport == 0 && (deflected || was_deflected_)) {
    waiting_.push_back(axesReport(cap_));
    was_deflected_ = deflected;
  }
  if (waiting_.empty()) return std::nullopt;
  Bytes report = std::move(waiting_.front());
  waiting_.pop_front();
  ++sent_;
  return report;
}

void SpaceMouse::take(std::span<const std::uint8_t> /*report*/, std::int64_t /*now_ns*/) {}

std::string SpaceMouse::command(std::string_view line) {
  std::istringstream words{std::string(line)};
  std::string verb;
  words >> verb;
  std::array<int, 3> cap{};
  unsigned number = 0;
  const auto is_possible = [](int axis) { return std::abs(axis) <= kMaxDeflection; };
  if (verb == "push" && words >> cap[0] >> cap[1] >> cap[2] && std::ranges::all_of(cap, is_possible)) {
    cap_ = cap;
  } else if (verb == "button" && words >> number && number < 2) {
    buttons_ = static_cast<std::uint8_t>(buttons_ ^ (1U << number));
    waiting_.push_back({3, buttons_, 0});
  } else {
    return "error: allowed: push X Y Z, button N";
  }
  return "ok";
}

std::string SpaceMouse::stats(std::int64_t /*now_ns*/) const {
  return fmt::format(R"("sent":{})", sent_);
}

}  // namespace hapticd::test::hid
