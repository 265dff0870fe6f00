// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/utsname.h>

#include <array>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/base/clock.h"
#include "tools/haptic-bridge/base/device_rows.h"
#include "tools/haptic-bridge/base/vendor_library.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools {
namespace {

/// What a device says of itself: places in the array of Dhd::status.
enum class DhdStatus : std::size_t {
  powered = 0,
  connected = 1,
  runs = 2,
  resetting = 3,  ///< waits for its calibration
  force_on = 5,
  brakes_on = 6,
  has_wrist = 8,
  error = 9,
  wrist_initialised = 12,
  force_off_cause = 14,
};

/// The status of a device; the library writes no more than the first 17 places now.
struct DhdStatusArray {
  std::array<int, 64> values{};
  int operator[](DhdStatus place) const { return values[static_cast<std::size_t>(place)]; }
};

constexpr const char* kName = "libdrd.so";

void addVersions(std::vector<std::string>& candidates, const std::string& folder) {
  for (std::string& path : versionsOf(folder, kName)) candidates.push_back(std::move(path));
}

std::vector<std::string> candidates() {
  std::vector<std::string> found;
  utsname machine{};
  ::uname(&machine);
  for (const char* variable : {"FDSDK", "FORCEDIM_SDK"}) {
    const char* folder = std::getenv(variable);
    if (folder == nullptr) continue;
    addVersions(found, fmt::format("{}/lib/release/lin-{}-gcc", folder, machine.machine));
  }
  addVersions(found, "/usr/local/lib");
  found.insert(found.end(), {kName, "libdrd.so.3"});  // where the system's loader looks
  return found;
}

/// The functions of Force Dimension's library that the driver calls, found at run time. Metres, radians,
/// newtons and newton metres. They return 0 or above for success and below 0 for failure, unless said
/// otherwise; `id` is that of the device, which dhdOpen and dhdOpenSerial return.  Thread: one.
struct Dhd {
  VendorLibrary library;

  static constexpr int kNothingNew = 1;  ///< returned for values that were returned before
  static constexpr unsigned kWatchdogUnit_us = 125;

  VendorFunction<void(int* major, int* minor, int* release, int* revision)> version{library,
                                                                                    "dhdGetSDKVersion"};
  VendorFunction<int()> device_count{library, "dhdGetDeviceCount"};
  VendorFunction<int()> open{library, "dhdOpen"};
  VendorFunction<int(int serial)> open_serial{library, "dhdOpenSerial"};
  VendorFunction<int(char id)> close{library, "dhdClose"};
  VendorFunction<int(char id)> stop{library, "dhdStop"};  ///< forces off, brakes on
  VendorFunction<const char*(char id)> system_name{library, "dhdGetSystemName"};
  VendorFunction<int(char id)> system_type{library, "dhdGetSystemType"};
  VendorFunction<int(unsigned short* serial, char id)> serial_number{library, "dhdGetSerialNumber"};
  VendorFunction<int(int* status, char id)> status{library, "dhdGetStatus"};  ///< an array of kStatusSize
  VendorFunction<bool(char id)> has_wrist{library, "dhdHasWrist"};
  VendorFunction<bool(char id)> has_active_wrist{library, "dhdHasActiveWrist"};
  VendorFunction<bool(char id)> has_gripper{library, "dhdHasGripper"};
  VendorFunction<bool(char id)> has_active_gripper{library, "dhdHasActiveGripper"};
  VendorFunction<int()> enable_expert_mode{library, "dhdEnableExpertMode"};
  VendorFunction<int(unsigned char units, char id)> set_watchdog{library, "dhdSetWatchdog"};
  VendorFunction<int(unsigned char* units, char id)> watchdog{library, "dhdGetWatchdog"};
  VendorFunction<int(double force_n, char id)> set_max_force{library, "dhdSetMaxForce"};
  VendorFunction<int(int on, char id)> set_gravity_compensation{library, "dhdSetGravityCompensation"};
  VendorFunction<int(int on, char id)> set_brakes{library, "dhdSetBrakes"};
  VendorFunction<int(unsigned char on, char id)> enable_force{library, "dhdEnableForce"};
  VendorFunction<int(double* x, double* y, double* z, char id)> position{library, "dhdGetPosition"};
  VendorFunction<int(double* x, double* y, double* z, double (*rotation)[3], char id)> pose{
      library, "dhdGetPositionAndOrientationFrame"};  ///< rotation: row by row
  VendorFunction<int(double* angle_rad, char id)> gripper_angle{library, "dhdGetGripperAngleRad"};
  VendorFunction<unsigned(char id)> buttons{library, "dhdGetButtonMask"};  ///< bit n: button n
  VendorFunction<int(double x, double y, double z, char id)> set_force{library, "dhdSetForce"};
  VendorFunction<int(double x, double y, double z, double tx, double ty, double tz, char id)> set_wrench{
      library, "dhdSetForceAndTorque"};
  VendorFunction<int(double x, double y, double z, double tx, double ty, double tz, double gripper, char id)>
      set_wrench_and_gripper{library, "dhdSetForceAndTorqueAndGripperForce"};
  VendorFunction<int()> last_error{library, "dhdErrorGetLast"};
  VendorFunction<const char*()> last_error_text{library, "dhdErrorGetLastStr"};

