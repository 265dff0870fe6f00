// SPDX-License-Identifier: Apache-2.0
// A library with the functions of OpenHaptics' libHD.so that hapticd calls, in front of an emulated arm. It
// assumes that the device drops its force when no frame has come for 20 ms; the vendor says nothing of that.

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "rt/base/clock.h"
#include "tests/vendor_devices/mapped_arm.h"

namespace {

using hapticd::test::ArmMemory;
using hapticd::test::MappedArm;
namespace test = hapticd::test;

using Callback = unsigned int(void* user);
struct ErrorInfo {
  unsigned int code;
  int internal;
  unsigned int device;
};

constexpr unsigned int kDevice = 7;
constexpr unsigned int kNoDevice = 0xFFFFFFFF;
enum Error : unsigned int {
  kInvalidOperation = 0x102,
  kWarm = 0x200,
  kExceededForce = 0x201,
  kFault = 0x300,
  kAlreadyInitiated = 0x301,
  kCommError = 0x302,
  kIllegalBegin = 0x400,
  kIllegalEnd = 0x401,
};
enum Model { kTouch = 0, kPremium6 = 1, kDesktop = 2 };
constexpr int kFirstFrames = 5;  // after the start of the scheduler fail, and give no measurement

struct Frame {
  std::array<double, 3> position_mm{0, -110, -35};
  std::array<double, 16> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  int buttons = 0;
  unsigned int calibration = 0x5000;
};

struct Library {
  std::unique_ptr<MappedArm> mapped;
  bool open = false;
  std::atomic<bool> runs{false};
  std::thread scheduler;
  std::mutex mutex;  // of the two below
  std::deque<unsigned int> errors;
  std::map<unsigned long, std::pair<Callback*, void*>> callbacks;
  unsigned long scheduled = 0;
  int frames = 0;  // since the scheduler has started
  bool in_frame = false;
  Frame frame;
  std::array<double, 3> force_n{};
  std::array<double, 3> torque_mn_m{};
  std::atomic<bool> force_output{false};
};
Library library;                         // NOLINT: one for the process, as the vendor's
thread_local bool is_scheduler = false;  // NOLINT

ArmMemory& arm() {
  return library.mapped->memory();
}
bool has(std::uint32_t fault) {
  return (arm().faults & fault) != 0;
}
void fail(unsigned int error) {
  const std::lock_guard lock(library.mutex);
  library.errors.push_back(error);
}
unsigned int style() {
  switch (arm().model) {
    case kPremium6:
      return 1;
    case kDesktop:
      return 2;
    default:
      return 4;
  }
}

/// While it is not calibrated: whether the library or the person has to do something.
unsigned int calibrationNow() {
  if (!has(test::kArmNotCalibrated)) return 0x5000;
  const bool ready = style() == 2 || (style() == 4 && arm().docked);
  return ready ? 0x5001 : 0x5002;
}

Frame measured() {
  Frame frame;
  for (std::size_t i = 0; i < 3; ++i) {
    frame.position_mm[i] = 1e3 * arm().position_m[i];
  }
  if (has(test::kArmJump)) frame.position_mm[0] += 300;
  if (has(test::kArmNotFinite)) frame.position_mm[1] = std::nan("");
  const double x = arm().orientation[0];
  const double y = arm().orientation[1];
  const double z = arm().orientation[2];
  const double w = arm().orientation[3];
  frame.transform = {1 - 2 * (y * y + z * z), 2 * (x * y + z * w),     2 * (x * z - y * w),     0,
                     2 * (x * y - z * w),     1 - 2 * (x * x + z * z), 2 * (y * z + x * w),     0,
                     2 * (x * z + y * w),     2 * (y * z - x * w),     1 - 2 * (x * x + y * y), 0,
                     frame.position_mm[0],    frame.position_mm[1],    frame.position_mm[2],    1};
  frame.buttons = static_cast<int>(arm().buttons.load());
  frame.calibration = calibrationNow();
  return frame;
}

void sendForce() {
  const bool pushes = std::hypot(library.force_n[0], library.force_n[1], library.force_n[2]) > 0;
  if (has(test::kArmForceCut) && pushes) {
    library.force_output = false;
    fail(kExceededForce + static_cast<unsigned int>(arm().cut_cause.load()));
  }
  const bool warm = has(test::kArmWarm);
  if (warm && pushes) fail(kWarm);
  const bool on = library.force_output && !warm;
  for (std::size_t i = 0; i < 3; ++i) {
    arm().force_n[i] = on ? library.force_n[i] : 0;
    arm().torque_n_m[i] = on ? 1e-3 * library.torque_mn_m[i] : 0;
  }
  arm().force_on = on;
  arm().force_ns = hapticd::rt::monotonicNow_ns();
  ++arm().forces;
}

void schedule() {
  is_scheduler = true;
  auto next = std::chrono::steady_clock::now();
  while (library.runs) {
    std::map<unsigned long, std::pair<Callback*, void*>> callbacks;
    {
      const std::lock_guard lock(library.mutex);
      callbacks = library.callbacks;
    }
    for (const auto& [handle, callback] : callbacks) {
      if (callback.first(callback.second) != 0) continue;
      const std::lock_guard lock(library.mutex);
      library.callbacks.erase(handle);
    }
    next = std::max(next + std::chrono::milliseconds(1), std::chrono::steady_clock::now());
    std::this_thread::sleep_until(next);
  }
}

}  // namespace

