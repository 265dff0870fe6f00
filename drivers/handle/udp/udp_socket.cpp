// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/udp/udp_socket.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/ip.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace hapticd::drivers::udp {
namespace {

sockaddr_in socketAddressOf(const Ipv4Endpoint& endpoint) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(endpoint.address);
  address.sin_port = htons(endpoint.port);
  return address;
}

const char* remedyFor(int failure) {
  switch (failure) {
    case EADDRNOTAVAIL:
      return "is the network up? otherwise correct the address: `ip -4 address` lists this computer's";
    case EADDRINUSE:
      return "end the program that holds the port (`ss -ulpn` names it), or choose another port";
    case EACCES:
      return "choose a port above 1023";
    default:
      return "";
  }
}

std::unexpected<base::Error> failed(const Ipv4Endpoint& local, int failure) {
  return std::unexpected(
      base::Error{fmt::format("UDP {}", textOf(local)), std::strerror(failure), remedyFor(failure)});
}

}  // namespace

base::Result<UdpSocket> UdpSocket::boundTo(const Ipv4Endpoint& local) {
  UdpSocket socket;
  socket.descriptor_ = base::Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket.descriptor_) return failed(local, errno);
  // Expedited forwarding (RFC 3246): switches and wireless cards that know it let these packets pass first.
  // Networks that do not are no reason to stop.
  const int service = IPTOS_DSCP_EF;
  ::setsockopt(socket.descriptor(), IPPROTO_IP, IP_TOS, &service, sizeof service);
  const sockaddr_in address = socketAddressOf(local);
  if (::bind(socket.descriptor(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return failed(local, errno);
  }
  return socket;
}

std::optional<UdpSocket::Datagram> UdpSocket::receive(std::span<std::byte> buffer) const {
  sockaddr_in from{};
  socklen_t length = sizeof from;
  const ssize_t size =
      ::recvfrom(descriptor(), buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
  if (size < 0) return std::nullopt;
  return Datagram{buffer.first(static_cast<std::size_t>(size)),
                  {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)}};
}

int UdpSocket::send(std::span<const std::byte> bytes, const Ipv4Endpoint& to) const {
  const sockaddr_in address = socketAddressOf(to);
  const ssize_t sent = ::sendto(descriptor(), bytes.data(), bytes.size(), MSG_NOSIGNAL,
                                reinterpret_cast<const sockaddr*>(&address), sizeof address);
  return sent < 0 ? errno : 0;
}

}  // namespace hapticd::drivers::udp
