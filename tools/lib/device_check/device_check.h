// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "tools/lib/bridge/device.h"
#include "tools/lib/device/threaded_device.h"
#include "tools/lib/device_check/check_report.h"
#include "tools/lib/device_check/person.h"

namespace hapticd::tools {

/// The time by which the check drives the device; that of CLOCK_MONOTONIC unless a test has its own.
class CheckClock {
 public:
  virtual ~CheckClock() = default;
  virtual std::int64_t now_ns();
  virtual void sleepUntil(std::int64_t when_ns);
};

/// One reading while the check drives the device.
struct CheckSample {
  double time_s = 0;  ///< since the drive began
  rt::Vec3 position_m;
};

/// A push, in the device's axes.
struct Push {
  rt::Vec3 direction;          ///< that was commanded, of length 1
  rt::Vec3 moved_m;            ///< by it, where it was farthest from its start
  rt::Quaternion orientation;  ///< of the tool
};

/// Leads a person through axes, direction of the force, latency and dead man of a device, with at most
/// kForce_n. Thread: one.
class DeviceCheck {
 public:
  static constexpr double kForce_n = 0.3;
  static constexpr double kMinMove_m = 0.02;   ///< of a movement that shows an axis
  static constexpr double kMinYield_m = 5e-4;  ///< of a handle that goes where a force pushes
  static constexpr double kReady_s = 120;      ///< for opening, initialising and calibrating

  /// `turns_tool`: whether a person is asked to turn the tool of a device that measures its orientation.
  DeviceCheck(Device& device, Person& person, CheckClock& clock, bool turns_tool = false)
      : device_(device), person_(person), clock_(clock), turns_tool_(turns_tool) {}

  /// Fills what it finds into `report`.
  /// Errors: the device is not ready in time or was lost, the person gave up.
  base::Result<void> run(CheckReport& report);

 private:
  base::Result<void> waitUntilReady();
  base::Result<void> checkAxes(CheckReport& report);
  base::Result<void> checkForces(CheckReport& report);
  base::Result<void> checkTurnedForces(CheckReport& report, std::vector<Push> pushes);
  base::Result<void> measureTimes(CheckReport& report);
  base::Result<rt::Vec3> place();
  /// Pushes for a second, and says before where to.
  base::Result<Push> push(const rt::Vec3& direction, const std::string& words);
  /// Commands `force(time)` each millisecond for `duration_s`; where it returns nothing, no command is given.
  base::Result<std::vector<CheckSample>> drive(double duration_s,
                                               const std::function<std::optional<rt::Vec3>(double)>& force);

  Device& device_;
  Person& person_;
  CheckClock& clock_;
  bool turns_tool_;
};

/// Along which axes the pushes went. Each that moved the handle has to agree, and to differ from the other
/// ones somewhere.
ForceAxes forceAxesOf(std::span<const Push> pushes);

/// The person's axes in the device's frame from three movements (right, up, towards the person): a rotation
/// whose rows are the device's axes with their signs, which maps vectors of the device to the world where the
/// person looks along -z. Nothing: a movement is too short or not along one axis, or the axes are not
/// right-handed.
std::optional<std::array<double, 9>> rotationFrom(const std::array<rt::Vec3, 3>& movements_m);

/// When a force along `direction` began to act.
struct Onset {
  double time_s = 0;  ///< of the samples
  double acceleration_m_per_s2 = 0;
};

/// The onset after `from_s` at which  p + v t + a (t - t0)^2 / 2, with the last term only after t0, fits
/// best. Nothing: nothing accelerates the handle there.
std::optional<Onset> onsetOf(std::span<const CheckSample> samples, const rt::Vec3& direction, double from_s);

struct CheckOptions {
  std::string program;    ///< whose command this is
  std::string version;    ///< of the program
  std::string kind = {};  ///< of the device
  std::string log = {};   ///< the file to write; empty: haptic-check-KIND.json in this folder
  std::string read = {};  ///< a log to print instead of checking a device; empty: check one
  /// What to do about forces along such axes, whole sentences; may be empty. Where it is given, the person
  /// turns the tool for pushes in other orientations, if the device measures them.
  std::function<std::string(ForceAxes)> remedy = {};
};

/// Adds --log and --read to the command `check` of a bridge, parses its command line, and prints a log that
/// is to be read. Returns the exit status where nothing is left to do; nothing: a device is to be checked.
std::optional<int> parseCheck(CLI::App& app, CheckOptions& options, int argc, char** argv);

/// Starts a device, leads the person at the terminal through the check of a device and writes its log.
/// Returns the exit status.
int checkDevice(const CheckOptions& options, ThreadedDevice& device);

}  // namespace hapticd::tools
