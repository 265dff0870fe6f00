// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstring>
#include <string>

#include "config/base/program.h"
#include "rt/base/clock.h"
#include "tests/vm/emulators/uvc/depth_scene.h"
#include "tests/vm/emulators/uvc/v4l2_capture.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::test::uvc {
namespace {

struct Options {
  std::string device;
  std::string model = "d435";
  CaptureFormat format{.width_px = 640, .height_px = 480, .rate_hz = 30};
  std::uint32_t unit_um = 1000;
  double seconds = 5;
};

struct Counts {
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;          ///< gaps of the kernel's numbers
  std::uint64_t skipped = 0;       ///< gaps of the camera's numbers
  std::uint64_t damaged = 0;       ///< marked by the kernel, or of the wrong size
  std::uint64_t wrong_frames = 0;  ///< with wrong pixels
  std::uint64_t wrong_pixels = 0;
  std::uint64_t silences = 0;  ///< half a second without a frame
  std::uint32_t first_number = 0;
  std::uint32_t last_number = 0;
  std::string ended = "in time";
};

/// Compares frames with the emulated camera's scene.
class Checker {
 public:
  explicit Checker(const Options& options)
      : scene_(static_cast<std::uint16_t>(options.format.width_px),
               static_cast<std::uint16_t>(options.format.height_px),
               intrinsicsOf(*modelNamed(options.model), static_cast<std::uint16_t>(options.format.width_px),
                            static_cast<std::uint16_t>(options.format.height_px)),
               options.unit_um),
        expected_(scene_.pixels()) {}

  void check(const CapturedFrame& frame, Counts& counts) {
    if (counts.frames++ != 0) counts.lost += frame.sequence - sequence_ - 1;
    sequence_ = frame.sequence;
    if (frame.error || frame.pixels.size() != expected_.size()) {
      ++counts.damaged;
      return;
    }
    const std::uint32_t number = frameNumberIn(frame.pixels);
    if (numbered_) {
      counts.skipped += number - counts.last_number - 1;
    } else {
      counts.first_number = number;
    }
    numbered_ = true;
    counts.last_number = number;
    scene_.write(number, expected_);
    if (std::memcmp(expected_.data(), frame.pixels.data(), frame.bytes) == 0) return;
    ++counts.wrong_frames;
    for (std::size_t i = 0; i < expected_.size(); ++i) counts.wrong_pixels += expected_[i] != frame.pixels[i];
  }

 private:
  DepthScene scene_;
  std::vector<std::uint16_t> expected_;
  std::uint32_t sequence_ = 0;
  bool numbered_ = false;
};

int fail(const base::Error& error, int status) {
  std::fputs(fmt::format("capture-depth: {}\n", error.text()).c_str(), stderr);
  return status;
}

int capture(const Options& options) {
  constexpr std::chrono::milliseconds kPatience{500};
  Checker checker(options);
  const auto stream = V4l2Capture::start(options.device, options.format);
  if (!stream) return fail(stream.error(), EX_UNAVAILABLE);
  Counts counts;
  const std::int64_t end_ns = rt::monotonicNow_ns() + static_cast<std::int64_t>(options.seconds * 1e9);
  while (rt::monotonicNow_ns() < end_ns) {
    const auto frame = (*stream)->next(kPatience);
    if (!frame) {
      counts.ended = frame.error().what;
      break;
    }
    if (*frame) {
      checker.check(**frame, counts);
    } else {
      ++counts.silences;
    }
  }
  fmt::print(R"({{"interval_us":{},"frames":{},"lost":{},"skipped":{},"damaged":{},"wrong_frames":{},)"
             R"("wrong_pixels":{},"silences":{},"first_number":{},"last_number":{},"ended":"{}"}})"
             "\n",
             (*stream)->interval_us(), counts.frames, counts.lost, counts.skipped, counts.damaged,
             counts.wrong_frames, counts.wrong_pixels, counts.silences, counts.first_number,
             counts.last_number, counts.ended);
  return EX_OK;
}

int run(int argc, char** argv) {
  CLI::App app{
      "capture-depth: streams from a V4L2 node and compares each pixel with the scene of "
      "emulated-depth-camera.\nPrints one line of JSON."};
  app.footer("Exit status: 0 streamed, whatever arrived, 64 usage, 69 the node cannot be used.");
  Options options;
  app.add_option("--device", options.device, "the node")->type_name("PATH")->required();
  app.add_option("--model", options.model, "d435 or gemini335 (d435)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"d435", "gemini335"}));
  app.add_option("--format", options.format.fourcc, "fourcc, four characters (\"Z16 \")")
      ->type_name("CODE")
      ->check([](const std::string& code) { return code.size() == 4 ? "" : "it has not four characters"; });
  app.add_option("--width", options.format.width_px, "pixels (640)")->check(tools::within(16U, 1920U));
  app.add_option("--height", options.format.height_px, "pixels (480)")->check(tools::within(16U, 1200U));
  app.add_option("--rate", options.format.rate_hz, "frames per second (30)")->check(tools::within(1U, 300U));
  app.add_option("--unit-um", options.unit_um, "micrometres per step (1000)")
      ->check(tools::within(10U, 25000U));
  app.add_option("--seconds", options.seconds, "how long (5)")->check(tools::within(0.1, 3600.0));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  return capture(options);
}

}  // namespace
}  // namespace hapticd::test::uvc

int main(int argc, char** argv) {
  return hapticd::base::runProgram("capture-depth", [&] { return hapticd::test::uvc::run(argc, argv); });
}
