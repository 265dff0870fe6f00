// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/signalfd.h>
#include <sysexits.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/base/descriptor.h"
#include "config/base/error.h"
#include "config/base/program.h"
#include "config/base/value_text.h"
#include "config/settings/settings.h"
#include "tools/hapticd-ros/commands/command_inputs.h"
#include "tools/hapticd-ros/dds/participant.h"
#include "tools/hapticd-ros/dds/publisher.h"
#include "tools/hapticd-ros/dds/ros_graph.h"
#include "tools/hapticd-ros/ros_bridge.h"
#include "tools/hapticd-ros/scene/scene.h"
#include "tools/hapticd-ros/status_file.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/ros/ros_name.h"

namespace hapticd::tools::ros {
namespace {

constexpr std::string_view kFramePrefix = "frame:";

/// Returns what is wrong with a value of --take; empty: nothing is.
std::string inputProblem(const std::string& name) {
  if (name == "state_command" || name == "servo_cf" || name == "servo_ci") return "";
  if (name.starts_with(kFramePrefix) && name.size() > kFramePrefix.size()) {
    std::string frame = name.substr(kFramePrefix.size());
    if (namespaceProblem(frame).empty() && !frame.contains('/')) return "";
  }
  return fmt::format(
      "{} must be state_command, servo_cf, servo_ci, or frame: and the name of a moving frame of hapticd, of "
      "letters, digits and underscores",
      base::inQuotes(name));
}

AllowedInputs allowedInputs(const std::vector<std::string>& names) {
  AllowedInputs allowed;
  for (const std::string& name : names) {
    allowed.state_command |= name == "state_command";
    allowed.servo_cf |= name == "servo_cf";
    allowed.servo_ci |= name == "servo_ci";
    if (name.starts_with(kFramePrefix)) allowed.frames.push_back(name.substr(kFramePrefix.size()));
  }
  return allowed;
}

/// A descriptor that becomes readable at SIGTERM and SIGINT; threads that begin later do not get them.
base::Descriptor takeEndingSignals() {
  sigset_t signals;
  ::sigemptyset(&signals);
  ::sigaddset(&signals, SIGTERM);
  ::sigaddset(&signals, SIGINT);
  ::sigprocmask(SIG_BLOCK, &signals, nullptr);
  return base::Descriptor(::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK));
}

int fail(const base::Error& error, int status) {
  fmt::print(stderr, "hapticd-ros: {}\n", error.text());
  return status;
}

base::Error forbiddenCommands(const Participant& participant) {
  return {
      "--take",
      fmt::format("DDS asks nobody who they are: every computer that reaches {} could command the box, and "
                  "move the hand of a person",
                  participant.interface()),
      "leave --interface out, so that only programs of this computer can; or, if you trust all computers "
      "there, add --network-may-command"};
}

void sayWhere(const Participant& participant, const Network& network, const std::string& name_space) {
  fmt::print("hapticd-ros publishes /{}/... in domain {} at {}{}\n", name_space, network.domain,
             participant.interface(),
             network.interface.empty() ? ": only programs of this computer see it (--interface)" : "");
  base::flushOutput();
  if (network.interface.empty()) return;
  fmt::print(
      stderr,
      "hapticd-ros: warning: DDS asks nobody who they are: whoever reaches {} can read all this, and can "
      "publish under the same names\n",
      participant.interface());
}

int run(int argc, char** argv) {
  CLI::App app{
      "hapticd-ros: publishes what a running hapticd measures and exerts, for ROS 2 and CRTK, over DDS.\n"
      "ROS is not needed on this computer. It takes from the network only what --take names."};
  app.footer(
      "SIGTERM or Ctrl-C ends it. Where hapticd is not running it waits.\n"
      "With ROS 2: ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ros2 topic echo /hapticd/measured_cp\n"
      "Exit status: 0 done, 64 usage, 69 the network cannot be used.");
  BridgeOptions options;
  const std::string standard_socket = config::Settings().control.status_socket;
  const char* const named = std::getenv("HAPTICD_SOCKET");
  options.socket = named != nullptr && *named != '\0' ? named : standard_socket;
  Network network{.domain = 0, .interface = "", .largest_message_bytes = kLargestSceneMessage_bytes};
  app.add_option("--socket", options.socket,
                 "of a running hapticd (HAPTICD_SOCKET, else " + standard_socket + ")")
      ->type_name("FILE");
  app.add_option("--namespace", options.name_space, "of the topics and frames (hapticd)")
      ->type_name("NAME")
      ->transform(CLI::Validator(namespaceProblem, ""));
  app.add_option("--domain", network.domain, "of DDS (0)")
      ->envname("ROS_DOMAIN_ID")
      ->type_name("NUMBER")
      ->check(within(0, Network::kLargestDomain));
  app.add_option("--interface", network.interface,
                 "name or address of the network interface to publish at (loopback: this computer only)")
      ->type_name("NAME");
  app.add_option("--rate", options.rate_hz, "of positions, velocities and forces (250)")
      ->type_name("HZ")
      ->check(within(1, 1000));
  int cloud_rate_hz = 10;
  app.add_option("--cloud-rate", cloud_rate_hz,
                 "of point clouds and depth images, while somebody subscribes (10)")
      ->type_name("HZ")
      ->check(within(Scene::kSlowest_hz, Scene::kFastest_hz));
  std::vector<std::string> inputs;
  app.add_option("--take", inputs,
                 "a topic by which programs in the network may command the box: state_command, servo_cf, "
                 "servo_ci or frame:NAME; may be given several times (none)")
      ->type_name("TOPIC")
      ->allow_extra_args(false)
      ->check(CLI::Validator(inputProblem, ""));
  const std::string standard_control = config::Settings().control.control_socket;
  std::string control_socket = standard_control;
  app.add_option("--control-socket", control_socket,
                 "of the same hapticd, for what --take names (" + standard_control + ")")
      ->type_name("FILE");
  bool network_may_command = false;
  app.add_flag(
      "--network-may-command", network_may_command,
      "allow --take also at an interface that other computers reach, each of which may then move the "
      "hand of a person");
  const char* const runtime_folder = std::getenv("RUNTIME_DIRECTORY");  // of a service of systemd
  std::string status_file =
      runtime_folder != nullptr && *runtime_folder == '/' ? std::string(runtime_folder) + "/status.json" : "";
  app.add_option("--status-file", status_file,
                 "written once a second, for 'hapticctl ros' (none; the service: " +
                     std::string(kRosStatusFile) + ")")
      ->type_name("FILE");
  app.set_version_flag("-V,--version", std::string("hapticd-ros ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  const base::Descriptor signals = takeEndingSignals();
  auto joined = Participant::join(network);
  if (!joined) return fail(joined.error(), EX_UNAVAILABLE);
  constexpr std::array kTopics{Topic::measured_cp,     Topic::measured_cv, Topic::setpoint_cf,
                               Topic::operating_state, Topic::buttons,     Topic::diagnostics,
                               Topic::tf_static};
  auto publications = Publications::open(*joined, options.name_space, kTopics);
  if (!publications) return fail(publications.error(), EX_UNAVAILABLE);
  BoxState box;
  std::unique_ptr<CommandInputs> commands;
  if (const AllowedInputs allowed = allowedInputs(inputs); allowed.any()) {
    if (!joined->isLoopback() && !network_may_command) return fail(forbiddenCommands(*joined), EX_USAGE);
    auto opened = CommandInputs::open(*joined, allowed, options.name_space, control_socket, box);
    if (!opened) return fail(opened.error(), EX_UNAVAILABLE);
    commands = std::move(*opened);
  }
  auto scene = Scene::open(*joined, {options.socket, options.name_space, cloud_rate_hz});
  if (!scene) return fail(scene.error(), EX_UNAVAILABLE);
  auto graph = RosGraph::open(*joined);
  if (!graph) return fail(graph.error(), EX_UNAVAILABLE);
  std::vector<const Publisher*> publishers = (*scene)->topics().publishers();
  std::ranges::copy(publications->publishers(), std::back_inserter(publishers));
  StatusFile status(std::move(*graph),
                    {network, *joined, options.name_space, publishers, commands.get(), box}, status_file);
  sayWhere(*joined, network, options.name_space);
  RosBridge(*publications, options, box, status, signals.get()).run();
  return EX_OK;
}

}  // namespace
}  // namespace hapticd::tools::ros

int main(int argc, char** argv) {
  return hapticd::base::runProgram("hapticd-ros", [&] { return hapticd::tools::ros::run(argc, argv); });
}
