// SPDX-License-Identifier: Apache-2.0
#include "tests/vendor_devices/peer.h"

#include <netinet/in.h>
#include <poll.h>

#include <array>

#include "rt/base/clock.h"

namespace hapticd::test {
namespace udp = drivers::udp;

Peer::Peer()
    : socket_(std::move(*udp::UdpSocket::boundTo(*drivers::ipv4EndpointFrom("127.0.0.1")))),
      thread_([this] { run(); }) {}

Peer::~Peer() {
  ends_ = true;
  thread_.join();
}

std::string Peer::address() const {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getsockname(socket_.descriptor(), reinterpret_cast<sockaddr*>(&address), &size);
  return "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
}

void Peer::command(const PeerCommand& command) {
  const std::lock_guard lock(mutex_);
  command_ = command;
}

udp::StatePacket Peer::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void Peer::run() {
  constexpr int kWakeMs = 20;
  while (!ends_) {
    pollfd watched{socket_.descriptor(), POLLIN, 0};
    if (::poll(&watched, 1, kWakeMs) > 0) take();
  }
}

void Peer::take() {
  std::array<std::byte, 256> buffer;
  const auto datagram = socket_.receive(buffer);
  if (!datagram) return;
  const auto state = udp::decodeState(datagram->bytes, {});
  if (!state) return;
  const std::int64_t now_ns = rt::monotonicNow_ns();
  const udp::Conversation::Verdict verdict = conversation_.hear(state->header, now_ns);
  const bool fresh = verdict == udp::Conversation::Verdict::fresh;
  udp::CommandPacket answer;
  answer.header = fresh ? conversation_.next(now_ns) : conversation_.answerTo(state->header, now_ns);
  {
    const std::lock_guard lock(mutex_);
    answer.active = fresh;
    answer.force_n_in_handle = command_.force_n;
    answer.torque_n_m_in_handle = command_.torque_n_m;
    answer.gripper_force_n = command_.gripper_force_n;
    if (fresh) state_ = *state;
  }
  if (fresh) ++states_;
  socket_.send(udp::encode(answer, {}).bytes(), datagram->from);
}

}  // namespace hapticd::test
