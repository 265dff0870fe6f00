// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "rt/base/clock.h"
#include "tools/haptic-bridge/base/device_rows.h"
#include "tools/haptic-bridge/phantom_omni/arm.h"
#include "tools/haptic-bridge/phantom_omni/calibration.h"
#include "tools/haptic-bridge/phantom_omni/link.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools::phantom_omni {
namespace {

constexpr double kMostForce_n = 3.3;
constexpr const char* kModel = "Phantom Omni";
constexpr const char* kCalibrate = "'haptic-bridge calibrate phantom-omni' measures them";

/// A device whose link is open. Thread: one.
class DrivenOmni {
 public:
  /// `n_m_per_count`: nothing: it exerts no force.
  DrivenOmni(OmniLink& link, DeviceSession& session, std::optional<PerJoint<double>> n_m_per_count)
      : link_(link), session_(session), n_m_per_count_(n_m_per_count) {}

  /// Reads and exerts until the session ends.  Errors: the device is lost.
  base::Result<void> run() {
    session_.exchange().open({});  // it is there, and not calibrated
    looked_ns_ = rt::monotonicNow_ns();
    while (!session_.ends()) {
      const auto received = link_.receive();
      if (!received) return std::unexpected(received.error());
      if (*received) {
        if (auto ok = publish(**received); !ok) return ok;
      }
      if (auto ok = link_.send(command()); !ok) return ok;
      look(rt::monotonicNow_ns());
    }
    return {};
  }

 private:
  base::Result<void> publish(const TimedReading& received) {
    angles_rad_ = homing_.anglesAt(received.reading, received.measured_ns);
    needs_dock_.update(
        session_, !angles_rad_,
        fmt::format("{} does not know its position, and exerts no force until it does: put the stylus into "
                    "the inkwell, and wait",
                    kModel));
    if (angles_rad_ && !session_.wasOpened())
      session_.opened({.model = kModel,
                       .serial = link_.serial(),
                       .limits = {.force_n = n_m_per_count_ ? kMostForce_n : 0}});
    // No orientation: the sources contradict each other in the scale of one joint of the gimbal.
    DeviceReading reading;
    reading.position_m = wristAt(angles_rad_.value_or(kDockedAngles_rad));
    reading.buttons = received.reading.buttons;
    reading.calibrated = angles_rad_.has_value();
    reading.latency_ns = OmniLink::kSendDelay_ns;
    if (session_.exchange().publish(reading, received.measured_ns) == ReadingVerdict::jumped) {
      return std::unexpected(base::Error{kModel, "its position jumped farther than a hand can move it", ""});
    }
    return {};
  }

  OmniCommand command() {
    const DeviceCommand wanted = session_.exchange().commandAt(rt::monotonicNow_ns());
    OmniCommand command;
    if (angles_rad_ && n_m_per_count_ && link_.silence_ns() < kDeadManNs)
      command = commandFor(*angles_rad_, *n_m_per_count_, wanted.force_n);
    command.light = angles_rad_ ? DockLight::steady : DockLight::fast_flash;
    return command;
  }

  void look(std::int64_t now_ns) {
    constexpr std::int64_t kLook_ns = 1'000'000'000;
    constexpr double kMostLost = 0.01;
    silent_.update(session_, link_.silence_ns() >= kDeadManNs,
                   fmt::format("{} sends nothing; it exerts no force", kModel));
    if (now_ns - looked_ns_ < kLook_ns) return;
    foreign_complaint_.update(session_, link_.foreign() != foreign_,
                              fmt::format("{} sends packets of another kind of device", kModel));
    const auto lost = static_cast<double>(link_.lost() - lost_);
    const auto received = static_cast<double>(link_.received() - received_);
    loss_.update(session_, lost > kMostLost * (lost + received),
                 fmt::format("{:.0f} of {:.0f} packets of the {} were lost in a second", lost,
                             lost + received, kModel));
    foreign_ = link_.foreign();
    lost_ = link_.lost();
    received_ = link_.received();
    looked_ns_ = now_ns;
  }

  OmniLink& link_;
  DeviceSession& session_;
  std::optional<PerJoint<double>> n_m_per_count_;
  Homing homing_;
  std::optional<JointAngles> angles_rad_;
  std::int64_t looked_ns_ = 0;
  std::uint64_t foreign_ = 0;  // packets at that look
  std::uint64_t lost_ = 0;
  std::uint64_t received_ = 0;
  Complaint needs_dock_;
  Complaint silent_;
  Complaint foreign_complaint_;
  Complaint loss_;
};

/// Drives the Phantom Omni with FireWire by its packets. It exerts forces once the calibration of this very
/// device is stored, and only if that says that the device lets go without packets.
class PhantomOmniDriver final : public DeviceDriver {
 public:
  /// `serial`: of the device; empty: the first one. `calibration_file`: empty: where it is kept.
  PhantomOmniDriver(std::string serial, std::string calibration_file)
      : serial_(std::move(serial)), calibration_file_(std::move(calibration_file)) {}

  base::Result<void> drive(DeviceSession& session) override {
    const auto link = OmniLink::open(serial_);
    if (!link) return std::unexpected(link.error());
    return DrivenOmni(**link, session, gains(session, (*link)->serial())).run();
  }

 private:
  std::optional<PerJoint<double>> gains(DeviceSession& session, const std::string& serial) {
    enum State { kNothing = 0, kUncalibrated, kUnusable, kKeepsTorque };
    const auto none = [&](State state, const std::string& why) {
      no_force_.update(session, state, fmt::format("{} {}: forces uncalibrated: {}", kModel, serial, why));
      return std::nullopt;
    };
    const auto file = calibrationFile(calibration_file_, serial);
    if (!file) return none(kUnusable, file.error().text());
    const auto calibration = readCalibration(*file, serial);
    if (!calibration) return none(kUnusable, calibration.error().text());
    if (!*calibration)
      return none(kUncalibrated,
                  fmt::format("no file {}; {}; until then it exerts none", file->string(), kCalibrate));
    if (!(*calibration)->releases_without_packets)
      return none(kKeepsTorque,
                  "it keeps its torque when packets stop, and nothing could end the force of a program "
                  "that was killed: it exerts none");
    no_force_.update(session, kNothing, {});
    return (*calibration)->n_m_per_count;
  }

  std::string serial_;
  std::string calibration_file_;
  Complaint no_force_;
};

}  // namespace

std::unique_ptr<DeviceDriver> makePhantomOmniDriver(const VendorOptions& options) {
  return std::make_unique<PhantomOmniDriver>(options.device, options.calibration);
}

}  // namespace hapticd::tools::phantom_omni
