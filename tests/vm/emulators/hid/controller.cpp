// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/hid/hid_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace hapticd::test::hid {
namespace {

using rt::Vec3;

// pid.codes' ids for tests; the same as the default of hid_handle.device.
constexpr std::uint16_t kVendor = 0x1209;
constexpr std::uint16_t kProduct = 0x0001;

// The descriptor in reports.md.
constexpr std::uint8_t kDescriptor[] = {0x06, 0xAB, 0xFF, 0x0A, 0x00, 0x02, 0xA1, 0x01, 0x75, 0x08,
                                        0x15, 0x00, 0x26, 0xFF, 0x00, 0x95, 0x40, 0x09, 0x01, 0x81,
                                        0x02, 0x95, 0x40, 0x09, 0x02, 0x91, 0x02, 0xC0};

constexpr double kTickS = 0.001;
constexpr double kMassKg = 0.1;
constexpr double kHandStiffnessNPerM = 400;
constexpr double kHandDampingNSPerM = 8;
constexpr double kStrongestForceN = 5;  // of the motors
constexpr int kButtons = 32;

Vec3 shortened(const Vec3& force_n) {
  const double size = norm(force_n);
  return size > kStrongestForceN ? (kStrongestForceN / size) * force_n : force_n;
}

}  // namespace

Controller::Controller(const std::string& serial)
    : identity_{"hapticd test controller",
                serial,
                kVendor,
                kProduct,
                {std::begin(kDescriptor), std::end(kDescriptor)}} {}

bool Controller::isSilent(std::int64_t now_ns) const {
  return output_ns_ == 0 || now_ns - output_ns_ > drivers::kControllerWatchdogNs;
}

std::optional<Bytes> Controller::tick(std::int64_t now_ns) {
  input_.watchdog_acted = isSilent(now_ns);
  const bool exerts = output_.exert && input_.calibrated && !input_.homing && input_.fault_code == 0;
  exerted_n_ = exerts && !input_.watchdog_acted ? shortened(output_.force_n) : Vec3{};
  moveHand();
  count(now_ns);
  ++input_.sequence;
  input_.time_us = static_cast<std::uint32_t>(now_ns / 1000);
  input_.echo = output_ns_ == 0 ? 0 : output_.sequence;
  input_.echo_age_us = static_cast<std::uint32_t>((now_ns - output_ns_) / 1000);
  const drivers::Report report = encode(input_);
  return Bytes(report.begin(), report.end());
}

/// Moves the hand by implicit Euler, which is stable for any force.
void Controller::moveHand() {
  const Vec3 displacement_m = target_m_ - aim_m_;
  aim_m_ += std::min(1.0, kTickS * kHandSpeedMPerS / std::max(norm(displacement_m), 1e-9)) * displacement_m;
  const Vec3 pull_n = kHandStiffnessNPerM * (aim_m_ - input_.position_m) + exerted_n_;
  const double inertia = kMassKg + kTickS * kHandDampingNSPerM + kTickS * kTickS * kHandStiffnessNPerM;
  velocity_m_per_s_ = (1 / inertia) * (kMassKg * velocity_m_per_s_ + kTickS * pull_n);
  input_.position_m += kTickS * velocity_m_per_s_;
}

void Controller::count(std::int64_t now_ns) {
  ++sent_;
  const double force_n = norm(exerted_n_);
  most_force_n_ = std::max(most_force_n_, force_n);
  if (force_n > 0) last_force_ns_ = now_ns;
}

void Controller::take(std::span<const std::uint8_t> report, std::int64_t now_ns) {
  const auto output = drivers::outputFrom(report);
  if (!output) {
    ++invalid_;
    return;
  }
  ++received_;
  const std::uint32_t step = output->sequence - output_.sequence;
  if (output->sequence > output_.sequence && output_ns_ != 0) lost_ += step - 1;  // else another sender
  output_ = *output;
  output_ns_ = now_ns;
}

std::string Controller::command(std::string_view line) {
  std::istringstream words{std::string(line)};
  std::string verb;
  words >> verb;
  unsigned number = 0;
  Vec3 aim;
  if (verb == "aim" && words >> aim.x >> aim.y >> aim.z && norm(aim) < drivers::kMaxPositionM) {
    target_m_ = aim;
  } else if (verb == "button" && words >> number && number < kButtons) {
    input_.buttons ^= 1U << number;
  } else if (verb == "fault" && words >> number && number <= 0xFFFF) {
    input_.fault_code = static_cast<std::uint16_t>(number);
  } else if (verb == "home") {
    input_.homing = !input_.homing;
  } else if (verb == "reset") {
    input_.sequence = 0;
    output_ns_ = 0;
  } else {
    return "error: allowed: aim X Y Z, button N, fault N, home, reset";
  }
  return "ok";
}

std::string Controller::stats(std::int64_t now_ns) const {
  return fmt::format(
      R"("sent":{},"received":{},"invalid":{},"lost":{},"force_n":{:.4f},"most_force_n":{:.4f},)"
      R"("last_force_ns":{},"watchdog":{},"position_m":[{:.5f},{:.5f},{:.5f}])",
      sent_, received_, invalid_, lost_, norm(exerted_n_), most_force_n_, last_force_ns_, isSilent(now_ns),
      input_.position_m.x, input_.position_m.y, input_.position_m.z);
}

}  // namespace hapticd::test::hid
