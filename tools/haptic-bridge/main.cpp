// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/program.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "rt/base/clock.h"
#include "rt/base/realtime_thread.h"
#include "tools/haptic-bridge/base/device_rows.h"
#include "tools/haptic-bridge/inverse3/service_link.h"
#include "tools/haptic-bridge/phantom_omni/calibration.h"
#include "tools/lib/bridge/bridge_program.h"
#include "tools/lib/bridge/device.h"
#include "tools/lib/device/threaded_device.h"
#include "tools/lib/device_check/device_check.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools {
namespace {

constexpr const char* kName = "haptic-bridge";
/// The name under which it was a program for the devices of vendors alone.
constexpr const char* kOldName = "haptic-vendor-bridge";
constexpr const char* kSimulated = "simulated";
/// What only the simulated hand has, and what only the devices of vendors have.
constexpr std::array kOfTheHand{"--start",       "--direction",   "--travel",    "--speed",
                                "--press-force", "--max-damping", "--no-damping"};
constexpr std::array kOfVendors{"--library", "--device", "--address", "--calibration"};

std::vector<std::string> kindWords() {
  std::vector<std::string> words;
  for (const DeviceRow& row : deviceRows()) words.emplace_back(row.word);
  return words;
}

std::string kindsText() {
  std::string text;
  for (const DeviceRow& row : deviceRows()) text += fmt::format("\n  {:<16} {}", row.word, row.help);
  return text;
}

/// The options by which a device of a vendor is found.
void addVendorOptions(CLI::App& app, VendorOptions& options) {
  app.add_option("--library", options.library, "the vendor's library (where the vendor installs it)")
      ->type_name("FILE")
      ->check(CLI::Validator(CLI::ExistingFile).description(""));
  app.add_option("--device", options.device, "name or serial number of the device (the first one)")
      ->type_name("NAME");
  const auto endpointError = [](std::string& text) {
    const auto endpoint = inverse3::serviceEndpointFrom(text);
    return endpoint ? std::string() : fmt::format("{}, {}", endpoint.error().what, endpoint.error().remedy);
  };
  app.add_option("--address", options.address, "of the vendor's service (the usual one)")
      ->type_name("ADDRESS:PORT")
      ->check(CLI::Validator(endpointError, ""));
  app.add_option("--calibration", options.calibration,
                 "of the motors of a phantom-omni (by serial number, where 'calibrate' puts it)")
      ->type_name("FILE");
}

CLI::Option& addKind(CLI::App& app, std::string& kind, const std::vector<std::string>& words) {
  CLI::Option& choice = *app.add_option("kind", kind, "kind of the device, one of those above");
  choice.type_name("KIND")->check(CLI::IsMember(words));
  return choice;
}

/// A drivers::SimulatedHand in real time: between two readings it moves by the whole steps that
/// have passed, at most kMaxCatchUpNs.
class SimulatedDevice final : public Device {
 public:
  static constexpr std::int64_t kStepNs = 250'000;
  static constexpr std::int64_t kMaxCatchUpNs = 50'000'000;

  /// The settings are taken to be in the device's frame.
  explicit SimulatedDevice(const drivers::SimulatedHandleSettings& settings)
      : hand_(settings, static_cast<double>(kStepNs) * 1e-9) {}

  DeviceReading read() override {
    const std::int64_t now_ns = rt::monotonicNow_ns();
    if (moved_to_ns_ == 0) moved_to_ns_ = now_ns;
    moved_to_ns_ = std::max(moved_to_ns_, now_ns - kMaxCatchUpNs);
    for (; now_ns - moved_to_ns_ >= kStepNs; moved_to_ns_ += kStepNs) hand_.step(force_n_);
    DeviceReading reading;
    reading.position_m = hand_.position_m_in_world();
    reading.velocity_m_per_s = hand_.velocity_m_per_s_in_world();
    reading.velocity_valid = true;
    reading.orientation = hand_.orientation_in_world();
    reading.gripper_rad = hand_.gripper_rad();
    return reading;
  }
  void exert(const DeviceCommand& command) override { force_n_ = command.force_n; }
  DeviceLimits limits() const override { return {.force_n = 100}; }

