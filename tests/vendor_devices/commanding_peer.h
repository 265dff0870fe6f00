// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/handle/udp/conversation.h"
#include "drivers/handle/udp/packet.h"
#include "drivers/handle/udp/udp_settings.h"
#include "drivers/handle/udp/udp_socket.h"
#include "rt/base/clock.h"

namespace hapticd::test {

/// The side of hapticd: answers each state with a force, and with mode zero while the device has a fault or
/// is not calibrated. It has a thread of its own. Thread: any.
class CommandingPeer {
 public:
  CommandingPeer()
      : socket_(std::move(*drivers::udp::UdpSocket::boundTo(*drivers::ipv4EndpointFrom("127.0.0.1")))),
        thread_([this] { run(); }) {}
  ~CommandingPeer() {
    ends_ = true;
    thread_.join();
  }
  CommandingPeer(const CommandingPeer&) = delete;
  CommandingPeer& operator=(const CommandingPeer&) = delete;

  /// For --peer.
  std::string address() const {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    ::getsockname(socket_.descriptor(), reinterpret_cast<sockaddr*>(&address), &size);
    return "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  void command(const rt::Vec3& force_n) {
    const std::lock_guard lock(mutex_);
    force_n_ = force_n;
  }
  /// The newest state; a fault before the first.
  drivers::udp::StatePacket state() {
    const std::lock_guard lock(mutex_);
    return state_;
  }
  bool isHealthy() {
    const drivers::udp::StatePacket newest = state();
    return !newest.fault && newest.calibrated;
  }

 private:
  void run() {
    while (!ends_) {
      pollfd watched{socket_.descriptor(), POLLIN, 0};
      ::poll(&watched, 1, 20);
      std::array<std::byte, 256> buffer;
      while (const auto datagram = socket_.receive(buffer)) {
        const auto state = drivers::udp::decodeState(datagram->bytes, {});
        if (!state) continue;
        socket_.send(answerTo(*state), datagram->from);
      }
    }
  }
  std::span<const std::byte> answerTo(const drivers::udp::StatePacket& state) {
    using Verdict = drivers::udp::Conversation::Verdict;
    const std::int64_t now_ns = rt::monotonicNow_ns();
    const Verdict verdict = conversation_.hear(state.header, now_ns);
    drivers::udp::CommandPacket packet;
    if (verdict == Verdict::greeting || verdict == Verdict::unproven) {
      packet.header = conversation_.answerTo(state.header, now_ns);
    } else {
      const std::lock_guard lock(mutex_);
      state_ = state;
      packet.header = conversation_.next(now_ns);
      packet.active = !state.fault && state.calibrated;
      packet.force_n_in_handle = force_n_;
    }
    bytes_ = drivers::udp::encode(packet, {});
    return bytes_.bytes();
  }

  drivers::udp::UdpSocket socket_;
  drivers::udp::Conversation conversation_;
  drivers::udp::PacketBytes bytes_;
  std::mutex mutex_;
  rt::Vec3 force_n_;
  drivers::udp::StatePacket state_ = [] {
    drivers::udp::StatePacket none;
    none.fault = true;
    return none;
  }();
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace hapticd::test
