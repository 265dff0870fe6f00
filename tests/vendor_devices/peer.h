// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/handle/udp/conversation.h"
#include "drivers/handle/udp/packet.h"
#include "drivers/handle/udp/udp_socket.h"

namespace hapticd::test {

/// What a Peer commands; always in mode active.
struct PeerCommand {
  rt::Vec3 force_n = {};
  rt::Vec3 torque_n_m = {};
  double gripper_force_n = 0;
};

/// The side of hapticd, without its caution: it answers every state with the same command, whatever the state
/// says. Thread: any.
class Peer {
 public:
  Peer();
  ~Peer();
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  /// ADDRESS:PORT on which it waits.
  std::string address() const;
  void command(const PeerCommand& command);
  /// The newest state that was accepted.
  drivers::udp::StatePacket state() const;
  /// Whether that is of a device that may exert forces.
  bool isHealthy() const {
    const drivers::udp::StatePacket newest = state();
    return !newest.fault && newest.calibrated;
  }
  /// How many states were accepted.
  std::uint64_t states() const { return states_; }

 private:
  void run();
  void take();

  drivers::udp::UdpSocket socket_;
  drivers::udp::Conversation conversation_;
  mutable std::mutex mutex_;
  PeerCommand command_;
  drivers::udp::StatePacket state_;
  std::atomic<std::uint64_t> states_{0};
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace hapticd::test
