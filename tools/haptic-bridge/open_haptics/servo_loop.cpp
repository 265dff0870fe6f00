// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/open_haptics/servo_loop.h"

#include <cmath>

#include "rt/base/clock.h"

namespace hapticd::tools {
namespace {

constexpr double kMPerMm = 1e-3;
constexpr double kMNmPerNm = 1e3;
constexpr int kCleanFrames = 3;     // the first ones after the start give values of no measurement
constexpr int kStartFrames = 1000;  // in which frames may fail because the scheduler is not there yet
constexpr std::int64_t kWarmNs = 5'000'000'000;
constexpr std::int64_t kUpdateNs = 100'000'000;  // between two updates of the calibration
constexpr double kSmallN = 0.1;                  // a force that may begin anew without a jolt

rt::Quaternion orientationOf(const std::array<double, 16>& columns) {
  return rt::quaternionOf({columns[0], columns[4], columns[8],  //
                           columns[1], columns[5], columns[9],  //
                           columns[2], columns[6], columns[10]});
}

bool isFrameError(unsigned int error) {
  return error >= kHdFirstFrameError && error <= kHdLastFrameError;
}
bool isCut(unsigned int error) {
  return error >= kHdExceededForce && error <= kHdForceError;
}

}  // namespace

void ServoLoop::begin(const Hd& hd, HdHandle device, unsigned int calibration_style, bool drives_torque,
                      DeviceExchange& exchange) {
  hd_ = hd;
  device_ = device;
  style_ = calibration_style;
  drives_torque_ = drives_torque;
  exchange_ = &exchange;
  clean_frames_ = frames_since_start_ = 0;
  enabled_ = cut_ = false;
  small_since_ns_ = warm_until_ns_ = updated_ns_ = end_of_frame_ns_ = 0;
  force_allowed_ = calibrate_ = resting_ = rested_ = calibrated_ = force_on_ = false;
  jumped_ = not_finite_ = false;
  calibration_ = 0;
  lost_by_ = kHdSuccess;
  warm_ = 0;
  for (auto& cuts : cuts_) cuts = 0;
  frames_ = 0;
}

ServoReport ServoLoop::report() const {
  ServoReport report{.calibrated = calibrated_,
                     .force_on = force_on_,
                     .calibration = calibration_,
                     .lost_by = lost_by_,
                     .jumped = jumped_,
                     .not_finite = not_finite_,
                     .warm = warm_,
                     .frames = frames_};
  for (std::size_t i = 0; i < cuts_.size(); ++i) report.cuts[i] = cuts_[i];
  return report;
}

unsigned int ServoLoop::tick() {
  const std::int64_t began_ns = rt::monotonicNow_ns();
  const bool warm = began_ns < warm_until_ns_;
  const bool rests = resting_ || lost_by_ != kHdSuccess;
  hd_.make_current(device_);
  hd_.begin_frame(device_);
  DeviceReading reading = read();
  const unsigned int calibration = hd_.check_calibration();
  reading.calibrated = calibration == kHdCalibrated && clean_frames_ >= kCleanFrames;
  reading.fault = warm || rests;
  const ReadingVerdict verdict = exchange_->publish(reading, began_ns);
  write(commandAt(rt::monotonicNow_ns(), enabled_ && reading.calibrated && !warm && !rests));
  const std::int64_t ends_ns = rt::monotonicNow_ns();
  hd_.end_frame(device_);
  const std::int64_t now_ns = rt::monotonicNow_ns();
  end_of_frame_ns_ = now_ns - ends_ns;
  take(hd_.takeErrors(), now_ns);
  if (verdict == ReadingVerdict::jumped) jumped_ = true;
  not_finite_ = verdict == ReadingVerdict::not_finite;
  calibration_ = calibration;
  calibrated_ = reading.calibrated;
  steerForceOutput(reading.calibrated && !rests);
  if (!rests) steerCalibration(calibration, now_ns);
  ++frames_;
  rested_ = rests;
  return kHdContinue;
}

DeviceReading ServoLoop::read() {
  DeviceReading reading;
  std::array<double, 3> values{};
  hd_.get_doubles(kHdPosition, values.data());
  reading.position_m = kMPerMm * rt::Vec3{values[0], values[1], values[2]};
  std::array<double, 16> transform{};
  hd_.get_doubles(kHdTransform, transform.data());
  reading.orientation = orientationOf(transform);
  int buttons = 0;
  hd_.get_integers(kHdButtons, &buttons);
  reading.buttons = static_cast<std::uint32_t>(buttons);
  reading.latency_ns = end_of_frame_ns_;
  return reading;
}

DeviceCommand ServoLoop::commandAt(std::int64_t now_ns, bool may_push) {
  const DeviceCommand command = exchange_->commandAt(now_ns);
  if (!may_push) return {};
  // the dead man's pauses are shorter: they must not bring the same force back
  constexpr std::int64_t kSmallFor_ns = 100'000'000;
  if (norm(command.force_n) >= kSmallN) small_since_ns_ = now_ns;
  if (now_ns - small_since_ns_ >= kSmallFor_ns) cut_ = false;
  return cut_ ? DeviceCommand{} : command;
}

void ServoLoop::write(const DeviceCommand& command) {
  const rt::Vec3& f = command.force_n;
  const std::array<double, 3> force_n{f.x, f.y, f.z};
  hd_.set_doubles(kHdForce, force_n.data());
  if (!drives_torque_) return;
  const rt::Vec3 t = kMNmPerNm * command.torque_n_m;
  const std::array<double, 3> torque_mn_m{t.x, t.y, t.z};
  hd_.set_doubles(kHdTorque, torque_mn_m.data());
}

void ServoLoop::take(unsigned int error, std::int64_t now_ns) {
  if (frames_since_start_ < kStartFrames) ++frames_since_start_;
  if (error == kHdSuccess) {
    if (clean_frames_ < kCleanFrames) ++clean_frames_;
    return;
  }
  if (error == kHdWarmMotors) {
    if (now_ns >= warm_until_ns_) ++warm_;
    warm_until_ns_ = now_ns + kWarmNs;
    return;
  }
  if (isCut(error)) {
    if (!cut_) ++cuts_[error - kHdExceededForce];
    cut_ = true;
    return;
  }
  clean_frames_ = 0;
  if (!isFrameError(error) || frames_since_start_ >= kStartFrames) {
    unsigned int none = kHdSuccess;
    lost_by_.compare_exchange_strong(none, error);
  }
}

/// The device, too, turns its force off after some errors.
void ServoLoop::steerForceOutput(bool calibrated) {
  if (!calibrated || !force_allowed_) {
    if (enabled_) hd_.disable(kHdForceOutput);
    enabled_ = false;
  } else if (!enabled_ || (!cut_ && hd_.is_enabled(kHdForceOutput) == 0)) {
    hd_.enable(kHdForceOutput);
    enabled_ = true;
  }
  force_on_ = enabled_ && hd_.is_enabled(kHdForceOutput) != 0;
}

void ServoLoop::steerCalibration(unsigned int calibration, std::int64_t now_ns) {
  const bool by_person = style_ == kHdEncoderReset && calibration != kHdCalibrated;
  const bool due = by_person ? calibrate_.exchange(false) : calibration == kHdNeedsUpdate;
  if (!due || now_ns - updated_ns_ < kUpdateNs) return;
  updated_ns_ = now_ns;
  hd_.update_calibration(style_);
}

}  // namespace hapticd::tools
