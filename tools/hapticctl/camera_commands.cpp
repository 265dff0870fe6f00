// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <expected>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "config/base/whole_file.h"
#include "drivers/camera/v4l2/camera_report.h"
#include "drivers/camera/v4l2/v4l2_camera.h"
#include "rt/base/parameters.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/camera_test.h"
#include "tools/hapticctl/commands.h"
#include "tools/hapticctl/doctor/camera_list.h"
#include "tools/hapticctl/doctor/examination.h"
#include "tools/hapticctl/running_daemon.h"
#include "tools/hapticctl/snapshot/depth_picture.h"
#include "tools/hapticctl/snapshot/snapshot.h"
#include "tools/hapticctl/text/calibration_text.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr const char* kListFooter =
    "Each line has 'used', 'usable' (with another configuration) or 'unusable', the\n"
    "place of a camera, its name, and why hapticd does not use it. The last lines\n"
    "name what hapticd takes, and the configuration: that of the running hapticd,\n"
    "else that of the file. Streams nothing, and does not open a camera that the\n"
    "running hapticd uses.\n";

int runList(const CommandOptions& options, const std::string& root) {
  const bool this_machine = root == "/";
  const DaemonView daemon =
      daemonView(options, this_machine ? askServiceManager() : std::nullopt, this_machine);
  const Configuration configuration =
      this_machine ? configurationInUse(daemon, root) : readConfiguration(root);
  if (!configuration.problem.empty()) {
    return report(base::Error{"", configuration.problem, kCheckConfiguration}, options.json);
  }
  const DepthProbe probe = this_machine ? DepthProbe(depthFormatOf) : DepthProbe();
  HeldCamera held;
  if (this_machine) held = {daemon.camera.node, daemon.camera.format};
  CameraList list = listCameras(Machine(root), configuration.settings.camera, probe, held);
  list.configuration = configuration.source;
  if (this_machine && daemon.settings) {
    list.state = daemon.camera.state;
    if (!daemon.camera.works && !daemon.camera.detail.empty()) list.problem = daemon.camera.detail;
  }
  fmt::print("{}", options.json ? jsonOf(list) : fitted(textOf(list), terminalSize().columns));
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
    "Temporal noise is the deviation from frame to frame, static noise what is the\n"
    "same in each frame. The last lines go into the configuration.\n";

/// The node of a device that is given by its path or its name in /dev/v4l/by-id.
std::string nodeOf(const std::string& device) {
  const auto videos = drivers::videoDevices();
  const auto found = std::ranges::find_if(videos, [&](const drivers::VideoDevice& video) {
    return video.node == device || std::ranges::any_of(video.links, [&](const std::string& link) {
             return link == device || "/dev/v4l/by-id/" + link == device;
           });
  });
  return found == videos.end() ? device : found->node;
}

constexpr const char* kEndHapticd =
    "end hapticd and repeat: systemctl stop hapticd, or Ctrl-C where it was started by hand";

/// The camera to measure. Errors: it is in use, or its driver cannot be measured.
base::Result<config::CameraSettings> cameraToTest(const CommandOptions& options,
                                                  const TestOptions& requested) {
  const DaemonView daemon = daemonView(options, askServiceManager(), true);
  const Configuration configuration = configurationInUse(daemon, "/");
  if (!configuration.problem.empty()) {
    return std::unexpected(base::Error{"", configuration.problem, kCheckConfiguration});
  }
  const std::string& held = daemon.camera.node;
  if (!held.empty() && (requested.device.empty() || nodeOf(requested.device) == held)) {
    return std::unexpected(base::Error{
        "", fmt::format("the running hapticd holds the camera {} ({})", held, daemon.camera.identity),
        kEndHapticd});
  }
  config::CameraSettings settings = configuration.settings.camera;
  if (daemon.settings && !daemon.camera.works && settings.driver == "v4l2" && requested.device.empty()) {
    return std::unexpected(
        base::Error{"",
                    fmt::format("the running hapticd, which takes its camera as soon as it can, reports: {}",
                                daemon.camera.detail.empty() ? daemon.camera.state : daemon.camera.detail),
                    kEndHapticd});
  }
  if (!requested.device.empty()) {
    settings.driver = "v4l2";
    settings.of<drivers::V4l2Settings>().device = requested.device;
    settings.serial.clear();
  }
  if (settings.driver == "v4l2") return settings;
  return std::unexpected(base::Error{
      "",
      fmt::format("camera.driver is {}, and only cameras of the driver v4l2 are measured; configuration: {}",
                  settings.driver, configuration.source),
      "name a camera that 'hapticctl camera list' shows with --device, or set camera.driver to v4l2"});
}

int runTest(const CommandOptions& options, const TestOptions& requested) {
  const auto settings = cameraToTest(options, requested);
  if (!settings) return report(settings.error(), options.json);
  drivers::V4l2Camera camera(*settings);
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
  CLI::App& group = line.addGroup("camera", "Connected cameras, and what they deliver");
  addList(line, group);
  addTest(line, group);
}

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPeriod{100};
constexpr double kMin_n_per_m = 1;
constexpr double kMax_n_per_m = 5000;

struct CalibrateOptions {
  std::optional<double> ceiling_n_per_m;
  double limit_s = 15;
  bool apply = false;
  bool fixed = false;
};

int failed(const CommandOptions& options, const std::string& what, const std::string& remedy) {
  return report(base::Error{"calibrate", what, remedy}, options.json);
}

/// Waits until the daemon has measured the noise of the surface. Errors: the exit code, after the report.
std::expected<Json, int> measure(const CommandOptions& options, VarlinkClient& client, double limit_s) {
  const auto end = Clock::now() + std::chrono::duration<double>(limit_s);
  std::string shown;
  while (true) {
    const auto reply = client.call("io.hapticd.Status.GetStatus");
    if (!reply) return std::unexpected(report(reply.error(), options.json));
    const Json* status = fieldAt(*reply, "status");
    if (status == nullptr || fieldAt(*status, "stiffness") == nullptr) {
      return std::unexpected(failed(options, "hapticd does not report what limits the stiffness",
                                    "is it of another version than hapticctl? See 'hapticctl version'"));
    }
    const std::string needs = calibrationNeeds(*status);
    if (needs.empty()) return *status;
    if (Clock::now() >= end) {
      return std::unexpected(
          failed(options, fmt::format("the noise of the surface was not measured within {:.0f} s", limit_s),
                 "needs " + needs));
    }
    if (needs != shown && !options.json) fmt::print(stderr, "waiting for {}\n", needs);
    shown = needs;
    std::this_thread::sleep_for(kPeriod);
  }
}

int calibrate(const CommandOptions& options, const CalibrateOptions& requested) {
  auto client = connectTo(options, requested.apply);
  if (!client) return report(client.error(), options.json);
  const auto status = measure(options, *client, requested.limit_s);
  if (!status) return status.error();
  Json calibration = calibrationOf(*status, requested.ceiling_n_per_m);
  if (requested.apply) {
    Json values = Json::object();
    const double stiffness =
        std::clamp(std::floor(numberAt(calibration, "stiffnessNPerM")), kMin_n_per_m, kMax_n_per_m);
    values["force.stiffness_n_per_m"] = requested.fixed ? Json(stiffness) : Json("auto");
    if (requested.ceiling_n_per_m) values["force.stiffness_ceiling_n_per_m"] = *requested.ceiling_n_per_m;
    const auto reply = client->call("io.hapticd.Control.SetParameters", {{"parameters", values}});
    if (!reply) return report(reply.error(), options.json);
    calibration["applied"] = values;
  }
  if (options.json) {
    printJson(calibration);
    return kOk;
  }
  const std::size_t columns = terminalSize().columns;
  fmt::print("{}", fitted(calibrationText(calibration, columns), columns));
  if (const Json* applied = fieldAt(calibration, "applied")) {
    for (const auto& [name, value] : applied->items()) fmt::print("{}: {}\n", name, valueText(value));
  }
  return kOk;
}

}  // namespace

void addCalibrateCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto requested = std::make_shared<CalibrateOptions>();
  CLI::App& command = line.add("calibrate", "Measure how stiff the surface may be, and what limits it",
                               [&options, requested] { return calibrate(options, *requested); });
  command
      .add_option("--ceiling", requested->ceiling_n_per_m,
                  "Largest stiffness, instead of force.stiffness_ceiling_n_per_m")
      ->type_name("N/M")
      ->check(within(kMin_n_per_m, kMax_n_per_m));
  auto* apply = command.add_flag("--apply", requested->apply,
                                 "Set force.stiffness_n_per_m to auto, and the ceiling if it is given");
  command
      .add_flag("--fixed", requested->fixed, "With --apply: set the number that was found instead of auto")
      ->needs(apply);
  command.add_option("--limit", requested->limit_s, "Longest time to measure, seconds (default 15)")
      ->type_name("S")
      ->check(within(1.0, 120.0));
}

namespace {

struct SnapshotOptions {
  std::string ply;
  std::string png;
  base::IfExists if_exists = base::IfExists::refuse;
};

/// The radius of the HIP's neighbourhood; the default if the daemon does not report it.
double neighbourhood_m(const CommandOptions& options) {
  const auto reply = callOnce(options, {"io.hapticd.Status.GetParameters", {{"names", {"force.radius_m"}}}});
  const Json rows = reply ? listAt(*reply, "parameters") : Json::array();
  const double radius_m = rows.empty() ? std::nan("") : numberAt(rows.front(), "value");
  return std::isnan(radius_m) ? rt::SpringParameters().radius_m : radius_m;
}

base::Result<void> writeFiles(const Snapshot& snapshot, const SnapshotOptions& requested, double radius_m) {
  if (!requested.ply.empty()) {
    const auto written = base::writeWholeFile(requested.ply, plyOf(snapshot, radius_m), requested.if_exists);
    if (!written) return written;
  }
  if (requested.png.empty()) return {};
  const auto png = pngOf(snapshot);
  if (!png) return std::unexpected(png.error());
  return base::writeWholeFile(requested.png, *png, requested.if_exists);
}

void showSnapshot(const Snapshot& snapshot, const SnapshotOptions& requested, bool json) {
  const auto measured = std::ranges::count_if(snapshot.raw, [&](auto raw) {
    return raw != snapshot.depth_model.raw_no_measurement && raw < snapshot.depth_model.raw_values;
  });
  Json files = Json::array();
  for (const std::string& file : {requested.ply, requested.png}) {
    if (!file.empty()) files.push_back(file);
  }
  if (json) return printJson({{"frame", snapshot.frame}, {"measuredPixels", measured}, {"files", files}});
  fmt::print("frame {}: {} of {} pixels measured\n", snapshot.frame, measured, snapshot.raw.size());
  for (const Json& file : files) fmt::print("{}\n", printable(file.get<std::string>()));
}

int runSnapshot(const CommandOptions& options, const SnapshotOptions& requested) {
  for (const std::string& file : {requested.ply, requested.png}) {
    const auto good = file.empty() ? base::Result<void>() : base::mayWrite(file, requested.if_exists);
    if (!good) return report(good.error(), options.json);
  }
  const auto snapshot = fetchSnapshot(options);
  if (!snapshot) return snapshot.error();
  const double radius_m = requested.ply.empty() ? 0 : neighbourhood_m(options);
  const auto written = writeFiles(*snapshot, requested, radius_m);
  if (!written) return report(written.error(), options.json);
  showSnapshot(*snapshot, requested, options.json);
  return kOk;
}

}  // namespace

void addSnapshotCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto requested = std::make_shared<SnapshotOptions>();
  CLI::App& command = line.add("snapshot", "Save the depth image of this moment, with the HIP marked",
                               [&options, requested] { return runSnapshot(options, *requested); });
  command.add_option("--ply", requested->ply, "The points in the world, in metres, for MeshLab and others")
      ->type_name("FILE")
      ->check(endsIn(".ply"));
  command
      .add_option("--png", requested->png, "The depth image, light where it is near, with a scale in metres")
      ->type_name("FILE")
      ->check(endsIn(".png"));
  addForce(command, requested->if_exists);
}

}  // namespace hapticd::tools
