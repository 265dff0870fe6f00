// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/bridge/bridge_program.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <sysexits.h>

#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <utility>

#include "config/base/value_text.h"
#include "drivers/handle/udp/udp_settings.h"
#include "rt/base/realtime_thread.h"
#include "tools/lib/child/child_process.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools {
namespace {

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

}  // namespace

BridgeProgram::BridgeProgram(CLI::App& app, std::string name, BridgeDamping damping)
    : name_(std::move(name)) {
  app.add_option("--peer", peer_, "where hapticd waits")->required()->type_name("ADDRESS:PORT");
  app.add_option("--local", local_, "where packets are sent from (any free port; at loopback if --peer is)")
      ->type_name("ADDRESS:PORT");
  app.add_option("--key-file", key_file_, "with the key of udp_handle.key_file (no authentication)")
      ->type_name("FILE");
  app.add_option("--protocol", bridge_.protocol,
                 "version of the packets; 1 for a hapticd that knows no other (2)")
      ->type_name("N")
      ->check(within(drivers::udp::kOldestVersion, drivers::udp::kVersion));
  app.add_option("--duration", duration_s_, "seconds to run")
      ->type_name("SECONDS")
      ->check(within(0.001, 1e6));
  app.add_option("--log", log_, "one row per tick: newest command and its age, exerted force, position")
      ->type_name("CSV")
      ->check(endsIn(".csv"));
  app.add_option("--max-force", bridge_.max_force_n, "what the person bears, N (10)")
      ->type_name("NEWTONS")
      ->check(within(0.0, 100.0));
  bridge_.damps = damping == BridgeDamping::offered;
  if (bridge_.damps) addDamping(app);
  addImpairments(app);
}

void BridgeProgram::addDamping(CLI::App& app) {
  app.add_option("--max-damping", bridge_.max_damping_n_s_per_m,
                 "what the device can damp without noise, N s/m (20)")
      ->type_name("DAMPING")
      ->check(within(0.0, 1000.0));
  app.add_flag_callback(
      "--no-damping", [this] { bridge_.damps = false; }, "leave the damping in contact to hapticd");
}

void BridgeProgram::addImpairments(CLI::App& app) {
  Impairments& impairments = bridge_.impairments;
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

int BridgeProgram::fail(const base::Error& error, int status) const {
  fmt::print(stderr, "{}: {}\n", name_, error.text());
  return status;
}

base::Result<void> BridgeProgram::readEndpoints() {
  if (auto ok = readEndpoint(peer_, "--peer", bridge_.peer); !ok) return ok;
  // nothing of another computer is meant for a bridge whose hapticd is here
  if (isLoopback(bridge_.peer)) bridge_.local.address = INADDR_LOOPBACK;
  return local_.empty() ? base::Result<void>{} : readEndpoint(local_, "--local", bridge_.local);
}

int BridgeProgram::run(Device& device, const std::function<base::Result<void>()>& start) {
  if (auto ok = readEndpoints(); !ok) return fail(ok.error(), EX_USAGE);
  auto key = drivers::udp::keyFrom(key_file_);
  if (!key) return fail(key.error(), EX_NOINPUT);
  bridge_.key = std::move(*key);
  auto socket = drivers::udp::UdpSocket::boundTo(bridge_.local);
  if (!socket) return fail(socket.error(), EX_UNAVAILABLE);
  std::unique_ptr<DeviceLog> log;
  if (!log_.empty()) {
    auto opened = DeviceLog::at(log_);
    if (!opened) return fail(opened.error(), EX_CANTCREAT);
    log = std::move(*opened);
  }

  // A page that was evicted would be read from the disk, which may stall. Where locking is not permitted the
  // bridge works without.
  (void)rt::lockMemory();
  Bridge bridge(bridge_, *socket, device, log.get());
  {
    const Interrupt interrupt;  // from the end of the run on Ctrl-C ends the program at once
    if (start) {
      if (auto started = start(); !started) return fail(started.error(), EX_OSERR);
    }
    bridge.run(
        [&](double seconds) { return interrupt.requested() || (duration_s_ > 0 && seconds >= duration_s_); });
  }
  fmt::print("{}", bridgeTable(bridge.summary()));
  if (log) {
    if (auto finished = log->finish(); !finished) return fail(finished.error(), EX_CANTCREAT);
  }
  return EX_OK;
}

}  // namespace hapticd::tools
