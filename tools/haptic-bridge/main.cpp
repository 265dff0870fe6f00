// SPDX-License-Identifier: Apache-2.0
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "config/base/program.h"
#include "rt/base/realtime_thread.h"
#include "tools/lib/bridge/bridge_program.h"
#include "tools/lib/bridge/simulated_device.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools {
namespace {

struct Options {
  drivers::SimulatedHandleSettings hand;
  std::vector<double> start;
  std::vector<double> direction;
};

void addHand(CLI::App& app, Options& options) {
  drivers::SimulatedHandleSettings& hand = options.hand;
  app.add_option("--start", options.start, "where the simulated hand begins, handle frame (0,0,-0.8)")
      ->type_name("X,Y,Z")
      ->delimiter(',')
      ->expected(3)
      ->check(within(-10.0, 10.0));
  app.add_option("--direction", options.direction, "where it moves (0,0,-1)")
      ->type_name("X,Y,Z")
      ->delimiter(',')
      ->expected(3)
      ->check(within(-1.0, 1.0));
  app.add_option("--travel", hand.travel_m, "how far, metres (0.4)")
      ->type_name("METRES")
      ->check(within(0.0, 10.0));
  app.add_option("--speed", hand.speed_m_per_s, "how fast, m/s (0.1)")
      ->type_name("SPEED")
      ->check(within(0.001, 5.0));
  app.add_option("--press-force", hand.press_force_n, "how hard it presses, N (2)")
      ->type_name("NEWTONS")
      ->check(within(0.0, 50.0));
}

int run(int argc, char** argv) {
  CLI::App app{
      "haptic-bridge: connects a haptic device to a hapticd with `handle.driver: udp` on another\n"
      "computer. The device here is a simulated hand that moves forward until it feels the press force,\n"
      "strokes, and goes back; for another device write the functions of tools/lib/bridge/device.h.\n"
      "At the end it prints statistics of the packets: run it for a minute to measure a network."};
  app.footer(
      "Ctrl-C ends it, with the table. Without --duration it runs until then.\n"
      "Exit status: 0 done, 64 usage, 66 no key, 69 the local address cannot be used, 73 no log.");
  BridgeProgram program(app, "haptic-bridge", BridgeDamping::offered);
  Options options;
  addHand(app, options);
  app.set_version_flag("-V,--version", std::string("haptic-bridge ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  if (!options.start.empty()) options.hand.start_m_in_world = BridgeProgram::vectorOf(options.start);
  if (!options.direction.empty())
    options.hand.direction_in_world = BridgeProgram::vectorOf(options.direction);
  if (!(norm(options.hand.direction_in_world) > 0))
    return program.fail({"--direction", "(0, 0, 0) is not a direction", ""}, EX_USAGE);
  rt::limitThreadStacks();
  SimulatedDevice device(options.hand);
  return program.run(device);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::base::runProgram("haptic-bridge", [&] { return hapticd::tools::run(argc, argv); });
}
