// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/force_dimension/open_dhd_device.h"

#include <fmt/format.h>

#include <array>
#include <string_view>

#include "rt/base/clock.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kCycleNs = 250'000;       // the fastest that the vendor states
constexpr std::int64_t kLookNs = 250'000'000;    // between two looks at the status
constexpr std::int64_t kRateNs = 1'000'000'000;  // over which readings are counted
constexpr double kLeastReadingsPerS = 1000;
constexpr unsigned char kWatchdogUnits = kDeadManNs / 1000 / Dhd::kWatchdogUnit_us;

/// Causes for which a device turns its force off, as it numbers them.
enum ForceOff { kNone = 0, kButton, kVelocity, kWatchdog, kSoftware, kUsb, kDeadManSwitch };

std::string_view wordsOf(int cause) {
  static constexpr std::array<std::string_view, 7> kWords{
      "for a reason that it does not name",
      "because its force button was pressed: press it again for forces",
      "because it was moved too fast",
      "because no force came for 20 ms",
      "because a program asked for it",
      "because USB was interrupted",
      "because its dead man's switch was released: hold it for forces"};
  return cause > 0 && cause < static_cast<int>(kWords.size()) ? kWords[static_cast<std::size_t>(cause)]
                                                              : kWords[0];
}

/// Whether only the person at the device may turn the force on again.
bool isUpToThePerson(int cause) {
  return cause == kButton || cause == kDeadManSwitch;
}

bool isInitialised(const DhdStatusArray& status) {
  const bool wrist = status[DhdStatus::has_wrist] == 0 || status[DhdStatus::wrist_initialised] != 0;
  return status[DhdStatus::runs] != 0 && status[DhdStatus::resetting] == 0 && wrist;
}

}  // namespace

OpenDhdDevice::OpenDhdDevice(const Dhd& dhd, char id, DeviceSession& session)
    : dhd_(dhd), id_(id), session_(session) {
  has_ = {.wrist = dhd_.has_wrist(id_),
          .active_wrist = dhd_.has_active_wrist(id_),
          .gripper = dhd_.has_gripper(id_),
          .active_gripper = dhd_.has_active_gripper(id_)};
  const char* name = dhd_.system_name(id_);
  about_.model = name == nullptr ? "device" : name;
  unsigned short serial = 0;
  if (dhd_.serial_number(&serial, id_) >= 0) about_.serial = fmt::format("{}", serial);
  about_.limits = limitsOfDhdType(dhd_.system_type(id_), has_);
}

OpenDhdDevice::~OpenDhdDevice() {
  (void)exert({});
  dhd_.stop(id_);
  dhd_.close(id_);
}

base::Error OpenDhdDevice::lost(const std::string& what) const {
  return {about_.model, what, ""};
}

base::Result<DhdStatusArray> OpenDhdDevice::status() const {
  DhdStatusArray status;
  if (dhd_.status(status.values.data(), id_) < 0)
    return std::unexpected(lost("lost: no status: " + dhd_.lastError()));
  if (status[DhdStatus::connected] == 0) return std::unexpected(lost("lost: it is not connected any more"));
  return status;
}

std::string OpenDhdDevice::whatItNeeds(const DhdStatusArray& status) const {
  if (status[DhdStatus::powered] == 0) return "has no power: switch it on";
  if (status[DhdStatus::error] != 0) return "reports an error: switch it off and on again";
  return "does not know its position: initialise it with the vendor's program, or move it to its rest "
         "position and press its reset button; until then it exerts no force";
}

base::Result<bool> OpenDhdDevice::awaitInitialised() {
  constexpr std::chrono::milliseconds kPause{5};
  for (bool waits = false; !session_.ends(); session_.pause(kPause)) {
    const auto now = status();
    if (!now) return std::unexpected(now.error());
    if (isInitialised(*now)) return true;
    if (!waits) session_.exchange().open({});
    waits = true;
    needs_.update(session_, 1, fmt::format("{} {}", about_.model, whatItNeeds(*now)));
    reading_ = {};
    reading_.calibrated = false;
    const std::int64_t began_ns = rt::monotonicNow_ns();
    if (dhd_.position(&reading_.position_m.x, &reading_.position_m.y, &reading_.position_m.z, id_) >= 0)
      session_.exchange().publish(reading_, began_ns);
  }
  return false;
}

base::Result<void> OpenDhdDevice::prepare() {
  const auto failed = [this](const char* what) {
    return std::unexpected(lost(fmt::format("{}: {}", what, dhd_.lastError())));
  };
  if (dhd_.enable_expert_mode() < 0) return failed("its watchdog cannot be reached");
  unsigned char units = 0;
  if (dhd_.set_watchdog(kWatchdogUnits, id_) < 0 || dhd_.watchdog(&units, id_) < 0)
    return failed("its watchdog, without which it would keep a force when this program dies, cannot be set");
  if (units != kWatchdogUnits)
    return std::unexpected(lost(fmt::format("its watchdog is at {:.2f} ms instead of {:.2f}: no force",
                                            units * 0.125, kWatchdogUnits * 0.125)));
  if (dhd_.set_max_force(about_.limits.force_n, id_) < 0) return failed("its force cannot be limited");
  if (dhd_.set_gravity_compensation(1, id_) < 0) return failed("no gravity compensation");
  if (auto ok = enableForce(); !ok) return ok;
  session_.opened(about_);
  return {};
}

