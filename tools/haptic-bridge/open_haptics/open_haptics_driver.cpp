// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/open_haptics/open_haptics_driver.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "rt/base/clock.h"

namespace hapticd::tools {
namespace {

constexpr std::chrono::milliseconds kLook{10};
constexpr std::int64_t kPrepareNs = 5'000'000'000;  // for the person to bring the arm to its reset position
constexpr std::int64_t kSilenceNs = 1'000'000'000;  // without a frame: the scheduler has stopped

/// The styles that a device has in the order in which they ask least of the person.
unsigned int preferred(unsigned int styles) {
  for (const unsigned int style : {kHdAutomatic, kHdInkwell, kHdEncoderReset}) {
    if ((styles & style) != 0) return style;
  }
  return kHdAutomatic;
}

std::string calibrationText(const std::string& model, unsigned int style) {
  const std::string begins = model + " does not know its position, and exerts no force until it does: ";
  if (style == kHdInkwell) return begins + "put the stylus into the inkwell";
  if (style == kHdEncoderReset)
    return begins + "bring the arm to its reset position and hold it there: its encoders are reset in 5 s";
  return begins + "move it through its whole workspace";
}

/// What the driver's thread does while the scheduler's thread carries readings and forces: it says what that
/// one has found, leads the person through the calibration, and permits forces after it.
class Attendant {
 public:
  Attendant(DeviceSession& session, const DeviceAbout& about, unsigned int style)
      : session_(session), about_(about), style_(style), framed_ns_(rt::monotonicNow_ns()) {}

  /// Errors: the device is lost.
  base::Result<void> look(ServoLoop& loop, const Hd& hd) {
    const ServoReport report = loop.report();
    const std::int64_t now_ns = rt::monotonicNow_ns();
    sayCounts(report);
    if (report.lost_by != kHdSuccess) return lost(hd.textOf(report.lost_by));
    if (report.jumped) return lost("its position jumped farther than a hand can move it");
    if (report.frames != said_.frames) framed_ns_ = now_ns;
    said_ = report;
    if (now_ns - framed_ns_ > kSilenceNs) return lost("the scheduler of OpenHaptics does not run");
    calibrate(report, loop, now_ns);
    if (report.calibrated && !session_.wasOpened()) {
      session_.opened(about_);
      loop.allowForce();
      force_on_ns_ = now_ns;
    }
    if (report.force_on || !report.calibrated) force_on_ns_ = now_ns;
    force_off_.update(session_, session_.wasOpened() && now_ns - force_on_ns_ > kSilenceNs,
                      about_.model + " does not let its force be turned on");
    return {};
  }

 private:
  std::unexpected<base::Error> lost(const std::string& what) const {
    return std::unexpected(base::Error{about_.model, "lost: " + what, ""});
  }

  void sayCounts(const ServoReport& report) {
    static constexpr std::array<std::string_view, 4> kCauses{
        "too large a force", "too large a change of the force", "too fast a motion", "an error of the force"};
    if (report.warm > said_.warm)
      session_.say(fmt::format("{}: its motors are warm; no force for 5 s ({} times so far)", about_.model,
                               report.warm));
    for (std::size_t i = 0; i < report.cuts.size(); ++i) {
      if (report.cuts[i] > said_.cuts[i])
        session_.say(
            fmt::format("{} has cut its force because of {}; none until a small one is commanded "
                        "({} times so far)",
                        about_.model, kCauses[i], report.cuts[i]));
    }
    not_finite_.update(session_, report.not_finite,
                       about_.model + ": its position is no number; it exerts no force");
  }

  void calibrate(const ServoReport& report, ServoLoop& loop, std::int64_t now_ns) {
    const bool needed = report.frames > 0 && report.calibration != kHdCalibrated;
    calibration_.update(session_, needed, calibrationText(about_.model, style_));
    if (!needed) asked_ns_ = 0;
    if (needed && asked_ns_ == 0) asked_ns_ = now_ns;
    if (!needed || now_ns - asked_ns_ < kPrepareNs) return;
    loop.calibrate();
    asked_ns_ = now_ns;
  }

