// SPDX-License-Identifier: Apache-2.0
// A library with the functions of Force Dimension's libdrd.so that hapticd calls, in front of an emulated
// arm.

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <thread>

#include "rt/base/clock.h"
#include "tests/vendor_devices/mapped_arm.h"

namespace {

using hapticd::test::ArmMemory;
using hapticd::test::MappedArm;

constexpr char kId = 3;  // not the default: every call has to name the device
constexpr int kSerial = 12345;
enum Error { kCom = 2, kNoDevice = 5, kTimeout = 7, kNotExpert = 9, kInUse = 20, kNoFunction = 22 };
enum Model { kOmega3 = 33, kOmega6 = 34, kOmega7 = 35, kDelta3 = 63, kSigma7 = 104 };
constexpr int kTimeGuard = 1;
constexpr int kSaturated = 2;

struct Library {
  std::unique_ptr<MappedArm> mapped;
  bool open = false;
  bool expert = false;
  unsigned char watchdog = 0;
  int positions = 0;  // since it was opened
  std::array<double, 3> position{};
  bool cut = false;
  int cause = 0;
  std::uint64_t trips = 0;
};
Library library;          // NOLINT: one for the process, as the vendor's
thread_local int error_;  // NOLINT

ArmMemory& arm() {
  return library.mapped->memory();
}
bool has(std::uint32_t fault) {
  return (arm().faults & fault) != 0;
}
int fail(int error) {
  error_ = error;
  return -1;
}
void sleepNs(std::int64_t ns) {
  if (ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(ns));
}

/// The start of every call that talks to the device; 0, or -1 as the call has to return.
int talk(char id) {
  if (!library.open || id != kId) return fail(kNoDevice);
  if (has(hapticd::test::kArmUnplugged)) return fail(kCom);
  if (has(hapticd::test::kArmSlow)) sleepNs(30'000'000);
  while (has(hapticd::test::kArmHangs)) sleepNs(1'000'000);
  return 0;
}

/// What the firmware does about the force by itself.
void keepForce() {
  if (arm().watchdog_trips != library.trips) {
    library.trips = arm().watchdog_trips;
    library.cause = 3;
  }
  const bool cut = has(hapticd::test::kArmForceCut);
  if (cut && !library.cut) {
    library.cause = arm().cut_cause;
    arm().force_on = false;
  }
  const bool by_button = library.cause == 1;
  if (!cut && library.cut && by_button) {  // the person has pressed it again
    arm().force_ns = hapticd::rt::monotonicNow_ns();
    arm().force_on = true;
  }
  library.cut = cut;
}

int model() {
  return arm().model == 0 ? static_cast<int>(kOmega3) : arm().model.load();
}

int openIt() {
  const char* path = std::getenv(hapticd::test::kArmVariable);
  if (path == nullptr) return fail(kNoDevice);
  library = Library{};
  library.mapped = std::make_unique<MappedArm>(path, false);
  if (has(hapticd::test::kArmUnplugged)) return fail(kNoDevice);
  if (has(hapticd::test::kArmBusy)) return fail(kInUse);
  library.open = true;
  library.trips = arm().watchdog_trips;
  ++arm().openings;
  return kId;
}

int setForce(const std::array<double, 3>& force_n, const std::array<double, 3>& torque_n_m,
             double gripper_n) {
  for (std::size_t i = 0; i < 3; ++i) {
    arm().force_n[i] = force_n[i];
    arm().torque_n_m[i] = torque_n_m[i];
  }
  arm().gripper_force_n = gripper_n;
  arm().force_ns = hapticd::rt::monotonicNow_ns();
  ++arm().forces;
  return has(hapticd::test::kArmSaturated) ? kSaturated : 0;
}

}  // namespace

