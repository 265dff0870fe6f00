// SPDX-License-Identifier: Apache-2.0
// hapticctl-machine: the commands of hapticctl that look at this machine and its devices.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>

#include "config/settings/parameter_table.h"
#include "drivers/camera/v4l2/camera_report.h"
#include "drivers/camera/v4l2/v4l2_camera.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/camera_test.h"
#include "tools/hapticctl/doctor/cameras.h"
#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"
#include "tools/hapticctl/doctor/examination.h"
#include "tools/hapticctl/doctor/handles.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/hapticctl/text/status_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

std::optional<config::Value> valueOf(const Json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number_integer()) return value.get<std::int64_t>();
  if (value.is_number()) return value.get<double>();
  if (value.is_string()) return value.get<std::string>();
  return std::nullopt;
}

/// Takes over the rows of a reply of GetParameters that this program knows, and whose values it allows.
void apply(const Json& reply, config::Settings& settings) {
  for (const Json& row : listAt(reply, "parameters")) {
    const Json* const name = fieldAt(row, "name");
    const Json* const value = fieldAt(row, "value");
    if (!name || !name->is_string() || !value) continue;
    const config::Parameter* const parameter = config::findParameter(name->get<std::string>());
    const auto read = valueOf(*value);
    if (!parameter || !read) continue;
    if (const auto checked = parameter->check(*read)) parameter->set(settings, *checked);
  }
}

/// The parameters of a daemon as settings; nothing if it does not report them.
std::optional<config::Settings> settingsOf(VarlinkClient& client) {
  const auto reply = client.call("io.hapticd.Status.GetParameters");
  if (!reply || listAt(*reply, "parameters").empty()) return std::nullopt;
  config::Settings settings;
  apply(*reply, settings);
  // the list leaves out what stands in for a device, which a daemon of another version may not know
  Json names = Json::array();
  for (const config::Parameter& parameter : config::standInParameters()) names.push_back(parameter.name);
  if (const auto others = client.call("io.hapticd.Status.GetParameters", {{"names", names}}))
    apply(*others, settings);
  return settings;
}

/// A field of the status; empty where it is missing.
std::string reported(const Json& status, const char* path) {
  const Json* const field = fieldAt(status, path);
  return field && field->is_string() ? textAt(status, path) : "";
}

DaemonView viewOf(const Json& status) {
  DaemonView view;
  view.answers = true;
  const Json* cpu = fieldAt(status, "loop.cpu");
  if (cpu && cpu->is_number_integer()) view.cpu = cpu->get<int>();
  view.memory_locked = flagAt(status, "loop.memoryLocked");
  view.warnings = warningsOf(status);
  view.camera = {.identity = reported(status, "camera.identity"),
                 .state = reported(status, "camera.state"),
                 .detail = reported(status, "camera.detail"),
                 .node = reported(status, "camera.details.node"),
                 .format = reported(status, "camera.details.format")};
  view.camera.works = view.camera.state == "streaming";
  if (!view.camera.works) view.camera.node.clear();
  view.handle = {.identity = reported(status, "handle.identity"),
                 .state = reported(status, "handle.state"),
                 .detail = reported(status, "handle.detail"),
                 .works = flagAt(status, "handle.present")};
  return view;
}

/// The socket that connectTo() takes; empty: one of the default ones.
std::string namedSocket(const CommandOptions& options) {
  if (!options.socket.empty()) return options.socket;
  const char* const environment = std::getenv("HAPTICD_SOCKET");
  return environment ? environment : "";
}

DaemonView silent(const std::string& problem) {
  DaemonView view;
  view.problem = problem;
  return view;
}

DaemonView ask(const CommandOptions& options) {
  const std::string named = namedSocket(options);
  DaemonView view;
  auto client = connectTo(options, false);
  const auto reply = client ? client->call("io.hapticd.Status.GetStatus")
                            : ClientResult<Json>(std::unexpected(client.error()));
  if (reply) {
    const Json* status = fieldAt(*reply, "status");
    view = viewOf(status ? *status : Json());
    view.settings = settingsOf(*client);
    view.socket_process = client->serviceProcess();
  } else {
    view = silent(reply.error().what);
    if (!named.empty()) {
      view.remedy =
          "start the hapticd that has this socket, or omit --socket and HAPTICD_SOCKET for the service";
    }
  }
  view.socket = named.empty() ? "its default socket" : printable(named);
  return view;
}

/// Whether a call would start a stopped service, through its socket units.
bool wouldStartTheService(const std::optional<UnitProperties>& unit) {
  if (!isInstalled(unit)) return false;
  const auto state = unit->find("ActiveState");
  return state != unit->end() && (state->second == "inactive" || state->second == "failed");
}

/// What the daemon reports of itself: its state, its devices and its parameters. It is not asked where that
/// would start the service, through its socket units, or where other files than those of this machine are
/// examined, unless its socket is named. unit: of the service, as far as it is known.
DaemonView daemonView(const CommandOptions& options, const std::optional<UnitProperties>& unit,
                      bool this_machine) {
  if (options.socket.empty() && !this_machine) return silent("not asked, because of --root");
  if (namedSocket(options).empty() && wouldStartTheService(unit)) return silent("the service does not run");
  return ask(options);
}

// --- cameras

constexpr const char* kCameraFooter =
    "Each line has 'used', 'usable' (with another configuration) or 'unusable', the\n"
    "place of a camera, its name, and why hapticd does not use it. The last lines\n"
    "name what hapticd takes, and the configuration: that of the running hapticd,\n"
    "else that of the file. Streams nothing, and does not open a camera that the\n"
    "running hapticd uses.\n";

