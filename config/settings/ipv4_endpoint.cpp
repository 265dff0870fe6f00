// SPDX-License-Identifier: Apache-2.0
#include "config/settings/ipv4_endpoint.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <charconv>

#include "config/base/value_text.h"

namespace hapticd::config {
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

}  // namespace hapticd::config
