// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <string>

#include "config/program.h"
#include "tests/vm/emulators/kinect/kinect_device.h"
#include "tests/vm/emulators/usbip/emulator.h"
#include "tests/vm/emulators/usbip/emulator_program.h"
#include "tests/vm/emulators/usbip/vhci_port.h"
#include "tools/lib/options/within.h"

namespace hapticd::test {
namespace {

struct Options {
  std::string recording;
  std::size_t most_frames = 60;
  KinectOptions kinect;
  std::string control;
  std::string vhci = usbip::kVhciFolder;
  std::string command;
};

constexpr const char* kProgram = "emulated-kinect";

int fail(const config::Error& error, int status) {
  return usbip::fail(kProgram, error, status);
}

int emulate(const Options& options) {
  if (options.recording.empty()) {
    return fail({"--recording", "is missing", "name a folder with INDEX.txt, or use --tell"}, EX_USAGE);
  }
  auto recording = PackedRecording::load(options.recording, options.most_frames);
  if (!recording) return fail(recording.error(), EX_NOINPUT);
  if (const std::size_t frames = recording->frames(); options.kinect.freeze.value_or(0) >= frames) {
    return fail(
        {"--freeze",
         fmt::format("there is no frame {}, there are 0 to {}", *options.kinect.freeze, frames - 1), ""},
        EX_USAGE);
  }
  const usbip::Log log = [&options](std::string_view line) {
    std::fputs(fmt::format("emulated-kinect {}: {}\n", options.kinect.serial, line).c_str(), stderr);
  };
  const int stop = usbip::stopSignals();
  KinectDevice device(std::move(*recording), options.kinect, log);
  usbip::Emulator emulator(device, {options.vhci, options.control}, log);
  const auto served = emulator.run(stop);
  ::close(stop);
  return served ? EX_OK : fail(served.error(), EX_UNAVAILABLE);
}

std::string refuseSerial(const std::string& serial) {
  constexpr std::size_t kMostLetters = 32;
  const bool plain = std::ranges::all_of(serial, [](char letter) {
    return (letter >= '0' && letter <= '9') || (letter >= 'A' && letter <= 'Z') ||
           (letter >= 'a' && letter <= 'z');
  });
  if (!serial.empty() && serial.size() <= kMostLetters && plain) return {};
  return fmt::format("\"{}\" is not 1 to {} letters and digits", serial, kMostLetters);
}

int run(int argc, char** argv) {
  CLI::App app{
      "emulated-kinect: a Kinect v1 camera on a port of vhci_hcd that plays a recording, until SIGTERM.\n"
      "Needs root and the kernel module vhci_hcd (modprobe vhci_hcd)."};
  app.footer(
      "Exit status: 0 done, 64 usage, 65 command refused, 66 no recording, 69 no port or no emulator.");
  Options options;
  app.add_option("--recording", options.recording, "folder in libfreenect's format (INDEX.txt, .pgm)")
      ->type_name("DIR");
  app.add_option("--frames", options.most_frames, "frames to be played at most; 0.4 MB each (60)")
      ->type_name("N")
      ->check(tools::within(1, 2000));
  app.add_option("--fps", options.kinect.fps, "frames per second, 1 to 33 (30)")
      ->type_name("RATE")
      ->check(tools::within(1.0, kMostFps));
  app.add_option("--freeze", options.kinect.freeze, "repeat this frame, 0 for the first")
      ->type_name("FRAME")
      ->check(tools::within(std::size_t{0}, std::size_t{1'000'000}));
  app.add_option("--serial", options.kinect.serial, "serial number (A00000000000002A)")
      ->type_name("TEXT")
      ->check(refuseSerial);
  app.add_option("--control", options.control, "Unix socket that takes commands")->type_name("PATH");
  app.add_option("--tell", options.command, "send a command to the emulator at --control, print the answer")
      ->type_name("COMMAND");
  app.add_option("--vhci", options.vhci, "folder of the host controller (that of vhci_hcd.0)")
      ->type_name("DIR");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return config::endWithoutWork(app, error, EX_USAGE);
  }
  return app.count("--tell") != 0 ? usbip::sendCommand(kProgram, options.control, options.command)
                                  : emulate(options);
}

}  // namespace
}  // namespace hapticd::test

int main(int argc, char** argv) {
  return hapticd::config::runProgram("emulated-kinect", [&] { return hapticd::test::run(argc, argv); });
}
