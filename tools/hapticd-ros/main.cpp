// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/signalfd.h>
#include <sysexits.h>
#include <CLI/CLI.hpp>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

#include "config/base/descriptor.h"
#include "config/base/error.h"
#include "config/base/program.h"
#include "config/settings/settings.h"
#include "tools/hapticd-ros/dds/participant.h"
#include "tools/hapticd-ros/dds/publications.h"
#include "tools/hapticd-ros/messages/ros_name.h"
#include "tools/hapticd-ros/ros_bridge.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools::ros {
namespace {

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

void sayWhere(const Publications& publications, const Network& network, const std::string& name_space) {
  fmt::print("hapticd-ros publishes /{}/... in domain {} at {}{}\n", name_space, network.domain,
             publications.interface(),
             network.interface.empty() ? ": only programs of this computer see it (--interface)" : "");
  base::flushOutput();
  if (network.interface.empty()) return;
  fmt::print(
      stderr,
      "hapticd-ros: warning: DDS asks nobody who they are: whoever reaches {} can read all this, and can "
      "publish under the same names\n",
      publications.interface());
}

int run(int argc, char** argv) {
  CLI::App app{
      "hapticd-ros: publishes what a running hapticd measures and exerts, for ROS 2 and CRTK, over DDS.\n"
      "ROS is not needed on this computer. It only reads from hapticd, and takes nothing from the network."};
  app.footer(
      "SIGTERM or Ctrl-C ends it. Where hapticd is not running it waits.\n"
      "With ROS 2: ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ros2 topic echo /hapticd/measured_cp\n"
      "Exit status: 0 done, 64 usage, 69 the network cannot be used.");
  BridgeOptions options;
  const std::string standard_socket = config::Settings().control.status_socket;
  const char* const named = std::getenv("HAPTICD_SOCKET");
  options.socket = named != nullptr && *named != '\0' ? named : standard_socket;
  Network network;
  app.add_option("--socket", options.socket,
                 "of a running hapticd (HAPTICD_SOCKET, else " + standard_socket + ")")
      ->type_name("FILE");
  app.add_option("--namespace", options.name_space, "of the topics and frames (hapticd)")
      ->type_name("NAME")
      ->check(CLI::Validator(namespaceProblem, ""));
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
  app.set_version_flag("-V,--version", std::string("hapticd-ros ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  const base::Descriptor signals = takeEndingSignals();
  auto participant = Participant::join(network);
  if (!participant) return fail(participant.error(), EX_UNAVAILABLE);
  auto publications =
      Publications::open(std::move(*participant), options.name_space, options.name_space + "/world");
  if (!publications) return fail(publications.error(), EX_UNAVAILABLE);
  sayWhere(*publications, network, options.name_space);
  RosBridge(std::move(*publications), options, signals.get()).run();
  return EX_OK;
}

}  // namespace
}  // namespace hapticd::tools::ros

int main(int argc, char** argv) {
  return hapticd::base::runProgram("hapticd-ros", [&] { return hapticd::tools::ros::run(argc, argv); });
}
