// SPDX-License-Identifier: Apache-2.0
// A haptic device and the software of its vendor, emulated, to try haptic-bridge by hand: see
// README.md.
#include <fmt/format.h>
#include <poll.h>
#include <sysexits.h>
#include <unistd.h>

#include <cmath>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>

#include "tests/support/temporary_folder.h"
#include "tests/vendor_devices/emulated_arm.h"
#include "tests/vendor_devices/fake_inverse_service.h"
#include "tools/lib/child/child_process.h"

namespace hapticd::test {
namespace {

constexpr const char* kUsage =
    "usage: emulated-handle force-dimension|openhaptics|inverse3\n"
    "Prints how to start haptic-bridge on an emulated device, whose hand moves 40 mm to and fro along "
    "-z\n"
    "and presses with 2 N where something holds it. Standard input: 'unplug', 'plug', 'forget' (it has lost "
    "its\n"
    "calibration), 'dock' (which calibrates it), 'warm' (its motors are), 'quit'.\n";

drivers::SimulatedHandleSettings movingHand() {
  drivers::SimulatedHandleSettings hand;
  hand.start_m_in_world = {0, 0, 0.02};
  hand.direction_in_world = {0, 0, -1};
  hand.travel_m = 0.04;
  hand.speed_m_per_s = 0.03;
  return hand;
}

class Emulation {
 public:
  virtual ~Emulation() = default;
  virtual std::string command() const = 0;
  virtual double exerted_n() = 0;
  /// Returns whether the word was understood.
  virtual bool take(std::string_view word) = 0;
};

class EmulatedLibrary final : public Emulation {
 public:
  EmulatedLibrary(std::string kind, std::string library, int model)
      : kind_(std::move(kind)), library_(std::move(library)) {
    arm_.memory().model = model;
    arm_.setFaults(kArmNotCalibrated);
  }
  std::string command() const override {
    return fmt::format("{}={} {} {} --library {}", kArmVariable, (folder_.path() / "arm").string(),
                       HAPTIC_BRIDGE_PROGRAM, kind_, library_);
  }
  double exerted_n() override { return arm_.memory().exerted_n; }
  bool take(std::string_view word) override {
    if (word == "unplug") return set(kArmUnplugged);
    if (word == "plug") return set(0);
    if (word == "warm") return set(kArmWarm);
    if (word == "forget") {
      arm_.memory().docked = false;
      return set(kArmNotCalibrated);
    }
    if (word != "dock") return false;
    arm_.memory().docked = true;
    return kind_ == "openhaptics" || set(0);  // Force Dimension's own program initialises its devices
  }

 private:
  bool set(std::uint32_t faults) {
    arm_.setFaults(faults);
    return true;
  }

  std::string kind_;
  std::string library_;
  TemporaryFolder folder_;
  EmulatedArm arm_{folder_.path() / "arm", movingHand()};
};

class EmulatedService final : public Emulation {
 public:
  EmulatedService() { service_.setFaults(kNotCalibrated); }
  std::string command() const override {
    return fmt::format("{} inverse3 --address {}", HAPTIC_BRIDGE_PROGRAM, service_.address());
  }
  double exerted_n() override { return norm(service_.record().exerted_n); }
  bool take(std::string_view word) override {
    if (word == "unplug") return set(kUnplugged);
    if (word == "forget") return set(kNotCalibrated);
    return (word == "plug" || word == "dock") && set(0);
  }

 private:
  bool set(std::uint32_t faults) {
    service_.setFaults(faults);
    return true;
  }

  FakeInverseService service_{{.hand = movingHand()}};
};

std::unique_ptr<Emulation> emulationOf(std::string_view kind) {
  if (kind == "force-dimension")
    return std::make_unique<EmulatedLibrary>("force-dimension", HAPTICD_FAKE_DRD, 35);
  if (kind == "openhaptics") return std::make_unique<EmulatedLibrary>("openhaptics", HAPTICD_FAKE_HD, 0);
  if (kind == "inverse3") return std::make_unique<EmulatedService>();
  return nullptr;
}

/// Shows the force when it changes, and takes words while there are any, until 'quit' or a signal.
void converse(Emulation& emulation) {
  double shown_n = -1;
  int input = STDIN_FILENO;
  const tools::Interrupt interrupt;
  while (!interrupt.requested()) {
    const double now_n = emulation.exerted_n();
    if (std::abs(now_n - shown_n) > 0.05) {
      fmt::print("exerts {:.1f} N\n", now_n);
      shown_n = now_n;
    }
    std::cout.flush();
    constexpr int kBetweenMs = 100;
    constexpr int kNone = -1;  // poll() leaves it out
    pollfd watched{input, POLLIN, 0};
    if (::poll(&watched, 1, kBetweenMs) <= 0) continue;
    std::string word;
    if (!std::getline(std::cin, word)) {
      input = kNone;
      continue;
    }
    if (word == "quit") return;
    if (!emulation.take(word)) fmt::print("'{}' is not known here\n{}", word, kUsage);
  }
}

int run(int argc, char** argv) {
  const std::unique_ptr<Emulation> emulation = argc == 2 ? emulationOf(argv[1]) : nullptr;
  if (!emulation) {
    fmt::print(stderr, "{}", kUsage);
    return EX_USAGE;
  }
  fmt::print("{}\n", emulation->command());
  converse(*emulation);
  return EX_OK;
}

}  // namespace
}  // namespace hapticd::test

int main(int argc, char** argv) {
  return hapticd::test::run(argc, argv);
}