base::Result<void> OpenDhdDevice::enableForce() {
  if (dhd_.set_brakes(0, id_) < 0 || dhd_.enable_force(1, id_) < 0)
    return std::unexpected(lost("its force cannot be turned on: " + dhd_.lastError()));
  return exert({});
}

base::Result<void> OpenDhdDevice::run() {
  const std::int64_t began_ns = rt::monotonicNow_ns();
  looked_ns_ = counted_since_ns_ = began_ns;
  reading_ = {};
  rt::PeriodicClock clock(kCycleNs);
  clock.start(began_ns);
  while (!session_.ends()) {
    rt::sleepUntil(clock.planned_ns());
    const auto measured = measure();
    if (!measured) return std::unexpected(measured.error());
    if (*measured) {
      if (auto ok = publish(); !ok) return ok;
    }
    const std::int64_t exerts_ns = rt::monotonicNow_ns();
    if (auto ok = exert(session_.exchange().commandAt(exerts_ns)); !ok) return ok;
    const std::int64_t now_ns = rt::monotonicNow_ns();
    reading_.latency_ns = now_ns - exerts_ns;
    if (now_ns - looked_ns_ >= kLookNs) {
      looked_ns_ = now_ns;
      if (auto ok = lookAfter(now_ns); !ok) return ok;
    }
    clock.advance(rt::monotonicNow_ns());
  }
  return {};
}

/// Returns whether there is a new measurement.
base::Result<bool> OpenDhdDevice::measure() {
  const std::int64_t began_ns = rt::monotonicNow_ns();
  rt::Vec3& at = reading_.position_m;
  std::array<double, 9> rotation{};
  const int got = has_.wrist
                      ? dhd_.pose(&at.x, &at.y, &at.z, reinterpret_cast<double(*)[3]>(rotation.data()), id_)
                      : dhd_.position(&at.x, &at.y, &at.z, id_);
  if (got < 0) return std::unexpected(lost("lost: no position: " + dhd_.lastError()));
  if (got == Dhd::kNothingNew) return false;
  measured_ns_ = began_ns;
  reading_.orientation.reset();
  if (has_.wrist) reading_.orientation = rt::quaternionOf(rotation);
  double angle_rad = 0;
  reading_.gripper_rad.reset();
  if (has_.gripper && dhd_.gripper_angle(&angle_rad, id_) >= 0) reading_.gripper_rad = angle_rad;
  reading_.buttons = dhd_.buttons(id_);
  reading_.fault = force_off_;
  return true;
}

base::Result<void> OpenDhdDevice::publish() {
  ++readings_;
  const ReadingVerdict verdict = session_.exchange().publish(reading_, measured_ns_);
  if (verdict == ReadingVerdict::jumped)
    return std::unexpected(lost("its position jumped farther than a hand can move it"));
  value_complaint_.update(session_, verdict == ReadingVerdict::not_finite,
                          about_.model + ": its position is no number; it exerts no force");
  return {};
}

base::Result<void> OpenDhdDevice::exert(const DeviceCommand& command) {
  const rt::Vec3& f = command.force_n;
  const rt::Vec3& t = command.torque_n_m;
  const int got = has_.active_gripper ? dhd_.set_wrench_and_gripper(f.x, f.y, f.z, t.x, t.y, t.z,
                                                                    command.gripper_force_n, id_)
                  : has_.active_wrist ? dhd_.set_wrench(f.x, f.y, f.z, t.x, t.y, t.z, id_)
                                      : dhd_.set_force(f.x, f.y, f.z, id_);
  if (got < 0) return std::unexpected(lost("lost: it takes no force: " + dhd_.lastError()));
  return {};
}

base::Result<void> OpenDhdDevice::lookAfter(std::int64_t now_ns) {
  const auto now = status();
  if (!now) return std::unexpected(now.error());
  if (!isInitialised(*now)) return std::unexpected(lost("it has lost its initialisation; no force"));
  lookAtRate(now_ns);
  return lookAtForce(*now, now_ns);
}

base::Result<void> OpenDhdDevice::lookAtForce(const DhdStatusArray& status, std::int64_t now_ns) {
  const bool off = status[DhdStatus::force_on] == 0;
  const int cause = status[DhdStatus::force_off_cause];
  force_complaint_.update(session_, off ? 1 + cause : 0,
                          fmt::format("{} has turned its force off {}", about_.model, wordsOf(cause)));
  if (off && !force_off_) force_off_ns_ = now_ns;
  force_off_ = off;
  constexpr std::int64_t kRestNs = 1'000'000'000;  // hapticd has heard of it and commands nothing
  if (!off || isUpToThePerson(cause) || now_ns - force_off_ns_ < kRestNs) return {};
  return enableForce();
}

void OpenDhdDevice::lookAtRate(std::int64_t now_ns) {
  const std::int64_t since_ns = now_ns - counted_since_ns_;
  if (since_ns < kRateNs) return;
  const double per_s = static_cast<double>(readings_) / (static_cast<double>(since_ns) * 1e-9);
  rate_complaint_.update(session_, per_s < kLeastReadingsPerS,
                         fmt::format("{} gives {:.0f} readings a second; {:.0f} are needed", about_.model,
                                     per_s, kLeastReadingsPerS));
  readings_ = 0;
  counted_since_ns_ = now_ns;
}

}  // namespace hapticd::tools