 private:
  drivers::SimulatedHand hand_;
  rt::Vec3 force_n_;
  std::int64_t moved_to_ns_ = 0;
};

/// The options of the simulated hand. CLI11 wants places of their own for options of several numbers.
struct HandOptions {
  drivers::SimulatedHandleSettings hand;
  std::vector<double> start;
  std::vector<double> direction;
};

void addHandOptions(CLI::App& app, HandOptions& options) {
  drivers::SimulatedHandleSettings& hand = options.hand;
  app.add_option("--start", options.start, "where the simulated hand begins, handle frame (0,0,-0.8)")
      ->type_name("X,Y,Z")
      ->delimiter(',')
      ->expected(3)
      ->check(within(-10.0, 10.0));
  app.add_option("--direction", options.direction, "where the simulated hand moves (0,0,-1)")
      ->type_name("X,Y,Z")
      ->delimiter(',')
      ->expected(3)
      ->check(within(-1.0, 1.0));
  app.add_option("--travel", hand.travel_m, "how far the simulated hand moves, metres (0.4)")
      ->type_name("METRES")
      ->check(within(0.0, 10.0));
  app.add_option("--speed", hand.speed_m_per_s, "how fast the simulated hand moves, m/s (0.1)")
      ->type_name("SPEED")
      ->check(within(0.001, 5.0));
  app.add_option("--press-force", hand.press_force_n, "how hard the simulated hand presses, N (2)")
      ->type_name("NEWTONS")
      ->check(within(0.0, 50.0));
}

/// The first of these options that was given; null: none was.
const char* givenOf(const CLI::App& app, std::span<const char* const> options) {
  const auto given = std::ranges::find_if(options, [&](const char* option) { return app.count(option) > 0; });
  return given == options.end() ? nullptr : *given;
}

std::unique_ptr<DeviceDriver> driverOf(const std::string& kind, const VendorOptions& options) {
  const auto rows = deviceRows();
  return std::ranges::find(rows, kind, &DeviceRow::word)->make(options);
}

int runCheck(int argc, char** argv) {
  CLI::App app{
      "haptic-bridge check: leads you through a check of a device, without a hapticd: axes, signs,\n"
      "a push of 0.3 N along each axis, latency, and that the force ends when commands stop. It prints the\n"
      "angles of the handle's pose for hapticd.yaml and writes a log to send in. Kinds of devices:" +
          kindsText(),
      "haptic-bridge check"};
  app.footer(
      "Exit status: 0 nothing wrong, 64 usage, 65 not a log, 66 no log, 69 a problem was found,\n"
      "71 no thread, 73 no log written.");
  CheckOptions check{.program = kName, .version = HAPTICD_VERSION};
  VendorOptions options;
  CLI::Option& kind = addKind(app, check.kind, kindWords());
  addVendorOptions(app, options);
  if (const auto status = parseCheck(app, check, argc, argv)) return *status;
  if (kind.count() == 0) {
    fmt::print(stderr, "{}: name the kind of the device, one of:{}\n", kName, kindsText());
    return EX_USAGE;
  }
  ThreadedDevice device(driverOf(check.kind, options), kName);
  return checkDevice(check, device);
}

int runCalibrate(int argc, char** argv) {
  using phantom_omni::GainMeasurement;
  CLI::App app{
      "haptic-bridge calibrate phantom-omni: leads you through the measurement of the torque that\n"
      "each motor of a Phantom Omni has for a count, with a known mass, a string and a pulley, and of what\n"
      "it does when packets stop. Without that the device exerts no force. The result is stored by serial\n"
      "number.",
      "haptic-bridge calibrate"};
  app.footer(
      "The calibration is in --calibration, else in phantom-omni-SERIAL.json in $STATE_DIRECTORY, in\n"
      "$XDG_STATE_HOME/haptic-vendor-bridge or in ~/.local/state/haptic-vendor-bridge.\n"
      "Exit status: 0 stored, 64 usage, 69 the device cannot be used or a measurement is implausible,\n"
      "73 it cannot be written.");
  phantom_omni::CalibrateOptions options;
  options.mass_kg = GainMeasurement::kUsualMass_kg;
  std::string kind;
  app.add_option("kind", kind, "phantom-omni")
      ->required()
      ->type_name("KIND")
      ->check(CLI::IsMember(std::vector<std::string>{"phantom-omni"}).description(""));
  app.add_option("--mass", options.mass_kg, "that hangs from the stylus, kg (0.1)")
      ->type_name("KG")
      ->check(within(GainMeasurement::kLeastMass_kg, GainMeasurement::kMostMass_kg));
  app.add_option("--device", options.serial, "serial number of the device (the first one)")
      ->type_name("NAME");
  app.add_option("--calibration", options.file, "the file to write; one of the same name is replaced")
      ->type_name("FILE");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  return phantom_omni::calibratePhantomOmni(options);
}

int runSimulated(BridgeProgram& program, HandOptions& options) {
  drivers::SimulatedHandleSettings& hand = options.hand;
  if (!options.start.empty()) hand.start_m_in_world = BridgeProgram::vectorOf(options.start);
  if (!options.direction.empty()) hand.direction_in_world = BridgeProgram::vectorOf(options.direction);
  if (!(norm(hand.direction_in_world) > 0))
    return program.fail({"--direction", "(0, 0, 0) is not a direction", ""}, EX_USAGE);
  rt::limitThreadStacks();
  SimulatedDevice device(hand);
  return program.run(device);
}

int run(int argc, char** argv) {
  if (argc > 1 && argv[1] == std::string_view("check")) return runCheck(argc - 1, argv + 1);
  if (argc > 1 && argv[1] == std::string_view("calibrate")) return runCalibrate(argc - 1, argv + 1);
  CLI::App app{
      "haptic-bridge: connects a haptic device to a hapticd with `handle.driver: udp`, on this computer or\n"
      "another. A device of a vendor is driven by its library or service, as installed: nothing of a vendor\n"
      "is part of this program. 'haptic-bridge check --help' says how to try such a device first,\n"
      "'haptic-bridge calibrate --help' how to measure the motors of a phantom-omni. At the end it prints\n"
      "statistics of the packets: run it for a minute to measure a network. Kinds of devices:\n"
      "  simulated        a hand that moves forward until it feels the press force, strokes, and goes back;\n"
      "                   without a kind it is this one" +
      kindsText()};
  app.footer(
      "Ctrl-C ends it, with the table. Without --duration it runs until then. A device that is missing or\n"
      "lost is opened again each second.\n"
      "Exit status: 0 done, 64 usage, 66 no key, 69 the local address cannot be used, 73 no log.");
  std::string kind = kSimulated;
  std::vector<std::string> words = kindWords();
  words.insert(words.begin(), kSimulated);
  // without a kind, the program of the old name does not become a simulated hand
  addKind(app, kind, words).required(std::filesystem::path(argv[0]).filename() == kOldName);
  BridgeProgram program(app, kName, BridgeDamping::offered);
  HandOptions hand;
  addHandOptions(app, hand);
  VendorOptions vendor;
  addVendorOptions(app, vendor);
  app.set_version_flag("-V,--version", fmt::format("{} {}", kName, HAPTICD_VERSION));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  const bool simulated = kind == kSimulated;
  if (const char* other = simulated ? givenOf(app, kOfVendors) : givenOf(app, kOfTheHand)) {
    return program.fail({other, fmt::format("is not an option of the kind {}", kind), "leave it out"},
                        EX_USAGE);
  }
  if (simulated) return runSimulated(program, hand);
  program.leaveDamping();
  ThreadedDevice device(driverOf(kind, vendor), kName);
  return program.run(device, [&device] { return device.start(); });
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::base::runProgram(hapticd::tools::kName, [&] { return hapticd::tools::run(argc, argv); });
}
