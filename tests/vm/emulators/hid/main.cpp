// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "config/program.h"
#include "tests/vm/emulators/hid/controller.h"
#include "tests/vm/emulators/hid/gadget_link.h"
#include "tests/vm/emulators/hid/hid_emulator.h"
#include "tests/vm/emulators/hid/spacemouse.h"
#include "tests/vm/emulators/hid/uhid_link.h"

namespace hapticd::test::hid {
namespace {

struct Options {
  std::string control;
  std::string serial = "T1";
  std::string gadget;
  std::string log;
  bool spacemouse = false;
};

int fail(const config::Error& error) {
  std::fputs(fmt::format("emulated-hid-handle: {}\n", error.text()).c_str(), stderr);
  return EX_UNAVAILABLE;
}

/// Readable at SIGTERM and SIGINT, which do nothing else from then on.
int stopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  ::sigprocmask(SIG_BLOCK, &signals, nullptr);
  return ::signalfd(-1, &signals, SFD_CLOEXEC);
}

std::unique_ptr<HidDevice> deviceFor(const Options& options) {
  if (options.spacemouse) return std::make_unique<SpaceMouse>(options.serial);
  return std::make_unique<Controller>(options.serial, options.log);
}

config::Result<std::unique_ptr<HidLink>> linkFor(const Options& options) {
  if (options.gadget.empty()) return UhidLink::open();
  return GadgetLink::open(options.gadget);
}

int emulate(const Options& options) {
  auto link = linkFor(options);
  if (!link) return fail(link.error());
  const int stop = stopSignals();
  const auto device = deviceFor(options);
  const auto served = HidEmulator(*device, **link, options.control).run(stop);
  ::close(stop);
  return served ? EX_OK : fail(served.error());
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
  app.add_option("--log", options.log, "CSV file that gets a line per millisecond")->type_name("FILE");
  app.add_flag("--spacemouse", options.spacemouse, "a SpaceMouse Wireless");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return config::endWithoutWork(app, error, EX_USAGE);
  }
  return emulate(options);
}

}  // namespace
}  // namespace hapticd::test::hid

int main(int argc, char** argv) {
  return hapticd::config::runProgram("emulated-hid-handle",
                                     [&] { return hapticd::test::hid::run(argc, argv); });
}