extern "C" {

// As in some libraries of vendors, a function that nobody calls needs what is nowhere.
void functionThatIsNowhere();
void dhdFunctionThatNobodyCalls() {
  functionThatIsNowhere();
}

void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
  const char* path = std::getenv(hapticd::test::kArmVariable);
  const bool wrong =
      path != nullptr && (MappedArm(path, false).memory().faults & hapticd::test::kArmWrongVersion) != 0;
  *major = wrong ? 2 : 3;
  *minor = wrong ? 1 : 99;
  *release = *revision = 0;
}
int dhdGetDeviceCount() {
  return library.mapped && !has(hapticd::test::kArmUnplugged) ? 1 : 0;
}
int dhdOpen() {
  return openIt();
}
int dhdOpenSerial(int serial) {
  return serial == kSerial ? openIt() : fail(kNoDevice);
}
int dhdClose(char id) {
  if (!library.open || id != kId) return fail(kNoDevice);
  library.open = false;
  return 0;
}
int dhdStop(char id) {
  if (!library.open || id != kId) return fail(kNoDevice);
  arm().force_on = false;
  arm().brakes = true;
  return 0;
}
const char* dhdGetSystemName(char id) {
  return id == kId ? "emulated device" : nullptr;
}
int dhdGetSystemType(char id) {
  return id == kId ? model() : -1;
}
int dhdGetSerialNumber(unsigned short* serial, char id) {
  if (id != kId) return fail(kNoDevice);
  *serial = kSerial;
  return 0;
}
int dhdGetStatus(int* status, char id) {
  if (talk(id) < 0) return -1;
  keepForce();
  const bool lost = has(hapticd::test::kArmNotCalibrated);
  const bool wrist = model() != kOmega3 && model() != kDelta3;
  const std::array<int, 17> values{1,
                                   1,
                                   1,
                                   lost ? 1 : 0,
                                   0,
                                   arm().force_on ? 1 : 0,
                                   arm().brakes ? 1 : 0,
                                   0,
                                   wrist ? 1 : 0,
                                   0,
                                   1,
                                   1,
                                   wrist && !lost ? 1 : 0,
                                   0,
                                   library.cause,
                                   -1,
                                   0};
  for (std::size_t i = 0; i < values.size(); ++i) status[i] = values[i];
  return 0;
}
bool dhdHasWrist(char id) {
  return id == kId && model() != kOmega3 && model() != kDelta3;
}
bool dhdHasActiveWrist(char id) {
  return id == kId && model() == kSigma7;
}
bool dhdHasGripper(char id) {
  return id == kId && (model() == kSigma7 || model() == kOmega7);
}
bool dhdHasActiveGripper(char id) {
  return dhdHasGripper(id);
}
int dhdEnableExpertMode() {
  library.expert = true;
  return 0;
}
#ifndef HAPTICD_FAKE_WITHOUT_WATCHDOG
int dhdSetWatchdog(unsigned char units, char id) {
  if (talk(id) < 0) return -1;
  if (!library.expert) return fail(kNotExpert);
  library.watchdog = has(hapticd::test::kArmNoWatchdog) ? 0 : units;
  arm().watchdog_ns = library.watchdog * 125'000;
  arm().watchdog_latches = true;
  return 0;
}
#endif
int dhdGetWatchdog(unsigned char* units, char id) {
  if (talk(id) < 0) return -1;
  *units = library.watchdog;
  return 0;
}
int dhdSetMaxForce(double, char id) {
  return talk(id);
}
int dhdSetGravityCompensation(int, char id) {
  return talk(id);
}
int dhdSetBrakes(int on, char id) {
  if (talk(id) < 0) return -1;
  arm().brakes = on != 0;
  return 0;
}
int dhdEnableForce(unsigned char on, char id) {
  if (talk(id) < 0) return -1;
  keepForce();
  arm().force_ns = hapticd::rt::monotonicNow_ns();
  arm().force_on = on != 0 && !library.cut;
  return 0;
}
int dhdGetPosition(double* x, double* y, double* z, char id) {
  if (talk(id) < 0) return -1;
  // three of four calls come too early for the time guard
  const bool repeats = has(hapticd::test::kArmRepeats) && ++library.positions % 4 != 0;
  if (!repeats) {
    for (std::size_t i = 0; i < 3; ++i) library.position[i] = arm().position_m[i];
    if (!has(hapticd::test::kArmRepeats)) ++library.positions;
    sleepNs(arm().extra_delay_ns);
  }
  *x = library.position[0] + (has(hapticd::test::kArmJump) ? 0.3 : 0);
  *y = has(hapticd::test::kArmNotFinite) ? std::nan("") : library.position[1];
  *z = library.position[2];
  return repeats ? kTimeGuard : 0;
}
int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double (*rotation)[3], char id) {
  const double qx = library.mapped ? arm().orientation[0].load() : 0;
  const double qy = library.mapped ? arm().orientation[1].load() : 0;
  const double qz = library.mapped ? arm().orientation[2].load() : 0;
  const double qw = library.mapped ? arm().orientation[3].load() : 1;
  const double rows[3][3] = {{1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qz * qw), 2 * (qx * qz + qy * qw)},
                             {2 * (qx * qy + qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qx * qw)},
                             {2 * (qx * qz - qy * qw), 2 * (qy * qz + qx * qw), 1 - 2 * (qx * qx + qy * qy)}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) rotation[i][j] = rows[i][j];
  return dhdGetPosition(x, y, z, id);
}
int dhdGetGripperAngleRad(double* angle, char id) {
  if (talk(id) < 0) return -1;
  *angle = arm().gripper_rad;
  return dhdHasGripper(id) ? 0 : fail(kNoFunction);
}
unsigned int dhdGetButtonMask(char id) {
  return talk(id) < 0 ? 0 : arm().buttons.load();
}
int dhdSetForce(double x, double y, double z, char id) {
  return talk(id) < 0 ? -1 : setForce({x, y, z}, {}, 0);
}
int dhdSetForceAndTorque(double x, double y, double z, double tx, double ty, double tz, char id) {
  return talk(id) < 0 ? -1 : setForce({x, y, z}, {tx, ty, tz}, 0);
}
int dhdSetForceAndTorqueAndGripperForce(double x, double y, double z, double tx, double ty, double tz,
                                        double gripper, char id) {
  return talk(id) < 0 ? -1 : setForce({x, y, z}, {tx, ty, tz}, gripper);
}
int dhdErrorGetLast() {
  return error_;
}
const char* dhdErrorGetLastStr() {
  switch (error_) {
    case kCom:
      return "no communication";
    case kNoDevice:
      return "no device";
    case kTimeout:
      return "too early";
    case kNotExpert:
      return "experts only";
    case kInUse:
      return "in use";
    default:
      return "another error";
  }
}

}  // extern "C"
