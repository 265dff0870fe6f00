// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "config/base/program.h"
#include "tests/vm/emulators/kinect/kinect_device.h"
#include "tests/vm/emulators/usbip/emulator.h"
#include "tests/vm/emulators/usbip/emulator_program.h"

namespace hapticd::test {
namespace {

struct Options {
  std::string recording;
  std::string serial = "A00000000000002A";
  std::string control;
};

constexpr const char* kProgram = "emulated-kinect";
constexpr std::size_t kMaxFrames = 60;  // of the recording, 0.4 MB each

int emulate(const Options& options) {
  auto recording = PackedRecording::load(options.recording, kMaxFrames);
  if (!recording) return usbip::fail(kProgram, recording.error(), EX_NOINPUT);
  const usbip::Log log = [&options](std::string_view line) {
    std::fputs(fmt::format("{} {}: {}\n", kProgram, options.serial, line).c_str(), stderr);
  };
  const int stop = usbip::stopSignals();
  KinectDevice device(std::move(*recording), options.serial, log);
  usbip::Emulator emulator(device, {usbip::kVhciFolder, options.control}, log);
  const auto served = emulator.run(stop);
  ::close(stop);
  return served ? EX_OK : usbip::fail(kProgram, served.error(), EX_UNAVAILABLE);
}

int run(int argc, char** argv) {
  CLI::App app{
      "emulated-kinect: a Kinect v1 camera on a port of vhci_hcd that plays a recording, until SIGTERM.\n"
      "Needs root and the kernel module vhci_hcd (modprobe vhci_hcd)."};
  app.footer("Exit status: 0 done, 64 usage, 66 no recording, 69 no port.");
  Options options;
  app.add_option("--recording", options.recording, "folder in libfreenect's format (INDEX.txt, .pgm)")
      ->type_name("DIR")
      ->required();
  app.add_option("--serial", options.serial, "serial number, ASCII (A00000000000002A)")->type_name("TEXT");
  app.add_option("--control", options.control, "Unix socket that takes commands")->type_name("PATH");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  return emulate(options);
}

}  // namespace
}  // namespace hapticd::test

int main(int argc, char** argv) {
  return hapticd::base::runProgram(hapticd::test::kProgram, [&] { return hapticd::test::run(argc, argv); });
}
