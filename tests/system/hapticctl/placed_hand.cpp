// SPDX-License-Identifier: Apache-2.0
#include "tests/system/hapticctl/placed_hand.h"

#include <fmt/format.h>

#include <stdexcept>

#include "drivers/handle/udp/udp_settings.h"
#include "tests/system/support/bridge_log.h"

namespace hapticd::test {
namespace {

constexpr int kDaemonPort = 47800;
constexpr int kHandPort = 47801;
/// Between two readings, which are a millisecond apart: slower than what counts as a leap.
constexpr double kStep_m = 0.0005;

drivers::Ipv4Endpoint endpoint(int host, int port) {
  return *drivers::ipv4EndpointFrom(fmt::format("{}:{}", ownLoopback(host), port));
}

drivers::udp::UdpSocket openSocket() {
  auto socket = drivers::udp::UdpSocket::boundTo(endpoint(2, kHandPort));
  if (!socket) throw std::runtime_error(socket.error().text());
  return std::move(*socket);
}

tools::BridgeOptions optionsOf() {
  tools::BridgeOptions options;
  options.peer = endpoint(1, kDaemonPort);
  options.local = endpoint(2, kHandPort);
  return options;
}

}  // namespace

PlacedHand::PlacedHand(const rt::Vec3& start_m)
    : position_m_(start_m),
      aim_m_(start_m),
      socket_(openSocket()),
      bridge_(optionsOf(), socket_, *this, nullptr),
      thread_([this] { bridge_.run([this](double) { return ends_.load(); }); }) {}

PlacedHand::~PlacedHand() {
  ends_ = true;
  thread_.join();
}

std::string PlacedHand::yaml() {
  return fmt::format("handle: {{driver: udp}}\nudp_handle: {{address: {}, peer: '{}:{}'}}\n", ownLoopback(1),
                     ownLoopback(2), kHandPort);
}

bool PlacedHand::reaches(Daemon& daemon, const rt::Vec3& position_m) {
  {
    const std::lock_guard lock(mutex_);
    aim_m_ = position_m;
    tremble_m_ = 0;
  }
  return daemon.reaches([&](const nlohmann::json& status) {
    return status.at("handle").at("state") == "present" &&
           rt::norm(vectorOf(status.at("tick").at("hipMInWorld")) - position_m) < 1e-6;
  });
}

tools::DeviceReading PlacedHand::read() {
  const std::lock_guard lock(mutex_);
  const rt::Vec3 to_aim_m = aim_m_ - position_m_;
  const double distance_m = rt::norm(to_aim_m);
  position_m_ = distance_m <= kStep_m ? aim_m_ : position_m_ + (kStep_m / distance_m) * to_aim_m;
  tools::DeviceReading reading;
  reading.position_m = position_m_;
  constexpr int kHalfPeriod = 100;
  if (++readings_ / kHalfPeriod % 2 == 0) reading.position_m.x += tremble_m_;
  reading.buttons = button_ ? 2 : 0;
  return reading;
}

}  // namespace hapticd::test
