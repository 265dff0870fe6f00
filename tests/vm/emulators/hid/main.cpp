// SPDX-License-Identifier: Apache-2.0
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "config/base/program.h"
#include "tests/vm/emulators/hid/hid_emulator.h"
#include "tests/vm/emulators/hid/hid_link.h"
#include "tests/vm/emulators/usbip/emulator_program.h"

namespace hapticd::test::hid {
namespace {

constexpr const char* kProgram = "emulated-hid-handle";

struct Options {
  std::string control;
  std::string serial = "T1";
  std::string gadget;
  bool spacemouse = false;
};

std::unique_ptr<HidDevice> deviceFor(const Options& options) {
  if (options.spacemouse) return std::make_unique<SpaceMouse>(options.serial);
  return std::make_unique<Controller>(options.serial);
}

base::Result<std::unique_ptr<HidLink>> linkFor(const Options& options) {
  if (options.gadget.empty()) return UhidLink::open();
  return GadgetLink::open(options.gadget);
}

int emulate(const Options& options) {
  auto link = linkFor(options);
  if (!link) return usbip::fail(kProgram, link.error(), EX_UNAVAILABLE);
  const int stop = usbip::stopSignals();
  const auto device = deviceFor(options);
  const auto served = HidEmulator(*device, **link, options.control).run(stop);
  ::close(stop);
  return served ? EX_OK : usbip::fail(kProgram, served.error(), EX_UNAVAILABLE);
}

int run(int argc, char** argv) {
  CLI::App app{
      "emulated-hid-handle: a controller in a hand, or a SpaceMouse, on uhid or as a USB gadget, until "
      "SIGTERM."};
  Options options;
  app.add_option("--control", options.control, "Unix socket that takes commands")
      ->type_name("PATH")
      ->required();
  app.add_option("--serial", options.serial, "serial number (T1)")->type_name("TEXT");
  app.add_option("--gadget", options.gadget, "/dev/hidgN of a gadget, instead of uhid")->type_name("PATH");
  app.add_flag("--spacemouse", options.spacemouse, "a SpaceMouse Wireless");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  return emulate(options);
}

}  // namespace
}  // namespace hapticd::test::hid

int main(int argc, char** argv) {
  return hapticd::base::runProgram(hapticd::test::hid::kProgram,
                                   [&] { return hapticd::test::hid::run(argc, argv); });
}