extern "C" {

unsigned int hdInitDevice(const char* name) {
  const char* path = std::getenv(test::kArmVariable);
  if (path == nullptr || (name != nullptr && std::string_view(name) != "Default Device")) {
    fail(kFault);
    return kNoDevice;
  }
  if (library.open) {
    fail(kAlreadyInitiated);
    return kNoDevice;
  }
  library.mapped = std::make_unique<MappedArm>(path, false);
  const std::uint32_t faults = arm().faults;  // read once: a test changes it at any time
  if ((faults & (test::kArmUnplugged | test::kArmBusy)) != 0) {
    fail((faults & test::kArmUnplugged) != 0 ? kCommError : kFault);
    return kNoDevice;
  }
  constexpr std::int64_t kAssumedNs = 20'000'000;
  arm().watchdog_ns = kAssumedNs;
  arm().brakes = false;
  library.open = true;
  library.force_output = false;
  library.force_n = library.torque_mn_m = {};
  library.frame = {};
  ++arm().openings;
  return kDevice;
}
void hdDisableDevice(unsigned int device) {
  if (!library.open || device != kDevice) return fail(kInvalidOperation);
  library.open = false;
  arm().force_on = false;
}
void hdMakeCurrentDevice(unsigned int device) {
  if (device != kDevice) fail(kInvalidOperation);
}
void hdBeginFrame(unsigned int device) {
  if (!library.open || device != kDevice || !is_scheduler) return fail(kInvalidOperation);
  if (library.in_frame) fail(kIllegalBegin);
  library.in_frame = true;
  if (has(test::kArmUnplugged)) return fail(kCommError);
  if (has(test::kArmSlow)) std::this_thread::sleep_for(std::chrono::milliseconds(30));
  while (has(test::kArmHangs)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (++library.frames <= kFirstFrames) return;
  library.frame = measured();
  if (arm().extra_delay_ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(arm().extra_delay_ns));
}
void hdEndFrame(unsigned int device) {
  if (!library.open || device != kDevice || !library.in_frame) return fail(kIllegalEnd);
  library.in_frame = false;
  if (library.frames <= kFirstFrames) return fail(kIllegalEnd);
  if (has(test::kArmUnplugged)) return fail(kCommError);
  sendForce();
}
ErrorInfo hdGetError() {
  const std::lock_guard lock(library.mutex);
  if (library.errors.empty()) return {0, 0, kNoDevice};
  const unsigned int code = library.errors.front();
  library.errors.pop_front();
  return {code, 0, kDevice};
}
const char* hdGetErrorString(unsigned int code) {
  switch (code) {
    case kFault:
      return "device fault";
    case kCommError:
      return "no communication";
    default:
      return "another error";
  }
}
void hdEnable(unsigned int capability) {
  if (capability == 0x4000) library.force_output = !has(test::kArmForceCut);
}
void hdDisable(unsigned int capability) {
  if (capability == 0x4000) library.force_output = false;
}
unsigned char hdIsEnabled(unsigned int capability) {
  return capability == 0x4000 && library.force_output ? 1 : 0;
}
void hdGetIntegerv(unsigned int parameter, int* values) {
  if (parameter == 0x2000) *values = library.frame.buttons;
  if (parameter == 0x2554) *values = arm().model == kPremium6 ? 6 : 3;
  if (parameter == 0x2555) *values = static_cast<int>(style());
}
void hdGetDoublev(unsigned int parameter, double* values) {
  const auto give = [values](const auto& from) {
    for (std::size_t i = 0; i < from.size(); ++i) values[i] = from[i];
  };
  if (parameter == 0x2050) give(library.frame.position_mm);
  if (parameter == 0x2052) give(library.frame.transform);
  if (parameter == 0x2603) *values = arm().model == kPremium6 ? 6 : 3.4;
}
void hdSetDoublev(unsigned int parameter, const double* values) {
  if (!library.in_frame) return fail(kInvalidOperation);
  for (std::size_t i = 0; i < 3; ++i) {
    if (parameter == 0x2700) library.force_n[i] = values[i];
    if (parameter == 0x2701) library.torque_mn_m[i] = values[i];
  }
}
const char* hdGetString(unsigned int parameter) {
  if (parameter == 0x2504) return "A-0042";
  if (parameter != 0x2501) return nullptr;
  switch (arm().model) {
    case kPremium6:
      return "PHANTOM Premium 1.5 6DOF";
    case kDesktop:
      return "PHANTOM Desktop";
    default:
      return "Touch";
  }
}
#ifndef HAPTICD_FAKE_WITHOUT_CALIBRATION
unsigned int hdCheckCalibration() {
  return library.frame.calibration;
}
#endif
/// Has no effect in another thread than the scheduler's, as a user of a Touch has reported.
void hdUpdateCalibration(unsigned int with) {
  if (with != style()) return fail(kInvalidOperation);
  if (!is_scheduler || (style() == 4 && !arm().docked)) return;
  arm().faults &= ~static_cast<std::uint32_t>(test::kArmNotCalibrated);
}
void hdStartScheduler() {
  library.frames = 0;
  library.in_frame = false;
  library.runs = true;
  library.scheduler = std::thread(schedule);
}
void hdStopScheduler() {
  library.runs = false;
  if (library.scheduler.joinable()) library.scheduler.join();
}
unsigned long hdScheduleAsynchronous(Callback* callback, void* user, unsigned short) {
  const std::lock_guard lock(library.mutex);
  library.callbacks[++library.scheduled] = {callback, user};
  return library.scheduled;
}
void hdUnschedule(unsigned long handle) {
  const std::lock_guard lock(library.mutex);
  library.callbacks.erase(handle);
}

}  // extern "C"
