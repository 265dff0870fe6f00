// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/udp/udp_settings.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <utility>

#include "config/base/descriptor.h"
#include "config/base/value_text.h"

namespace hapticd::drivers {
namespace {

std::unexpected<base::Error> refused(std::string_view text, std::string_view why) {
  return std::unexpected(base::Error{"", fmt::format("{} {}", base::inQuotes(text), why),
                                     "write it as 192.0.2.10, or with a port as 192.0.2.10:47801"});
}

}  // namespace

base::Result<Ipv4Endpoint> ipv4EndpointFrom(std::string_view text) {
  const std::size_t colon = text.find(':');
  const std::string address_text(text.substr(0, colon));
  in_addr address{};
  if (::inet_pton(AF_INET, address_text.c_str(), &address) != 1 ||
      address_text.size() != std::string_view(address_text.c_str()).size()) {
    return refused(text, "is not an IPv4 address");
  }
  Ipv4Endpoint endpoint{ntohl(address.s_addr), 0};
  if (colon == std::string_view::npos) return endpoint;
  const std::string_view digits = text.substr(colon + 1);
  const char* const end = digits.data() + digits.size();
  const auto [stopped, failure] = std::from_chars(digits.data(), end, endpoint.port);
  if (failure != std::errc() || stopped != end || endpoint.port == 0) {
    return refused(text, "has no port in 1..65535 after the colon");
  }
  return endpoint;
}

std::string textOf(const Ipv4Endpoint& endpoint) {
  const std::uint32_t a = endpoint.address;
  const std::string address = fmt::format("{}.{}.{}.{}", a >> 24, (a >> 16) & 255, (a >> 8) & 255, a & 255);
  return endpoint.port == 0 ? address : fmt::format("{}:{}", address, endpoint.port);
}

namespace {

void checkUdpAddress(const UdpHandleSettings& udp, std::vector<config::Conflict>& conflicts) {
  const base::Result<Ipv4Endpoint> address = ipv4EndpointFrom(udp.address);
  if (!address || address->port != 0) {
    config::addConflict(
        conflicts, {"udp_handle.address"},
        address ? fmt::format("{} names a port", base::inQuotes(udp.address)) : address.error().what,
        "write the address as 192.0.2.1, and the port in udp_handle.port");
  }
  if (udp.peer.empty()) return;
  const base::Result<Ipv4Endpoint> peer = ipv4EndpointFrom(udp.peer);
  constexpr std::uint32_t kFirstMulticast = 0xE0000000;
  if (!peer || peer->address == 0 || peer->address >= kFirstMulticast) {
    config::addConflict(
        conflicts, {"udp_handle.peer"},
        peer ? fmt::format("{} is not the address of a single computer", base::inQuotes(udp.peer))
             : peer.error().what,
        "write it as 192.0.2.10, or with a port as 192.0.2.10:47801");
  } else if (address && isLoopback(*address) && !isLoopback(*peer)) {
    config::addConflict(
        conflicts, {"udp_handle.address", "udp_handle.peer"},
        fmt::format("{} can be reached only from this computer, but udp_handle.peer is {}", udp.address,
                    udp.peer),
        "set udp_handle.address to this computer's address in the peer's network, or to 0.0.0.0 for all");
  }
}

/// Returns whether packets of other computers reach the handle.
bool isOpenToTheNetwork(const UdpHandleSettings& udp) {
  const base::Result<Ipv4Endpoint> address = ipv4EndpointFrom(udp.address);
  const base::Result<Ipv4Endpoint> peer = ipv4EndpointFrom(udp.peer);
  return (address && !isLoopback(*address)) || (peer && !isLoopback(*peer));
}

}  // namespace

void checkUdpHandle(const config::Settings& settings, std::vector<config::Conflict>& conflicts) {
  checkUdpAddress(settings.handle.of<UdpHandleSettings>(), conflicts);
  if (settings.handle.driver != "udp" || !settings.handle.of<UdpHandleSettings>().peer.empty()) return;
  config::addConflict(conflicts, {"udp_handle.peer", "handle.driver"},
                      "is empty, and the handle.driver udp needs it",
                      "set udp_handle.peer to the IPv4 address of the computer that holds the device");
}

std::optional<base::Error> unauthenticatedHandle(const config::HandleSettings& handle) {
  const UdpHandleSettings& udp = handle.of<UdpHandleSettings>();
  if (!udp.key_file.empty() || !isOpenToTheNetwork(udp)) {
    return std::nullopt;
  }
  return base::Error{
      "udp_handle.key_file",
      fmt::format("is empty, and packets arrive over a network (udp_handle.address {}, udp_handle.peer "
                  "{}): anyone who can send packets with the peer's address can move the handle",
                  base::inQuotes(udp.address), base::inQuotes(udp.peer)),
      "give both computers the same key, made with: openssl rand 32"};
}

std::vector<config::Need> needsOfUdpHandle(const config::HandleSettings& settings) {
  const auto& udp = settings.of<UdpHandleSettings>();
  return {
      config::PortNeed{udp.port, "udp_handle.port"},
      config::FileNeed{.noun = "key",
                       .path = udp.key_file,
                       .remedy = "put the key there that both sides share, or correct udp_handle.key_file",
                       .optional = true,
                       .secret = true}};
}

}  // namespace hapticd::drivers

namespace hapticd::drivers::udp {
namespace {

std::unexpected<base::Error> refused(const std::string& path, std::string what, const char* remedy) {
  return std::unexpected(base::Error{fmt::format("key file {}", path), std::move(what), remedy});
}

}  // namespace

base::Result<std::vector<std::byte>> keyFrom(const std::string& path) {
  std::vector<std::byte> key;
  if (path.empty()) return key;
  const base::Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (!file || ::fstat(file.get(), &status) != 0) {
    return refused(path, std::strerror(errno),
                   "let the program's user or group read it, or correct its path");
  }
  if (!S_ISREG(status.st_mode)) return refused(path, "not a regular file", "correct its path");
  if ((status.st_mode & S_IRWXO) != 0) {
    return refused(path, "others may read or write it",
                   "run chmod o= on it, and make a new key if others had access");
  }
  key.resize(kMaxKeyBytes + 1);
  const ssize_t size = ::read(file.get(), key.data(), key.size());
  if (size < 0) return refused(path, std::strerror(errno), "");
  key.resize(static_cast<std::size_t>(size));
  if (key.size() < kMinKeyBytes || key.size() > kMaxKeyBytes) {
    return refused(path,
                   fmt::format("has {} bytes, allowed: {} to {}", status.st_size, kMinKeyBytes, kMaxKeyBytes),
                   "make one with: openssl rand 32");
  }
  return key;
}

}  // namespace hapticd::drivers::udp
