// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <memory>

#include "drivers/camera/v4l2/v4l2_camera.h"
#include "tools/hapticctl/camera_test.h"
#include "tools/hapticctl/command_line.h"
#include "tools/hapticctl/doctor/camera_list.h"
#include "tools/hapticctl/doctor/configuration.h"
#include "tools/hapticctl/error_text.h"
#include "tools/lib/options/within.h"

namespace hapticd::tools {
namespace {

constexpr const char* kListFooter =
    "Each line has 'used', 'usable' (with another configuration) or 'unusable', the\n"
    "place of a camera, its name, and why hapticd does not use it. The last line\n"
    "names what hapticd takes with its configuration. Streams nothing, and works\n"
    "while hapticd runs.\n";

int runList(const CommandOptions& options, const std::string& root) {
  const Configuration configuration = readConfiguration(root);
  if (!configuration.problem.empty()) {
    return report(config::Error{"", configuration.problem, ""}, options.json);
  }
  const DepthProbe probe = root == "/" ? DepthProbe(depthFormatOf) : DepthProbe();
  const CameraList list = listCameras(Machine(root), configuration.settings.camera, probe);
  fmt::print("{}", options.json ? jsonOf(list) : textOf(list));
  return kOk;
}

void addList(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  const auto root = std::make_shared<std::string>("/");
  CLI::App& command = line.add(group, "list", "List the connected cameras, and the one that hapticd uses",
                               [&options, root] { return runList(options, *root); });
  command.footer(kListFooter);
  command.add_option("--root", *root, "List the cameras below this folder instead of this machine's")
      ->type_name("FOLDER")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""));
}

struct TestOptions {
  double duration_s = 5;
  std::string device;  ///< empty: as configured
};

/// How long a camera may take to start; the driver gives its first frame 3 s.
constexpr std::chrono::milliseconds kPatience{6000};

constexpr const char* kTestFooter =
    "Point the camera at a resting scene with surfaces at the distances that matter.\n"
    "Stop hapticd first, which holds its camera: systemctl stop hapticd.\n"
    "'changing' is the noise from frame to frame, 'standing' what is the same in\n"
    "each frame. The last lines go into the configuration.\n";

int runTest(const CommandOptions& options, const TestOptions& requested) {
  const Configuration configuration = readConfiguration("/");
  if (!configuration.problem.empty()) {
    return report(config::Error{"", configuration.problem, ""}, options.json);
  }
  config::CameraSettings settings = configuration.settings.camera;
  if (!requested.device.empty()) {
    settings.driver = config::CameraDriver::v4l2;
    settings.v4l2.device = requested.device;
    settings.serial.clear();
  }
  if (settings.driver != config::CameraDriver::v4l2) {
    return report(
        config::Error{"",
                      fmt::format("camera.driver is {}, and only cameras of the driver v4l2 are measured",
                                  rt::wordOf(settings.driver)),
                      "set camera.driver to v4l2, or name a camera with --device"},
        options.json);
  }
  drivers::V4l2Camera camera(settings);
  const std::chrono::milliseconds duration(static_cast<std::int64_t>(requested.duration_s * 1000));
  const auto test = testCamera(camera, duration, kPatience);
  if (!test) return report(test.error(), options.json);
  fmt::print("{}", options.json ? jsonOf(*test) : textOf(*test));
  return kOk;
}

void addTest(CommandLine& line, CLI::App& group) {
  const CommandOptions& options = line.options();
  const auto requested = std::make_shared<TestOptions>();
  CLI::App& command = line.add(group, "test", "Measure rate, holes and noise of a camera of the driver v4l2",
                               [&options, requested] { return runTest(options, *requested); });
  command.footer(kTestFooter);
  command.add_option("--seconds", requested->duration_s, "How long to measure (default 5)")
      ->type_name("S")
      ->check(within(1.0, 600.0));
  command
      .add_option("--device", requested->device,
                  "The camera: a name in /dev/v4l/by-id or a path; as configured otherwise")
      ->type_name("PATH");
}

}  // namespace

void addCameraCommands(CommandLine& line) {
  CLI::App& group = line.addGroup("camera", "Connected cameras; needs no daemon");
  addList(line, group);
  addTest(line, group);
}

}  // namespace hapticd::tools
