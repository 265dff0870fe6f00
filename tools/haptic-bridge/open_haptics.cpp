// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/base/clock.h"
#include "tools/haptic-bridge/base/device_rows.h"
#include "tools/haptic-bridge/open_haptics_library.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools {
namespace {

/// What the thread of the library's scheduler has found, for the driver's thread.
struct ServoReport {
  bool calibrated = false;
  bool force_on = false;              ///< the device accepts forces
  unsigned int calibration = 0;       ///< HdCalibration
  unsigned int lost_by = kHdSuccess;  ///< the error by which the device is lost; kHdSuccess: it is not
  bool jumped = false;
  bool not_finite = false;
  std::uint64_t warm = 0;               ///< how often the motors were warm
  std::array<std::uint64_t, 4> cuts{};  ///< how often the device cut the force, by HdError - kHdExceededForce
  std::uint64_t frames = 0;
};

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

/// The part of the driver that runs in the thread of OpenHaptics' scheduler, 1000 times a second: it carries
/// readings and forces. Calibration runs here as well, because it has no effect elsewhere with some versions.
/// Thread: tick() the scheduler's, everything else the driver's.
class ServoLoop {
 public:
  /// Before the callback is scheduled.
  void begin(const Hd& hd, HdHandle device, unsigned int calibration_style, bool drives_torque,
             DeviceExchange& exchange) {
    hd_ = &hd;
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

  /// For the scheduler; `loop`: the ServoLoop.
  static unsigned int callback(void* loop) { return static_cast<ServoLoop*>(loop)->tick(); }

  /// The device may be turned on: the exchange has its limits.
  void allowForce() { force_allowed_ = true; }
  /// The person has put the device where its calibration begins.
  void calibrate() { calibrate_ = true; }
  /// Zero from the next frame on. `isAtRest`: such a frame has been sent, or none is sent any more.
  void rest() { resting_ = true; }
  bool isAtRest() const { return rested_; }
  ServoReport report() const {
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

 private:
  unsigned int tick() {
    const std::int64_t began_ns = rt::monotonicNow_ns();
    const bool warm = began_ns < warm_until_ns_;
    const bool rests = resting_ || lost_by_ != kHdSuccess;
    hd_->make_current(device_);
    hd_->begin_frame(device_);
    DeviceReading reading = read();
    const unsigned int calibration = hd_->check_calibration();
    reading.calibrated = calibration == kHdCalibrated && clean_frames_ >= kCleanFrames;
    reading.fault = warm || rests;
    const ReadingVerdict verdict = exchange_->publish(reading, began_ns);
    write(commandAt(rt::monotonicNow_ns(), enabled_ && reading.calibrated && !warm && !rests));
    const std::int64_t ends_ns = rt::monotonicNow_ns();
    hd_->end_frame(device_);
    const std::int64_t now_ns = rt::monotonicNow_ns();
    end_of_frame_ns_ = now_ns - ends_ns;
    take(hd_->takeErrors(), now_ns);
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

  DeviceReading read() {
    DeviceReading reading;
    std::array<double, 3> values{};
    hd_->get_doubles(kHdPosition, values.data());
    reading.position_m = kMPerMm * rt::Vec3{values[0], values[1], values[2]};
    std::array<double, 16> transform{};
    hd_->get_doubles(kHdTransform, transform.data());
    reading.orientation = orientationOf(transform);
    int buttons = 0;
    hd_->get_integers(kHdButtons, &buttons);
    reading.buttons = static_cast<std::uint32_t>(buttons);
    reading.latency_ns = end_of_frame_ns_;
    return reading;
  }

  void write(const DeviceCommand& command) {
    const rt::Vec3& f = command.force_n;
    const std::array<double, 3> force_n{f.x, f.y, f.z};
    hd_->set_doubles(kHdForce, force_n.data());
    if (!drives_torque_) return;
    const rt::Vec3 t = kMNmPerNm * command.torque_n_m;
    const std::array<double, 3> torque_mn_m{t.x, t.y, t.z};
    hd_->set_doubles(kHdTorque, torque_mn_m.data());
  }

  DeviceCommand commandAt(std::int64_t now_ns, bool may_push) {
    const DeviceCommand command = exchange_->commandAt(now_ns);
    if (!may_push) return {};
    // the dead man's pauses are shorter: they must not bring the same force back
    constexpr std::int64_t kSmallFor_ns = 100'000'000;
    if (norm(command.force_n) >= kSmallN) small_since_ns_ = now_ns;
    if (now_ns - small_since_ns_ >= kSmallFor_ns) cut_ = false;
    return cut_ ? DeviceCommand{} : command;
  }

  void take(unsigned int error, std::int64_t now_ns) {
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
  void steerForceOutput(bool calibrated) {
    if (!calibrated || !force_allowed_) {
      if (enabled_) hd_->disable(kHdForceOutput);
      enabled_ = false;
    } else if (!enabled_ || (!cut_ && hd_->is_enabled(kHdForceOutput) == 0)) {
      hd_->enable(kHdForceOutput);
      enabled_ = true;
    }
    force_on_ = enabled_ && hd_->is_enabled(kHdForceOutput) != 0;
  }

  void steerCalibration(unsigned int calibration, std::int64_t now_ns) {
    const bool by_person = style_ == kHdEncoderReset && calibration != kHdCalibrated;
    const bool due = by_person ? calibrate_.exchange(false) : calibration == kHdNeedsUpdate;
    if (!due || now_ns - updated_ns_ < kUpdateNs) return;
    updated_ns_ = now_ns;
    hd_->update_calibration(style_);
  }

  const Hd* hd_ = nullptr;
  HdHandle device_ = kNoHdHandle;
  unsigned int style_ = 0;
  bool drives_torque_ = false;
  DeviceExchange* exchange_ = nullptr;

  // the scheduler's thread
  int clean_frames_ = 0;  // in a row
  int frames_since_start_ = 0;
  bool enabled_ = false;
  bool cut_ = false;                 // by the device; until the commanded force is small
  std::int64_t small_since_ns_ = 0;  // when a force that is not small was commanded last
  std::int64_t warm_until_ns_ = 0;
  std::int64_t updated_ns_ = 0;       // the calibration
  std::int64_t end_of_frame_ns_ = 0;  // how long the last one took

  std::atomic<bool> force_allowed_{false};
  std::atomic<bool> calibrate_{false};
  std::atomic<bool> resting_{false};
  std::atomic<bool> rested_{false};
  std::atomic<bool> calibrated_{false};
  std::atomic<bool> force_on_{false};
  std::atomic<unsigned int> calibration_{0};
  std::atomic<unsigned int> lost_by_{kHdSuccess};
  std::atomic<bool> jumped_{false};
  std::atomic<bool> not_finite_{false};
  std::atomic<std::uint64_t> warm_{0};
  std::array<std::atomic<std::uint64_t>, 4> cuts_{};
  std::atomic<std::uint64_t> frames_{0};
};

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

/// Drives the Touch, Touch X and Phantom devices by OpenHaptics' libHD.so, which is loaded when it is first
/// used and never unloaded. The force is carried by the thread of the library's scheduler.
class OpenHapticsDriver final : public DeviceDriver {
 public:
  /// `library`: path; empty: the one that the system's loader finds. `device`: name; empty: the default one.
  OpenHapticsDriver(std::string library, std::string device)
      : library_(std::move(library)), device_(std::move(device)) {}

  base::Result<void> drive(DeviceSession& session) override {
    if (!hd_) {
      auto loaded = Hd::load(library_);
      if (!loaded) return std::unexpected(loaded.error());
      hd_ = *loaded;
    }
    (void)hd_->takeErrors();
    handle_ = hd_->init_device(device_.empty() ? nullptr : device_.c_str());
    if (const unsigned int error = hd_->takeErrors(); handle_ == kNoHdHandle || error != kHdSuccess) {
      if (handle_ != kNoHdHandle) hd_->disable_device(handle_);
      return std::unexpected(
          base::Error{device_.empty() ? "OpenHaptics' default device" : device_,
                      "cannot be opened: " + hd_->textOf(error),
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

 private:
  base::Result<void> run(DeviceSession& session, const DeviceAbout& about, unsigned int style) {
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

  base::Result<void> watch(DeviceSession& session, const DeviceAbout& about, unsigned int style) {
    session.exchange().open({});  // it is there, and not calibrated
    Attendant attendant(session, about, style);
    while (!session.ends()) {
      if (auto ok = attendant.look(loop_, *hd_); !ok) return ok;
      session.pause(kLook);
    }
    return {};
  }

  std::string library_;
  std::string device_;
  std::optional<Hd> hd_;
  HdHandle handle_ = kNoHdHandle;
  ServoLoop loop_;  // outlives a callback that the library calls late
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

std::unique_ptr<DeviceDriver> makeOpenHapticsDriver(const VendorOptions& options) {
  return std::make_unique<OpenHapticsDriver>(options.library, options.device);
}

}  // namespace hapticd::tools
