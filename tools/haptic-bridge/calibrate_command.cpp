// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/calibrate_command.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <chrono>
#include <thread>

#include "tools/haptic-bridge/phantom_omni/gain_measurement.h"
#include "tools/haptic-bridge/phantom_omni/linked_arm.h"
#include "tools/lib/device_check/person_at_terminal.h"

namespace hapticd::tools {
namespace {

using phantom_omni::GainMeasurement;
using phantom_omni::LinkedArm;
using phantom_omni::OmniCalibration;

int failed(const base::Error& error, int status) {
  fmt::print(stderr, "haptic-bridge: {}\n", error.text());
  return status;
}

base::Result<void> awaitDocked(LinkedArm& arm, Person& person) {
  constexpr auto kLook = std::chrono::milliseconds(50);
  constexpr auto kMost = std::chrono::seconds(120);
  person.say("Put the stylus into the inkwell, and wait.");
  for (const auto until = std::chrono::steady_clock::now() + kMost; std::chrono::steady_clock::now() < until;
       std::this_thread::sleep_for(kLook)) {
    const auto known = arm.knowsPosition();
    if (!known) return std::unexpected(known.error());
    if (*known) return {};
    if (person.givesUp()) return std::unexpected(base::Error{"calibration", "was given up", ""});
  }
  return std::unexpected(base::Error{"Phantom Omni", "was not docked within 120 s", ""});
}

base::Result<OmniCalibration> measure(const CalibrateOptions& options, Person& person) {
  const auto arm = LinkedArm::open(options.serial);
  if (!arm) return std::unexpected(arm.error());
  person.say(fmt::format(
      "Phantom Omni, serial number {}. Its motors will move the arm: keep hands off it unless you are "
      "asked to touch it.",
      (*arm)->serial()));
  if (auto ok = awaitDocked(**arm, person); !ok) return std::unexpected(ok.error());
  auto calibration = GainMeasurement(**arm, person, options.mass_kg).run();
  if (calibration) calibration->serial = (*arm)->serial();
  return calibration;
}

}  // namespace

int calibratePhantomOmni(const CalibrateOptions& options) {
  const Interrupt interrupt;  // no signal ends the program before the device is without force
  PersonAtTerminal person(interrupt);
  const auto calibration = measure(options, person);
  if (!calibration) return failed(calibration.error(), EX_UNAVAILABLE);
  const auto file = phantom_omni::calibrationFile(options.file, calibration->serial);
  if (!file) return failed(file.error(), EX_CANTCREAT);
  if (auto ok = phantom_omni::storeCalibration(*file, *calibration); !ok)
    return failed(ok.error(), EX_CANTCREAT);
  person.say(fmt::format("calibration written to {}", file->string()));
  if (calibration->releases_without_packets) return EX_OK;
  return failed(
      {"Phantom Omni",
       "keeps its torque when packets stop: nothing could end the force of a program that was killed",
       "it is of use without forces only"},
      EX_UNAVAILABLE);
}

}  // namespace hapticd::tools
