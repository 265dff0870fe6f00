// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/connection.h"

#include <linux/usb/ch9.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace hapticd::test::usbip {

Urb& UrbQueue::add(const Command& command) {
  if (free_.empty()) free_.emplace_back();
  waiting_.splice(waiting_.end(), free_, free_.begin());
  waiting_.back().command = command;
  return waiting_.back();
}

const Urb* UrbQueue::oldest(std::uint8_t endpoint) const {
  const auto found =
      std::ranges::find(waiting_, endpoint, [](const Urb& urb) { return urb.command.endpoint; });
  return found != waiting_.end() ? &*found : nullptr;
}

bool UrbQueue::remove(std::uint32_t sequence) {
  const auto found =
      std::ranges::find(waiting_, sequence, [](const Urb& urb) { return urb.command.sequence; });
  if (found == waiting_.end()) return false;
  free_.splice(free_.begin(), waiting_, found);
  return true;
}

namespace {

constexpr std::size_t kReservedUrbs = 64;
constexpr std::size_t kMaxOutBytes = 64 << 10;
constexpr std::size_t kMaxBodyBytes = kMaxOutBytes + kMaxIsoPackets * kIsoDescriptorBytes;
constexpr std::size_t kMaxReplyDataBytes = (kMaxIsoPackets + 1) * kMaxIsoPacketBytes;

bool isIn(std::uint8_t endpoint) {
  return (endpoint & USB_DIR_IN) != 0;
}

bool isControl(std::uint8_t endpoint) {
  return (endpoint & USB_ENDPOINT_NUMBER_MASK) == 0;
}

/// Returns the number of bytes after the header.
std::size_t bodyBytes(const Command& command) {
  const std::size_t data = isIn(command.endpoint) ? 0 : command.transfer_bytes;
  return data + command.iso_packets * kIsoDescriptorBytes;
}

template <std::size_t count>
std::span<std::uint8_t, count> part(std::vector<std::uint8_t>& bytes, std::size_t at) {
  return std::span<std::uint8_t, count>(bytes.data() + at, count);
}

}  // namespace

Connection::Connection(int socket, UsbDevice& device, UrbCounts& counts, Log log)
    : socket_(socket),
      device_(device),
      counts_(counts),
      log_(std::move(log)),
      standard_(device),
      urbs_(kReservedUrbs),
      received_(2 * (kHeaderBytes + kMaxBodyBytes)),
      reply_(kHeaderBytes + kMaxReplyDataBytes + kMaxIsoPackets * kIsoDescriptorBytes) {
  device_.reset();
}

Connection::~Connection() {
  device_.reset();
  ::close(socket_);
}

void Connection::receive() {
  const ssize_t count =
      ::recv(socket_, received_.data() + received_bytes_, received_.size() - received_bytes_, MSG_DONTWAIT);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (count <= 0) return giveUp(count == 0 ? "the host has hung up" : std::strerror(errno));
  received_bytes_ += static_cast<std::size_t>(count);
  std::size_t handled = 0;
  while (alive_) {
    const std::size_t bytes = handleFirst(std::span(received_).first(received_bytes_).subspan(handled));
    if (bytes == 0) break;
    handled += bytes;
  }
  received_bytes_ -= handled;
  std::memmove(received_.data(), received_.data() + handled, received_bytes_);
}

/// Bytes of the request that was handled, 0 when it is not complete yet.
std::size_t Connection::handleFirst(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kHeaderBytes) return 0;
  const Command command = parseCommand(bytes.first<kHeaderBytes>());
  if (command.kind == CommandKind::unlink) {
    unlink(command);
    return kHeaderBytes;
  }
  const bool outsized = command.iso_packets > kMaxIsoPackets ||
                        (!isIn(command.endpoint) && command.transfer_bytes > kMaxOutBytes);
  if (command.kind == CommandKind::unknown || outsized) {
    giveUp("the host sent a request that is unknown or too large");
    return 0;
  }
  const std::size_t body = bodyBytes(command);
  if (bytes.size() < kHeaderBytes + body) return 0;
  submit(command, bytes.subspan(kHeaderBytes, body));
  return kHeaderBytes + body;
}

void Connection::submit(const Command& command, std::span<const std::uint8_t> body) {
  ++counts_.submitted;
  if (isControl(command.endpoint)) return control(command, body);
  if (!isIn(command.endpoint)) {
    device_.receive(command.endpoint, body.first(command.iso_packets == 0 ? body.size() : 0));
    return reply({.sequence = command.sequence, .actual_length = command.transfer_bytes}, {});
  }
  Urb& urb = urbs_.add(command);
  for (std::size_t i = 0; i < command.iso_packets; ++i) {
    urb.iso[i] = parseIsoDescriptor(body.subspan(i * kIsoDescriptorBytes).first<kIsoDescriptorBytes>());
  }
}