int runCameraList(const CommandOptions& options, const std::string& root) {
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

/// Adds the option of a folder that stands for "/".
void addRoot(CLI::App& command, std::string& root, const char* help) {
  command.add_option("--root", root, help)
      ->type_name("FOLDER")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""));
}

void addCameraList(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto root = std::make_shared<std::string>("/");
  CLI::App& command =
      line.addHelped("camera list", [&options, root] { return runCameraList(options, *root); });
  command.footer(kCameraFooter);
  addRoot(command, *root, "List the cameras below this folder instead of this machine's");
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

void addCameraTest(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto requested = std::make_shared<TestOptions>();
  CLI::App& command =
      line.addHelped("camera test", [&options, requested] { return runTest(options, *requested); });
  command.footer(kTestFooter);
  command.add_option("--seconds", requested->duration_s, "How long to measure (default 5)")
      ->type_name("S")
      ->check(within(1.0, 600.0));
  command
      .add_option("--device", requested->device,
                  "The camera: a name in /dev/v4l/by-id or a path; as configured otherwise")
      ->type_name("PATH");
}

constexpr const char* kHandleFooter =
    "Each line has 'used' or 'usable' (with another configuration), the place of a\n"
    "handle, its name, and what to do so that hapticd uses it. Handles behind a\n"
    "network are not shown. The last lines name the driver that hapticd uses, and\n"
    "the configuration: that of the running hapticd, else that of the file.\n";

int runHandleList(const CommandOptions& options, const std::string& root) {
  const bool this_machine = root == "/";
  Examination box{Machine(root), thisCaller(), std::nullopt, {}, {}};
  box.daemon = daemonView(options, this_machine ? askServiceManager() : std::nullopt, this_machine);
  box.configuration = this_machine ? configurationInUse(box.daemon, root) : readConfiguration(root);
  if (!box.configuration.problem.empty()) {
    return report(base::Error{"", box.configuration.problem, kCheckConfiguration}, options.json);
  }
  HandleList list = listHandles(box);
  if (this_machine && box.daemon.settings) list.state = box.daemon.handle.state;
  fmt::print("{}", options.json ? jsonOf(list) : fitted(textOf(list), terminalSize().columns));
  return kOk;
}

void addHandleList(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto root = std::make_shared<std::string>("/");
  CLI::App& command =
      line.addHelped("handle list", [&options, root] { return runHandleList(options, *root); });
  command.footer(kHandleFooter);
  addRoot(command, *root, "List the handles below this folder instead of this machine's");
}

constexpr const char* kDoctorFooter =
    "Each line has 'ok', 'warn' or 'fail', what was examined, what was found, and\n"
    "what to do about it. A running hapticd is asked which configuration, camera,\n"
    "handle and CPU it uses; without one the configuration file is read.\n"
    "Exit status: 0 done, nothing fails, 1 something fails, 2 wrong usage.\n";

struct DoctorOptions {
  /// The folder that stands for "/"; with another one the service manager is not queried, and the daemon only
  /// if its socket is named.
  std::string root = "/";
  std::string named;  ///< a device file; empty: examine everything
};

/// Returns 0 if the configuration names a device, else 1.
int answerNamed(const CommandOptions& options, const DoctorOptions& doctor) {
  Examination box{Machine(doctor.root), {}, std::nullopt, {}, readConfiguration(doctor.root)};
  if (doctor.root == "/") box.gpio_label = gpioLabelOf;
  const bool is_named = isNamedDevice(box, doctor.named);
  if (options.json) printJson({{"device", doctor.named}, {"named", is_named}});
  return is_named ? 0 : 1;
}

/// Prints what is right and wrong with this machine; returns 0, or 1 when something fails.
int runDoctor(const CommandOptions& options, const DoctorOptions& doctor) {
  if (!doctor.named.empty()) return answerNamed(options, doctor);
  const bool this_machine = doctor.root == "/";
  Examination box{Machine(doctor.root), thisCaller(), std::nullopt, {}, {}};
  if (this_machine) {
    box.unit = askServiceManager();
    box.depth_probe = depthFormatOf;
    box.gpio_label = gpioLabelOf;
    box.architecture = machineArchitecture();
  }
  box.daemon = daemonView(options, box.unit, this_machine);
  // another machine's files are examined with its own configuration, whatever daemon was named
  box.configuration =
      this_machine ? configurationInUse(box.daemon, doctor.root) : readConfiguration(doctor.root);
  const Findings findings = examine(box);
  fmt::print("{}", options.json ? jsonOf(findings) : fitted(textOf(findings), terminalSize().columns));
  return exitStatus(findings);
}

void addDoctor(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto doctor = std::make_shared<DoctorOptions>();
  CLI::App& command = line.addHelped("doctor", [&options, doctor] { return runDoctor(options, *doctor); });
  command.footer(kDoctorFooter);
  addRoot(command, doctor->root, "Check the files below this folder instead of this machine's");
  command
      .add_option("--names", doctor->named,
                  "Examine nothing, and exit with 0 if the configuration names this device, else with 1")
      ->type_name("DEVICE");
}

void addCommands(CommandLine& line) {
  addCameraList(line);
  addCameraTest(line);
  addHandleList(line);
  addDoctor(line);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::tools::runCommandLine(argc, argv, /*is_helper=*/true, hapticd::tools::addCommands);
}
