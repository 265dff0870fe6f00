// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "config/base/program.h"
#include "tests/vm/emulators/usbip/emulator.h"
#include "tests/vm/emulators/usbip/emulator_program.h"
#include "tests/vm/emulators/uvc/uvc_device.h"

namespace hapticd::test::uvc {
namespace {

struct Options {
  std::string model = "d435";
  std::string serial;
  std::string control;
};

constexpr const char* kProgram = "emulated-depth-camera";

int emulate(const Options& options) {
  CameraModel model = *modelNamed(options.model);
  if (!options.serial.empty()) model.serial = options.serial;
  const usbip::Log log = [&model](std::string_view line) {
    std::fputs(fmt::format("{} {}: {}\n", kProgram, model.serial, line).c_str(), stderr);
  };
  const int stop = usbip::stopSignals();
  UvcDevice device(model, log);
  usbip::Emulator emulator(device, {usbip::kVhciFolder, options.control}, log);
  const auto served = emulator.run(stop);
  ::close(stop);
  return served ? EX_OK : usbip::fail(kProgram, served.error(), EX_UNAVAILABLE);
}

int run(int argc, char** argv) {
  CLI::App app{
      "emulated-depth-camera: a depth camera of the USB video class on a port of vhci_hcd, until SIGTERM.\n"
      "Needs root and the kernel module vhci_hcd (modprobe vhci_hcd)."};
  app.footer("Exit status: 0 done, 64 usage, 69 no port.");
  Options options;
  app.add_option("--model", options.model, "d435 or gemini335 (d435)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"d435", "gemini335"}));
  app.add_option("--serial", options.serial, "serial number of the USB device (the model's)")
      ->type_name("TEXT");
  app.add_option("--control", options.control, "Unix socket that takes commands")->type_name("PATH");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  return emulate(options);
}

}  // namespace
}  // namespace hapticd::test::uvc

int main(int argc, char** argv) {
  return hapticd::base::runProgram(hapticd::test::uvc::kProgram,
                                   [&] { return hapticd::test::uvc::run(argc, argv); });
}
