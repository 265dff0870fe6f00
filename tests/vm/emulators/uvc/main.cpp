// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "config/program.h"
#include "tests/vm/emulators/usbip/emulator.h"
#include "tests/vm/emulators/usbip/emulator_program.h"
#include "tests/vm/emulators/usbip/vhci_port.h"
#include "tests/vm/emulators/uvc/uvc_device.h"
#include "tools/lib/options/within.h"

namespace hapticd::test::uvc {
namespace {

struct Options {
  std::string model = "d435";
  std::string serial;
  std::string product;
  std::string format;
  std::string frames;
  bool little_endian = false;
  std::size_t most_frames = 60;
  std::string uvc = "1.1";
  std::string control;
  std::string vhci = usbip::kVhciFolder;
  std::string command;
};

constexpr const char* kProgram = "emulated-depth-camera";

int fail(const config::Error& error, int status) {
  return usbip::fail(kProgram, error, status);
}

CameraModel modelFor(const Options& options) {
  CameraModel model = *modelNamed(options.model);
  if (!options.serial.empty()) model.serial = options.serial;
  if (!options.product.empty()) {
    model.product = static_cast<std::uint16_t>(std::stoul(options.product, nullptr, 16));
  }
  if (!options.format.empty()) model.format = options.format + std::string(4 - options.format.size(), ' ');
  model.uvc_version = options.uvc == "1.0" ? 0x0100 : options.uvc == "1.1" ? 0x0110 : 0x0150;
  return model;
}

config::Result<std::unique_ptr<FrameSource>> sourceFor(const Options& options) {
  if (options.frames.empty()) return std::make_unique<SceneFrames>();
  return FolderFrames::load(options.frames, options.most_frames, !options.little_endian);
}

int emulate(const Options& options) {
  auto source = sourceFor(options);
  if (!source) return fail(source.error(), EX_NOINPUT);
  const CameraModel model = modelFor(options);
  const usbip::Log log = [&model](std::string_view line) {
    std::fputs(fmt::format("emulated-depth-camera {}: {}\n", model.serial, line).c_str(), stderr);
  };
  const int stop = usbip::stopSignals();
  UvcDevice device(model, std::move(*source), log);
  usbip::Emulator emulator(device, {options.vhci, options.control}, log);
  const auto served = emulator.run(stop);
  ::close(stop);
  return served ? EX_OK : fail(served.error(), EX_UNAVAILABLE);
}

std::string refuseText(const std::string& text, std::size_t most, const char* allowed) {
  if (!text.empty() && text.size() <= most && text.find_first_not_of(allowed) == std::string::npos) return {};
  return fmt::format("\"{}\" is not 1 to {} of {}", text, most, allowed);
}

int run(int argc, char** argv) {
  constexpr const char* kHex = "0123456789abcdef";
  constexpr const char* kUpper = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ";
  CLI::App app{
      "emulated-depth-camera: a depth camera of the USB video class on a port of vhci_hcd, until SIGTERM.\n"
      "Needs root and the kernel module vhci_hcd (modprobe vhci_hcd)."};
  app.footer("Exit status: 0 done, 64 usage, 65 command refused, 66 no frames, 69 no port or no emulator.");
  Options options;
  app.add_option("--model", options.model, "d435 or gemini335 (d435)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"d435", "gemini335"}));
  app.add_option("--serial", options.serial, "serial number of the USB device (the model's)")
      ->type_name("TEXT")
      ->check([=](const std::string& text) { return refuseText(text, 32, kUpper); });
  app.add_option("--product", options.product, "product id, four hexadecimal digits (the model's)")
      ->type_name("ID")
      ->check([=](const std::string& text) { return refuseText(text, 4, kHex); });
  app.add_option("--format", options.format, "fourcc of the pixels (Z16)")
      ->type_name("CODE")
      ->check([=](const std::string& text) { return refuseText(text, 4, kUpper); });
  app.add_option("--uvc", options.uvc, "version of the class: 1.0, 1.1 or 1.5 (1.1)")
      ->type_name("VERSION")
      ->check(CLI::IsMember({"1.0", "1.1", "1.5"}));
  app.add_option("--frames", options.frames, "folder of PGM images of 16 bits, instead of the scene")
      ->type_name("DIR");
  app.add_flag("--little-endian", options.little_endian, "their pixels are little-endian");
  app.add_option("--most-frames", options.most_frames, "images to be loaded at most (60)")
      ->type_name("N")
      ->check(tools::within(1, 2000));
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
}  // namespace hapticd::test::uvc

int main(int argc, char** argv) {
  return hapticd::config::runProgram("emulated-depth-camera",
                                     [&] { return hapticd::test::uvc::run(argc, argv); });
}