  /// Loads the library: `path`, or the newest that the vendor's installation has left; checks its version.
  /// Errors: it is not there, lacks a function, or is older than version 3.
  static base::Result<Dhd> load(const std::string& path) {
    auto library = VendorLibrary::load(path.empty() ? candidates() : std::vector{path},
                                       "install the vendor's SDK, or name its libdrd.so.* by --library");
    if (!library) return std::unexpected(library.error());
    const Dhd dhd{std::move(*library)};
    if (dhd.library.missing()) return std::unexpected(*dhd.library.missing());
    int major = 0;
    int minor = 0;
    int release = 0;
    int revision = 0;
    dhd.version(&major, &minor, &release, &revision);
    constexpr int kOldestMajor = 3;
    if (major < kOldestMajor)
      return std::unexpected(base::Error{
          dhd.library.path(),
          fmt::format("is version {}.{}.{}; {} or newer is needed", major, minor, release, kOldestMajor),
          "install a newer SDK of the vendor"});
    return dhd;
  }

  /// What went wrong in the last call of this thread.
  std::string lastError() const {
    const char* text = last_error_text();
    return fmt::format("{} (error {})", text == nullptr ? "unknown" : text, last_error());
  }
};

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

/// A device that is open; closed, without force and with its brakes on, with the object. Thread: one.
class OpenDhdDevice {
 public:
  OpenDhdDevice(const Dhd& dhd, char id, DeviceSession& session) : dhd_(dhd), id_(id), session_(session) {
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

  ~OpenDhdDevice() {
    (void)exert({});
    dhd_.stop(id_);
    dhd_.close(id_);
  }

  OpenDhdDevice(const OpenDhdDevice&) = delete;
  OpenDhdDevice& operator=(const OpenDhdDevice&) = delete;

  /// Waits until the device knows its position, and tells the person what it needs for that. Returns false if
  /// the session ended before.  Errors: the device is lost.
  base::Result<bool> awaitInitialised() {
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

  /// Sets the watchdog, and turns the forces on, at zero.  Errors: one of that fails.
  base::Result<void> prepare() {
    const auto failed = [this](const char* what) {
      return std::unexpected(lost(fmt::format("{}: {}", what, dhd_.lastError())));
    };
    if (dhd_.enable_expert_mode() < 0) return failed("its watchdog cannot be reached");
    unsigned char units = 0;
    if (dhd_.set_watchdog(kWatchdogUnits, id_) < 0 || dhd_.watchdog(&units, id_) < 0)
      return failed(
          "its watchdog, without which it would keep a force when this program dies, cannot be set");
    if (units != kWatchdogUnits)
      return std::unexpected(lost(fmt::format("its watchdog is at {:.2f} ms instead of {:.2f}: no force",
                                              units * 0.125, kWatchdogUnits * 0.125)));
    if (dhd_.set_max_force(about_.limits.force_n, id_) < 0) return failed("its force cannot be limited");
    if (dhd_.set_gravity_compensation(1, id_) < 0) return failed("no gravity compensation");
    if (auto ok = enableForce(); !ok) return ok;
    session_.opened(about_);
    return {};
  }

  /// Reads and exerts until the session ends.  Errors: the device is lost.
  base::Result<void> run() {
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

 private:
  base::Result<DhdStatusArray> status() const {
    DhdStatusArray status;
    if (dhd_.status(status.values.data(), id_) < 0)
      return std::unexpected(lost("lost: no status: " + dhd_.lastError()));
    if (status[DhdStatus::connected] == 0) return std::unexpected(lost("lost: it is not connected any more"));
    return status;
  }

  std::string whatItNeeds(const DhdStatusArray& status) const {
    if (status[DhdStatus::powered] == 0) return "has no power: switch it on";
    if (status[DhdStatus::error] != 0) return "reports an error: switch it off and on again";
    return "does not know its position: initialise it with the vendor's program, or move it to its rest "
           "position and press its reset button; until then it exerts no force";
  }

  base::Result<void> enableForce() {
    if (dhd_.set_brakes(0, id_) < 0 || dhd_.enable_force(1, id_) < 0)
      return std::unexpected(lost("its force cannot be turned on: " + dhd_.lastError()));
    return exert({});
  }

  /// Returns whether there is a new measurement.
  base::Result<bool> measure() {
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

  base::Result<void> publish() {
    ++readings_;
    const ReadingVerdict verdict = session_.exchange().publish(reading_, measured_ns_);
    if (verdict == ReadingVerdict::jumped)
      return std::unexpected(lost("its position jumped farther than a hand can move it"));
    value_complaint_.update(session_, verdict == ReadingVerdict::not_finite,
                            about_.model + ": its position is no number; it exerts no force");
    return {};
  }

  base::Result<void> exert(const DeviceCommand& command) {
    const rt::Vec3& f = command.force_n;
    const rt::Vec3& t = command.torque_n_m;
    const int got = has_.active_gripper ? dhd_.set_wrench_and_gripper(f.x, f.y, f.z, t.x, t.y, t.z,
                                                                      command.gripper_force_n, id_)
                    : has_.active_wrist ? dhd_.set_wrench(f.x, f.y, f.z, t.x, t.y, t.z, id_)
                                        : dhd_.set_force(f.x, f.y, f.z, id_);
    if (got < 0) return std::unexpected(lost("lost: it takes no force: " + dhd_.lastError()));
    return {};
  }

  base::Result<void> lookAfter(std::int64_t now_ns) {
    const auto now = status();
    if (!now) return std::unexpected(now.error());
    if (!isInitialised(*now)) return std::unexpected(lost("it has lost its initialisation; no force"));
    lookAtRate(now_ns);
    return lookAtForce(*now, now_ns);
  }

  base::Result<void> lookAtForce(const DhdStatusArray& status, std::int64_t now_ns) {
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

  void lookAtRate(std::int64_t now_ns) {
    const std::int64_t since_ns = now_ns - counted_since_ns_;
    if (since_ns < kRateNs) return;
    const double per_s = static_cast<double>(readings_) / (static_cast<double>(since_ns) * 1e-9);
    rate_complaint_.update(session_, per_s < kLeastReadingsPerS,
                           fmt::format("{} gives {:.0f} readings a second; {:.0f} are needed", about_.model,
                                       per_s, kLeastReadingsPerS));
    readings_ = 0;
    counted_since_ns_ = now_ns;
  }

  base::Error lost(const std::string& what) const { return {about_.model, what, ""}; }

  const Dhd& dhd_;
  char id_;
  DeviceSession& session_;
  DhdCapabilities has_;
  DeviceAbout about_;
  DeviceReading reading_;
  std::int64_t measured_ns_ = 0;
  std::int64_t looked_ns_ = 0;
  std::int64_t counted_since_ns_ = 0;
  std::uint64_t readings_ = 0;  // since then
  bool force_off_ = false;
  std::int64_t force_off_ns_ = 0;  // since when
  Complaint needs_;
  Complaint force_complaint_;
  Complaint rate_complaint_;
  Complaint value_complaint_;
};

/// Drives the devices of Force Dimension (delta, omega, sigma, lambda) by the vendor's libdrd.so, which is
/// loaded when it is first used. The watchdog in the device drops the force when this program dies.
class ForceDimensionDriver final : public DeviceDriver {
 public:
  /// `library`: path; empty: where the vendor installs it. `serial`: of the device; empty: the first one.
  ForceDimensionDriver(std::string library, std::string serial)
      : library_(std::move(library)), serial_(std::move(serial)) {}

  base::Result<void> drive(DeviceSession& session) override {
    if (!dhd_) {
      auto loaded = Dhd::load(library_);
      if (!loaded) return std::unexpected(loaded.error());
      dhd_ = *loaded;
    }
    const auto id = open();
    if (!id) return std::unexpected(id.error());
    OpenDhdDevice device(*dhd_, *id, session);
    const auto initialised = device.awaitInitialised();
    if (!initialised) return std::unexpected(initialised.error());
    if (!*initialised) return {};
    if (auto ok = device.prepare(); !ok) return ok;
    return device.run();
  }

 private:
  base::Result<char> open() const {
    int id = -1;
    if (serial_.empty()) {
      id = dhd_->open();
    } else {
      int serial = 0;
      const char* end = serial_.data() + serial_.size();
      if (const auto parsed = std::from_chars(serial_.data(), end, serial);
          parsed.ec != std::errc{} || parsed.ptr != end)
        return std::unexpected(
            base::Error{"--device", fmt::format("\"{}\" is no serial number", serial_), ""});
      id = dhd_->open_serial(serial);
    }
    if (id >= 0) return static_cast<char>(id);
    return std::unexpected(base::Error{
        "Force Dimension device",
        fmt::format("cannot be opened: {}; {} connected", dhd_->lastError(), dhd_->device_count()),
        "plug it in, end other programs that use it, and permit this user to use its USB device"});
  }

  std::string library_;
  std::string serial_;
  std::optional<Dhd> dhd_;
};

}  // namespace

DeviceLimits limitsOfDhdType(int type, const DhdCapabilities& capabilities) {
  constexpr int kDelta3 = 63;
  constexpr int kFirstOmega = 33;
  constexpr int kLastOmega = 37;
  constexpr double kDeltaN = 20;
  constexpr double kOmegaN = 12;
  constexpr double kUnknownN = 8;     // less than any of them exerts
  constexpr double kUnknownNM = 0.1;  // nobody has published any
  constexpr double kGripperN = 8;
  const bool omega = type >= kFirstOmega && type <= kLastOmega;
  return {.force_n = type == kDelta3 ? kDeltaN
                     : omega         ? kOmegaN
                                     : kUnknownN,
          .torque_n_m = capabilities.active_wrist ? kUnknownNM : 0,
          .gripper_force_n = capabilities.active_gripper ? kGripperN : 0};
}

std::unique_ptr<DeviceDriver> makeForceDimensionDriver(const VendorOptions& options) {
  return std::make_unique<ForceDimensionDriver>(options.library, options.device);
}

}  // namespace hapticd::tools
