// SPDX-License-Identifier: Apache-2.0
#include "config/warnings.h"

#include <fmt/format.h>

#include <optional>

#include "config/ipv4_endpoint.h"
#include "config/value_text.h"

namespace hapticd::config {
namespace {

/// Returns whether packets of other computers reach the handle.
bool isOpenToTheNetwork(const UdpHandleSettings& udp) {
  const Result<Ipv4Endpoint> address = ipv4EndpointFrom(udp.address);
  const Result<Ipv4Endpoint> peer = ipv4EndpointFrom(udp.peer);
  return (address && !isLoopback(*address)) || (peer && !isLoopback(*peer));
}

std::optional<Error> unauthenticatedHandle(const HandleSettings& handle) {
  const UdpHandleSettings& udp = handle.udp;
  if (handle.driver != HandleDriver::udp || !udp.key_file.empty() || !isOpenToTheNetwork(udp)) {
    return std::nullopt;
  }
  return Error{
      "udp_handle.key_file",
      fmt::format("is empty, and packets arrive over a network (udp_handle.address {}, udp_handle.peer "
                  "{}): anyone who can send packets with the peer's address can move the handle",
                  inQuotes(udp.address), inQuotes(udp.peer)),
      "give both computers the same key, made with: openssl rand 32"};
}

}  // namespace

std::vector<Error> warningsOf(const Settings& settings) {
  std::vector<Error> warnings;
  if (auto warning = unauthenticatedHandle(settings.handle)) warnings.push_back(std::move(*warning));
  return warnings;
}

}  // namespace hapticd::config
