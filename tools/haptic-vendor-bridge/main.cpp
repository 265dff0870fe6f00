// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/program.h"
#include "tools/haptic-vendor-bridge/calibrate_command.h"
#include "tools/haptic-vendor-bridge/device_rows.h"
#include "tools/haptic-vendor-bridge/inverse3/service_link.h"
#include "tools/haptic-vendor-bridge/phantom_omni/gain_measurement.h"
#include "tools/lib/bridge/bridge_program.h"
#include "tools/lib/device/threaded_device.h"
#include "tools/lib/device_check/check_command.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools {
namespace {

constexpr const char* kName = "haptic-vendor-bridge";

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

CLI::Option& addDevice(CLI::App& app, std::string& kind, VendorOptions& options) {
  CLI::Option& choice = *app.add_option("kind", kind, "kind of the device, one of those above");
  choice.type_name("KIND")->check(CLI::IsMember(kindWords()));
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
  return choice;
}

std::unique_ptr<DeviceDriver> driverOf(const std::string& kind, const VendorOptions& options) {
  const auto rows = deviceRows();
  return std::ranges::find(rows, kind, &DeviceRow::word)->make(options);
}

int runCheck(int argc, char** argv) {
  CLI::App app{
      "haptic-vendor-bridge check: leads you through a check of a device, without a hapticd: axes, signs,\n"
      "a push of 0.3 N along each axis, latency, and that the force ends when commands stop. It prints the\n"
      "angles of the handle's pose for hapticd.yaml and writes a log to send in. Kinds of devices:" +
          kindsText(),
      "haptic-vendor-bridge check"};
  app.footer(
      "Exit status: 0 nothing wrong, 64 usage, 65 not a log, 66 no log, 69 a problem was found,\n"
      "71 no thread, 73 no log written.");
  CheckOptions check{.program = kName, .version = HAPTICD_VERSION};
  VendorOptions options;
  CLI::Option& kind = addDevice(app, check.kind, options);
  app.add_option("--log", check.log,
                 "the log to write; one of the same name is replaced (haptic-check-KIND.json)")
      ->type_name("FILE");
  CLI::Option* read =
      app.add_option("--read", check.read, "print a log that was written before")->type_name("FILE");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  if (read->count() > 0) return printLog(check);
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
      "haptic-vendor-bridge calibrate phantom-omni: leads you through the measurement of the torque that\n"
      "each motor of a Phantom Omni has for a count, with a known mass, a string and a pulley, and of what\n"
      "it does when packets stop. Without that the device exerts no force. The result is stored by serial\n"
      "number.",
      "haptic-vendor-bridge calibrate"};
  app.footer(
      "The calibration is in --calibration, else in phantom-omni-SERIAL.json in $STATE_DIRECTORY, in\n"
      "$XDG_STATE_HOME/haptic-vendor-bridge or in ~/.local/state/haptic-vendor-bridge.\n"
      "Exit status: 0 stored, 64 usage, 69 the device cannot be used or a measurement is implausible,\n"
      "73 it cannot be written.");
  CalibrateOptions options;
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
  return calibratePhantomOmni(options);
}

int run(int argc, char** argv) {
  if (argc > 1 && argv[1] == std::string_view("check")) return runCheck(argc - 1, argv + 1);
  if (argc > 1 && argv[1] == std::string_view("calibrate")) return runCalibrate(argc - 1, argv + 1);
  CLI::App app{
      "haptic-vendor-bridge: connects a haptic device that is driven by the library or service of its\n"
      "vendor to a hapticd with `handle.driver: udp`, on this computer or another. Nothing of a vendor is\n"
      "part of it: it uses what is installed. 'haptic-vendor-bridge check --help' says how to try a device\n"
      "first, 'haptic-vendor-bridge calibrate --help' how to measure the motors of a phantom-omni.\n"
      "Kinds of devices:" +
      kindsText()};
  app.footer(
      "Ctrl-C ends it, with the table. Without --duration it runs until then. A device that is missing or\n"
      "lost is opened again each second.\n"
      "Exit status: 0 done, 64 usage, 66 no key, 69 the local address cannot be used, 73 no log.");
  std::string kind;
  VendorOptions options;
  addDevice(app, kind, options).required();
  BridgeProgram program(app, kName, BridgeDamping::never);
  app.set_version_flag("-V,--version", fmt::format("{} {}", kName, HAPTICD_VERSION));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  ThreadedDevice device(driverOf(kind, options), kName);
  return program.run(device, [&device] { return device.start(); });
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::base::runProgram(hapticd::tools::kName, [&] { return hapticd::tools::run(argc, argv); });
}
