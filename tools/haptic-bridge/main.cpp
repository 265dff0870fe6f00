// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "config/base/program.h"
#include "config/base/value_text.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "drivers/handle/udp/key_file.h"
#include "rt/base/realtime_thread.h"
#include "tools/haptic-bridge/bridge.h"
#include "tools/haptic-bridge/device.h"
#include "tools/lib/child/child_process.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools {
namespace {

struct Options {
  BridgeOptions bridge;
  std::string peer;
  std::string local;
  std::string key_file;
  std::string log;
  double duration_s = 0;
  drivers::SimulatedHandleSettings hand;
  std::vector<double> start;
  std::vector<double> direction;
};

int fail(const base::Error& error, int status) {
  fmt::print(stderr, "haptic-bridge: {}\n", error.text());
  return status;
}

base::Result<void> readEndpoint(const std::string& text, const char* option, drivers::Ipv4Endpoint& into) {
  auto endpoint = drivers::ipv4EndpointFrom(text);
  if (endpoint && endpoint->port == 0) {
    return std::unexpected(base::Error{option, fmt::format("{} names no port", base::inQuotes(text)), ""});
  }
  if (!endpoint) {
    return std::unexpected(base::Error{option, endpoint.error().what, endpoint.error().remedy});
  }
  into = *endpoint;
  return {};
}

rt::Vec3 vectorOf(const std::vector<double>& xyz) {
  return {xyz[0], xyz[1], xyz[2]};
}

/// The options as CLI11 could not check them by itself.
base::Result<void> complete(Options& options) {
  if (auto ok = readEndpoint(options.peer, "--peer", options.bridge.peer); !ok) return ok;
  if (!options.local.empty()) {
    if (auto ok = readEndpoint(options.local, "--local", options.bridge.local); !ok) return ok;
  }
  if (!options.start.empty()) options.hand.start_m_in_world = vectorOf(options.start);
  if (!options.direction.empty()) options.hand.direction_in_world = vectorOf(options.direction);
  if (norm(options.hand.direction_in_world) > 0) return {};
  return std::unexpected(base::Error{"--direction", "(0, 0, 0) is not a direction", ""});
}

int bridge(Options& options) {
  if (auto ok = complete(options); !ok) return fail(ok.error(), EX_USAGE);
  rt::limitThreadStacks();
  auto key = drivers::udp::keyFrom(options.key_file);
  if (!key) return fail(key.error(), EX_NOINPUT);
  options.bridge.key = std::move(*key);
  auto socket = drivers::udp::UdpSocket::boundTo(options.bridge.local);
  if (!socket) return fail(socket.error(), EX_UNAVAILABLE);
  std::unique_ptr<DeviceLog> log;
  if (!options.log.empty()) {
    auto opened = DeviceLog::at(options.log);
    if (!opened) return fail(opened.error(), EX_CANTCREAT);
    log = std::move(*opened);
  }

  // A page that was evicted would be read from the disk, which may stall. Where locking is not permitted the
  // bridge works without.
  (void)rt::lockMemory();
  SimulatedDevice device(options.hand);
  Bridge bridge(options.bridge, *socket, device, log.get());
  {
    const Interrupt interrupt;  // from the end of the run on Ctrl-C ends the program at once
    bridge.run([&](double seconds) {
      return interrupt.requested() || (options.duration_s > 0 && seconds >= options.duration_s);
    });
  }
  fmt::print("{}", bridgeTable(bridge.summary()));
  if (log) {
    if (auto finished = log->finish(); !finished) return fail(finished.error(), EX_CANTCREAT);
  }
  return EX_OK;
}

void addImpairments(CLI::App& app, Impairments& impairments) {
  const auto addShare = [&app](const char* name, double& share, const char* what) {
    app.add_option(name, share, what)->type_name("SHARE")->check(within(0.0, 1.0));
  };
  app.add_option("--delay-ms", impairments.delay_ms, "delay of each packet, in each direction (0)")
      ->type_name("MS")
      ->check(within(0.0, 1000.0));
  addShare("--loss", impairments.loss, "share of packets that are lost, in each direction (0)");
  addShare("--duplicate", impairments.duplicate, "share of packets that arrive twice, in each direction (0)");
  addShare("--reorder", impairments.reorder, "share of packets overtaken by others, in each direction (0)");
  addShare("--corrupt", impairments.corrupt, "share of packets with a wrong bit, in each direction (0)");
  app.add_option("--seed", impairments.seed, "of these impairments (1)")
      ->type_name("N")
      ->check(within(std::uint64_t{0}, std::numeric_limits<std::uint64_t>::max()));
}

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
      "strokes, and goes back; for another device write the two functions of tools/haptic-bridge/device.h.\n"
      "At the end it prints statistics of the packets: run it for a minute to measure a network."};
  app.footer(
      "Ctrl-C ends it, with the table. Without --duration it runs until then.\n"
      "Exit status: 0 done, 64 usage, 66 no key, 69 the local address cannot be used, 73 no log.");
  Options options;
  app.add_option("--peer", options.peer, "where hapticd waits")->required()->type_name("ADDRESS:PORT");
  app.add_option("--local", options.local, "where packets are sent from (any free port)")
      ->type_name("ADDRESS:PORT");
  app.add_option("--key-file", options.key_file, "with the key of udp_handle.key_file (no authentication)")
      ->type_name("FILE");
  app.add_option("--duration", options.duration_s, "seconds to run")
      ->type_name("SECONDS")
      ->check(within(0.001, 1e6));
  app.add_option("--log", options.log,
                 "one row per tick: newest command and its age, exerted force, position")
      ->type_name("CSV")
      ->check(endsIn(".csv"));
  app.add_option("--max-force", options.bridge.max_force_n, "what the device bears, N (10)")
      ->type_name("NEWTONS")
      ->check(within(0.0, 100.0));
  app.add_option("--max-damping", options.bridge.max_damping_n_s_per_m,
                 "what the device can damp without noise, N s/m (20)")
      ->type_name("DAMPING")
      ->check(within(0.0, 1000.0));
  app.add_flag_callback(
      "--no-damping", [&options] { options.bridge.damps = false; },
      "leave the damping in contact to hapticd");
  addHand(app, options);
  addImpairments(app, options.bridge.impairments);
  app.set_version_flag("-V,--version", std::string("haptic-bridge ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  return bridge(options);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::base::runProgram("haptic-bridge", [&] { return hapticd::tools::run(argc, argv); });
}
