// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/tests/kernel_side.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <stdexcept>

#include "tests/support/program.h"

namespace hapticd::test {
namespace {

constexpr std::uint32_t kDevice = 0x00010002;

void add32(Bytes& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8)
    bytes.push_back(static_cast<std::uint8_t>(value >> shift & 0xff));
}

std::uint32_t numberAt(const Bytes& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | bytes.at(at + i);
  return value;
}

Bytes setupOf(std::uint8_t request_type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
              std::size_t length) {
  const auto low = [](std::size_t number) { return static_cast<std::uint8_t>(number & 0xff); };
  return {request_type, request,          low(value),  low(value >> 8U),
          low(index),   low(index >> 8U), low(length), low(length >> 8)};
}

bool becomesReadable(int socket, int timeout_ms) {
  pollfd waiting{socket, POLLIN, 0};
  return ::poll(&waiting, 1, timeout_ms) == 1;
}

int patienceMs() {
  return static_cast<int>(std::chrono::milliseconds(maxPatience()).count());
}

}  // namespace

KernelSide::~KernelSide() {
  ::close(socket_);
}

std::uint32_t KernelSide::submit(bool in, std::uint8_t endpoint, std::uint32_t length, const Bytes& setup,
                                 std::size_t packets, const Bytes& body) {
  submitted_[++newest_] = {in, packets};
  Bytes bytes;
  for (const std::uint32_t word : {1U, newest_, kDevice, in ? 1U : 0U, std::uint32_t{endpoint}, 0U, length,
                                   7U, static_cast<std::uint32_t>(packets), 1U}) {
    add32(bytes, word);
  }
  bytes.insert(bytes.end(), setup.begin(), setup.end());
  bytes.insert(bytes.end(), body.begin(), body.end());
  send(bytes);
  return newest_;
}

std::uint32_t KernelSide::submitIn(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                                   std::uint16_t length, std::uint16_t index) {
  return submit(true, 0, length, setupOf(request_type, request, value, index, length), 0, {});
}

std::uint32_t KernelSide::submitOut(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                                    const Bytes& data, std::uint16_t index) {
  return submit(false, 0, static_cast<std::uint32_t>(data.size()),
                setupOf(request_type, request, value, index, data.size()), 0, data);
}

std::uint32_t KernelSide::submitBulk(std::uint8_t endpoint, std::uint32_t bytes) {
  return submit(true, endpoint & 0x0f, bytes, Bytes(8), 0, {});
}

std::uint32_t KernelSide::submitIso(std::uint8_t endpoint, std::size_t packets, std::uint32_t packet_bytes) {
  Bytes descriptors;
  for (std::uint32_t packet = 0; packet < packets; ++packet) {
    for (const std::uint32_t word : {packet * packet_bytes, packet_bytes, 0U, 0U}) add32(descriptors, word);
  }
  const auto length = static_cast<std::uint32_t>(packets) * packet_bytes;
  return submit(true, endpoint & 0x0f, length, Bytes(8), packets, descriptors);
}

std::uint32_t KernelSide::unlink(std::uint32_t sequence) {
  Bytes bytes;
  for (const std::uint32_t word : {2U, ++newest_, kDevice, 0U, 0U, sequence}) add32(bytes, word);
  bytes.resize(48);
  send(bytes);
  return newest_;
}

void KernelSide::send(const Bytes& bytes) {
  if (::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(bytes.size())) {
    throw std::runtime_error("the device does not take what is sent");
  }
}

Bytes KernelSide::receive(std::size_t count) const {
  Bytes bytes(count);
  for (std::size_t at = 0; at < count;) {
    if (!becomesReadable(socket_, patienceMs())) throw std::runtime_error("no reply");
    const ssize_t got = ::recv(socket_, bytes.data() + at, count - at, 0);
    if (got <= 0) throw std::runtime_error("the device has hung up");
    at += static_cast<std::size_t>(got);
  }
  return bytes;
}

KernelSide::Reply KernelSide::next() {
  const Bytes header = receive(48);
  Reply reply{.command = numberAt(header, 0),
              .sequence = numberAt(header, 4),
              .status = std::bit_cast<std::int32_t>(numberAt(header, 20))};
  if (reply.command != 3) return reply;
  reply.actual_length = numberAt(header, 24);
  const Submitted submitted = submitted_.at(reply.sequence);
  submitted_.erase(reply.sequence);  // a second reply to it throws
  if (submitted.in) reply.data = receive(reply.actual_length);
  if (numberAt(header, 32) != submitted.packets) throw std::runtime_error("another number of packets");
  auto data = reply.data.begin();
  for (std::size_t packet = 0; packet < submitted.packets; ++packet) {
    const Bytes descriptor = receive(16);
    const std::uint32_t length = numberAt(descriptor, 8);
    if (length > reply.data.end() - data) throw std::runtime_error("packets longer than the data");
    reply.packets.emplace_back(data, data + length);
    data += length;
  }
  if (submitted.packets != 0 && data != reply.data.end()) throw std::runtime_error("data in no packet");
  return reply;
}

bool KernelSide::hasNothing() const {
  return !becomesReadable(socket_, 0);
}

bool KernelSide::isHungUp() const {
  std::uint8_t byte = 0;
  return becomesReadable(socket_, patienceMs()) && ::recv(socket_, &byte, 1, MSG_PEEK) == 0;
}

void KernelSide::hangUp() {
  ::shutdown(socket_, SHUT_RDWR);
}

SocketPair::SocketPair() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw std::runtime_error("no socket pair");
  }
  kernel = ends[0];
  device = ends[1];
}

}  // namespace hapticd::test
