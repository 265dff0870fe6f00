// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "config/base/program.h"
#include "tools/haptic-crtk-bridge/arm_topics.h"
#include "tools/lib/bridge/bridge_program.h"
#include "tools/lib/device/threaded_device.h"
#include "tools/lib/device_check/device_check.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/ros/ros_name.h"

namespace hapticd::tools::crtk {
namespace {

constexpr const char* kName = "haptic-crtk-bridge";

struct Options {
  ArmOptions arm;
  ros::Network network;
};

void addArm(CLI::App& app, Options& options) {
  static const std::map<std::string, WrenchConvention> kConventions{
      {"body-absolute", WrenchConvention::body_absolute},
      {"body", WrenchConvention::body},
      {"base", WrenchConvention::base},
      {"spatial", WrenchConvention::spatial}};
  app.add_option("--arm", options.arm.arm, "namespace of the arm, for example MTMR")
      ->type_name("NAME")
      ->transform(CLI::Validator(ros::namespaceProblem, ""));
  app.add_option_function<std::string>(
         "--wrench", [&options](const std::string& word) { options.arm.convention = kConventions.at(word); },
         "how the arm takes a force: body-absolute (body/servo_cf along the axes of measured_cp, after "
         "body/set_cf_orientation_absolute), body (body/servo_cf along the axes of the tip), base "
         "(body/servo_cf along the axes of measured_cp, by arms without that setting), or "
         "spatial (spatial/servo_cf, with local/measured_cp) (body-absolute)")
      ->type_name("CONVENTION")
      ->check(CLI::IsMember(kConventions).description(""));
  app.add_option("--frame", options.arm.frame,
                 "frame_id that the measurements must have (that of the first one)")
      ->type_name("NAME");
  app.add_flag("--gravity-compensation", options.arm.gravity_compensation,
               "turn it on: without it an MTM falls as soon as it is driven by forces");
  app.add_option("--domain", options.network.domain, "of DDS (0)")
      ->envname("ROS_DOMAIN_ID")
      ->type_name("NUMBER")
      ->check(within(0, ros::Network::kLargestDomain));
  app.add_option("--interface", options.network.interface,
                 "name or address of the network interface to the arm (loopback: this computer only)")
      ->type_name("NAME");
}

base::Result<std::unique_ptr<ThreadedDevice>> deviceFor(const Options& options) {
  auto topics = ArmTopics::open(options.network, options.arm);
  if (!topics) return std::unexpected(topics.error());
  return std::make_unique<ThreadedDevice>(makeArmDriver(std::move(*topics), options.arm), kName);
}

/// What to try where forces go along other axes than commanded; only a further check may use it.
std::string wrenchRemedy(WrenchConvention convention, ForceAxes axes) {
  if (axes == ForceAxes::turned && convention == WrenchConvention::body)
    return "The arm takes forces along the axes of measured_cp: check it with --wrench base.";
  if (axes == ForceAxes::turned && convention != WrenchConvention::spatial)
    return "The arm takes forces along the axes of the tip: check it with --wrench body.";
  return "";
}

int fail(const base::Error& error, int status) {
  fmt::print(stderr, "{}: {}\n", kName, error.text());
  return status;
}

int runCheck(int argc, char** argv) {
  CLI::App app{
      "haptic-crtk-bridge check: leads you through a check of an arm, without a hapticd: axes, signs, a "
      "push\n"
      "of 0.3 N along each axis in three orientations of the tool, latency, and that the force ends when\n"
      "commands stop. Use it before the first contact: a force in a wrong frame is the commonest error with\n"
      "these arms, and it shows which --wrench the arm takes. It prints the angles of the handle's pose for\n"
      "hapticd.yaml and writes a log to send in.",
      "haptic-crtk-bridge check"};
  app.footer(
      "Exit status: 0 nothing wrong, 64 usage, 65 not a log, 66 no log, 69 a problem was found or the\n"
      "network cannot be used, 71 no thread, 73 no log written.");
  CheckOptions check{.program = kName, .version = HAPTICD_VERSION, .kind = "crtk-arm"};
  Options options;
  addArm(app, options);
  if (const auto status = parseCheck(app, check, argc, argv)) return *status;
  if (options.arm.arm.empty()) return fail({"--arm", "names no arm", "for example --arm MTMR"}, EX_USAGE);
  auto device = deviceFor(options);
  if (!device) return fail(device.error(), EX_UNAVAILABLE);
  check.remedy = [&options](ForceAxes axes) { return wrenchRemedy(options.arm.convention, axes); };
  return checkDevice(check, **device);
}

int run(int argc, char** argv) {
  if (argc > 1 && argv[1] == std::string_view("check")) return runCheck(argc - 1, argv + 1);
  CLI::App app{
      "haptic-crtk-bridge: connects a dVRK MTM, or any arm that speaks CRTK over ROS 2, to a hapticd with\n"
      "`handle.driver: udp`, over DDS and without ROS. 'haptic-crtk-bridge check --help' says how to try an\n"
      "arm first.\n"
      "CRTK gives forces no time-out: when this program is killed with SIGKILL or the network to the arm\n"
      "breaks, the arm keeps the last force unless it has a watchdog of its own."};
  app.footer(
      "SIGTERM or Ctrl-C ends it, with zero forces to the arm and the table. An arm that is missing or lost\n"
      "is looked for each second.\n"
      "Exit status: 0 done, 64 usage, 66 no key, 69 the network or the local address cannot be used,\n"
      "71 no thread, 73 no log.");
  Options options;
  addArm(app, options);
  app.get_option("--arm")->required();
  BridgeProgram program(app, kName, BridgeDamping::never);
  app.set_version_flag("-V,--version", fmt::format("{} {}", kName, HAPTICD_VERSION));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  auto device = deviceFor(options);
  if (!device) return fail(device.error(), EX_UNAVAILABLE);
  return program.run(**device, [&device] { return (*device)->start(); });
}

}  // namespace
}  // namespace hapticd::tools::crtk

int main(int argc, char** argv) {
  return hapticd::base::runProgram(hapticd::tools::crtk::kName,
                                   [&] { return hapticd::tools::crtk::run(argc, argv); });
}