void Connection::control(const Command& command, std::span<const std::uint8_t> data) {
  if (!device_.answers(command.setup)) {
    urbs_.add(command);
    return;
  }
  const std::uint8_t before = standard_.configuration();
  const auto standard = standard_.answer(command.setup);
  const ControlAnswer answer = standard ? *standard : device_.control(command.setup, data);
  if (standard_.configuration() != before) {
    log_("configuration " + std::to_string(standard_.configuration()) + " set");
  }
  if (!answer.understood) return reply({.sequence = command.sequence, .status = -EPIPE}, {});
  const std::size_t wanted = std::min<std::size_t>(command.transfer_bytes, answer.bytes.size());
  const std::size_t length = isIn(command.endpoint) ? wanted : data.size();
  reply({.sequence = command.sequence, .actual_length = static_cast<std::uint32_t>(length)},
        isIn(command.endpoint) ? answer.bytes.first(wanted) : std::span<const std::uint8_t>());
}

void Connection::unlink(const Command& command) {
  const bool found = urbs_.remove(command.unlink_sequence);
  ++(found ? counts_.unlinked : counts_.unlinked_late);
  writeUnlinkReply(command.sequence, found ? -ECONNRESET : 0, part<kHeaderBytes>(reply_, 0));
  send(kHeaderBytes);
}

std::size_t Connection::pendingIsoPackets(std::uint8_t endpoint) const {
  const Urb* const urb = urbs_.oldest(endpoint);
  return urb != nullptr ? urb->command.iso_packets : 0;
}

std::size_t Connection::pendingBytes(std::uint8_t endpoint) const {
  const Urb* const urb = urbs_.oldest(endpoint);
  return urb != nullptr ? std::min<std::size_t>(urb->command.transfer_bytes, kMaxReplyDataBytes) : 0;
}

void Connection::complete(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) {
  const Command command = urbs_.oldest(endpoint)->command;
  urbs_.remove(command.sequence);
  const std::size_t count = std::min<std::size_t>(bytes.size(), command.transfer_bytes);
  reply({.sequence = command.sequence, .actual_length = static_cast<std::uint32_t>(count)},
        bytes.first(count));
}

void Connection::completeIsochronous(std::uint8_t endpoint) {
  const Urb& urb = *urbs_.oldest(endpoint);
  const std::size_t packets = urb.command.iso_packets;
  std::array<IsoDescriptor, kMaxIsoPackets> descriptors = urb.iso;
  std::size_t at = kHeaderBytes;
  for (IsoDescriptor& packet : std::span(descriptors).first(packets)) {
    const std::size_t bytes = device_.isoPacket(endpoint, part<kMaxIsoPacketBytes>(reply_, at));
    packet.actual_length = static_cast<std::uint32_t>(std::min<std::size_t>(bytes, packet.length));
    packet.status = bytes > packet.length ? -EOVERFLOW : 0;
    at += packet.actual_length;
  }
  const SubmitReply header{.sequence = urb.command.sequence,
                           .actual_length = static_cast<std::uint32_t>(at - kHeaderBytes),
                           .start_frame = urb.command.start_frame,
                           .iso_packets = urb.command.iso_packets};
  writeSubmitReply(header, part<kHeaderBytes>(reply_, 0));
  for (const IsoDescriptor& packet : std::span(descriptors).first(packets)) {
    writeIsoDescriptor(packet, part<kIsoDescriptorBytes>(reply_, at));
    at += kIsoDescriptorBytes;
  }
  urbs_.remove(header.sequence);
  ++counts_.completed;
  send(at);
}

void Connection::reply(const SubmitReply& reply, std::span<const std::uint8_t> data) {
  writeSubmitReply(reply, part<kHeaderBytes>(reply_, 0));
  // a loop over bytes would be most of what an emulated CPU does while a camera streams
  if (!data.empty()) std::memcpy(reply_.data() + kHeaderBytes, data.data(), data.size());
  ++counts_.completed;
  send(kHeaderBytes + data.size());
}

/// Waits where the socket is full: the kernel reads without waiting for us.
void Connection::send(std::size_t count) {
  for (std::size_t sent = 0; sent < count && alive_;) {
    const ssize_t now = ::send(socket_, reply_.data() + sent, count - sent, MSG_NOSIGNAL);
    if (now < 0 && errno == EINTR) continue;
    if (now < 0) return giveUp(std::strerror(errno));
    sent += static_cast<std::size_t>(now);
  }
}

void Connection::giveUp(std::string_view why) {
  if (alive_) log_("connection ended: " + std::string(why));
  alive_ = false;
}

}  // namespace hapticd::test::usbip