  DeviceSession& session_;
  const DeviceAbout& about_;
  unsigned int style_;
  ServoReport said_;
  std::int64_t framed_ns_;        // when the newest frame was there
  std::int64_t asked_ns_ = 0;     // the person, to bring the device where its calibration begins
  std::int64_t force_on_ns_ = 0;  // when its force was on last, or need not be
  Complaint calibration_;
  Complaint force_off_;
  Complaint not_finite_;
};

}  // namespace

DeviceLimits limitsOfHdModel(std::string_view model, double nominal_max_force_n, int output_degrees) {
  struct Row {
    std::string_view word;
    double force_n;
  };
  static constexpr std::array<Row, 6> kRows{{{"touch x", 7.9},
                                             {"touch", 3.3},
                                             {"omni", 3.3},
                                             {"desktop", 7.9},
                                             {"premium 1.5", 8.5},
                                             {"premium 3.0", 22}}};
  constexpr double kWeakestN = 3.3;
  constexpr double kTorqueNM = 0.188;  // of the Premium 1.5, the weaker one
  constexpr int kSixDegrees = 6;
  std::string lower(model);
  std::ranges::transform(lower, lower.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; });
  const auto row =
      std::ranges::find_if(kRows, [&](const Row& r) { return lower.find(r.word) != lower.npos; });
  double force_n = row == kRows.end() ? kWeakestN : row->force_n;
  if (nominal_max_force_n > 0) force_n = std::min(force_n, nominal_max_force_n);
  return {
      .force_n = force_n, .torque_n_m = output_degrees >= kSixDegrees ? kTorqueNM : 0, .gripper_force_n = 0};
}

base::Result<void> OpenHapticsDriver::drive(DeviceSession& session) {
  if (!hd_) {
    auto loaded = Hd::load(library_);
    if (!loaded) return std::unexpected(loaded.error());
    hd_ = *loaded;
  }
  (void)hd_->takeErrors();
  handle_ = hd_->init_device(device_.empty() ? nullptr : device_.c_str());
  if (const unsigned int error = hd_->takeErrors(); handle_ == kNoHdHandle || error != kHdSuccess) {
    if (handle_ != kNoHdHandle) hd_->disable_device(handle_);
    return std::unexpected(base::Error{
        device_.empty() ? "OpenHaptics' default device" : device_, "cannot be opened: " + hd_->textOf(error),
        "plug it in, set it up with the vendor's program, and end other programs that use it"});
  }
  hd_->make_current(handle_);
  const auto textOf = [this](unsigned int parameter) {
    const char* text = hd_->get_string(parameter);
    return std::string(text == nullptr ? "" : text);
  };
  int degrees = 0;
  int styles = 0;
  double nominal_n = 0;
  hd_->get_integers(kHdOutputDegrees, &degrees);
  hd_->get_integers(kHdCalibrationStyles, &styles);
  hd_->get_doubles(kHdNominalMaxForce, &nominal_n);
  DeviceAbout about{.model = textOf(kHdModel), .serial = textOf(kHdSerial), .limits = {}};
  if (about.model.empty()) about.model = "device";
  about.limits = limitsOfHdModel(about.model, nominal_n, degrees);
  (void)hd_->takeErrors();  // of a parameter that this device does not have
  auto driven = run(session, about, preferred(static_cast<unsigned int>(styles)));
  hd_->disable_device(handle_);
  return driven;
}

base::Result<void> OpenHapticsDriver::run(DeviceSession& session, const DeviceAbout& about,
                                          unsigned int style) {
  loop_.begin(*hd_, handle_, style, about.limits.torque_n_m > 0, session.exchange());
  const unsigned long scheduled = hd_->schedule(&ServoLoop::callback, &loop_, kHdTopPriority);
  hd_->start_scheduler();
  base::Result<void> driven = watch(session, about, style);
  loop_.rest();
  constexpr std::int64_t kMostNs = 200'000'000;  // a scheduler that has stopped sends nothing any more
  for (const std::int64_t until_ns = rt::monotonicNow_ns() + kMostNs;
       !loop_.isAtRest() && rt::monotonicNow_ns() < until_ns;)
    rt::sleepUntil(rt::monotonicNow_ns() + 1'000'000);
  hd_->stop_scheduler();
  hd_->unschedule(scheduled);
  hd_->disable(kHdForceOutput);
  return driven;
}

base::Result<void> OpenHapticsDriver::watch(DeviceSession& session, const DeviceAbout& about,
                                            unsigned int style) {
  session.exchange().open({});  // it is there, and not calibrated
  Attendant attendant(session, about, style);
  while (!session.ends()) {
    if (auto ok = attendant.look(loop_, *hd_); !ok) return ok;
    session.pause(kLook);
  }
  return {};
}

}  // namespace hapticd::tools
