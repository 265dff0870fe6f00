// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/dds/participant.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>

#include "config/base/value_text.h"

namespace hapticd::tools::ros {
namespace {

/// What Cyclone DDS says: kept while a call is made whose error it explains, printed otherwise.
class DdsWords {
 public:
  DdsWords() { dds_set_log_sink(&DdsWords::take, nullptr); }

  /// Keeps the words from now on.
  static void keep() {
    const std::lock_guard lock(mutex_);
    kept_.emplace();
  }
  /// Returns those that were kept, and prints later ones.
  static std::string given() {
    const std::lock_guard lock(mutex_);
    return std::exchange(kept_, std::nullopt).value_or("");
  }

 private:
  static void take(void*, const dds_log_data_t* data) {
    std::string_view words(data->message, data->size);
    while (words.ends_with('\n')) words.remove_suffix(1);
    const std::lock_guard lock(mutex_);
    if (!kept_) {
      fmt::print(stderr, "{}: Cyclone DDS: {}\n", program_invocation_short_name, base::printable(words));
    } else {
      *kept_ += fmt::format("{}{}", kept_->empty() ? "" : "; ", words);
    }
  }

  static inline std::mutex mutex_;
  static inline std::optional<std::string> kept_;
};

/// Numeric form of an address; empty for what is no IP address.
std::string addressText(const sockaddr* address) {
  std::array<char, NI_MAXHOST> text{};
  if (address == nullptr || (address->sa_family != AF_INET && address->sa_family != AF_INET6)) return "";
  const socklen_t size = address->sa_family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
  const int failure = ::getnameinfo(address, size, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST);
  return failure == 0 ? text.data() : "";
}

struct Interface {
  std::string name;
  bool is_loopback = false;
};

/// Returns the interface with this name or address, or the loopback interface.
base::Result<Interface> find(const std::string& wanted) {
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0)
    return std::unexpected(
        base::Error{"--interface", "the interfaces of this computer cannot be listed", ""});
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(first, &::freeifaddrs);
  std::string names;
  bool is_down = false;
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    const std::string address = addressText(one->ifa_addr);
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    const bool is_loopback = (one->ifa_flags & IFF_LOOPBACK) != 0;
    names += (names.empty() ? "" : ", ") + std::string(one->ifa_name) + " " + address;
    if (wanted.empty() ? !is_loopback : wanted != one->ifa_name && wanted != address) continue;
    if ((one->ifa_flags & IFF_UP) != 0) return Interface{one->ifa_name, is_loopback};
    is_down = true;
  }
  const std::string which = wanted.empty() ? "the loopback interface" : base::inQuotes(wanted);
  if (is_down) return std::unexpected(base::Error{"--interface", which + " is down", "'ip link' shows them"});
  return std::unexpected(base::Error{"--interface", which + " has no IPv4 address here",
                                     names.empty() ? "no interface has one" : "there are " + names});
}

/// On loopback ROS 2 looks for others at the ports of the first 33 participants, without multicast, when its
/// discovery range is LOCALHOST; the same is done here, beside multicast for those who rely on it.
std::string configurationFor(const Interface& interface) {
  const std::string discovery = interface.is_loopback
                                    ? "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
                                      "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
                                      "<Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery>"
                                    : "";
  // a cloud of 3.7 MB in 60 packets instead of 2700; 65507 bytes are the most that UDP takes
  constexpr const char* kLargeDatagrams =
      "<MaxMessageSize>65000B</MaxMessageSize><FragmentSize>62000B</FragmentSize>";
  // heartbeats ask for what got lost; the usual 100 ms would make each cloud with a lost packet late
  return fmt::format(
      "<CycloneDDS><Domain><General>"
      "<Interfaces><NetworkInterface "
      "name=\"{}\"{}/></Interfaces><AllowMulticast>{}</AllowMulticast>{}</General>"
      "{}<Internal><HeartbeatInterval>20 ms</HeartbeatInterval><WriterLingerDuration>200 "
      "ms</WriterLingerDuration></Internal></Domain></CycloneDDS>",
      interface.name, interface.is_loopback ? " multicast=\"true\"" : "",
      interface.is_loopback ? "spdp" : "default", interface.is_loopback ? kLargeDatagrams : "", discovery);
}

base::Error failureOf(const std::string& what, const Network& network, dds_return_t code,
                      const std::string& words) {
  return {fmt::format("DDS domain {}", network.domain),
          fmt::format("{}: {}{}", what, dds_strretcode(-code), words.empty() ? "" : " (" + words + ")"),
          "another --domain or --interface may do; the ports are those from " +
              std::to_string(7400 + 250 * network.domain) + " on"};
}

}  // namespace

base::Result<Participant> Participant::join(const Network& network) {
  static const DdsWords words;
  const auto interface = find(network.interface);
  if (!interface) return std::unexpected(interface.error());
  const auto id = static_cast<dds_domainid_t>(network.domain);

  DdsWords::keep();
  DdsEntity domain(dds_create_domain(id, configurationFor(*interface).c_str()));
  if (domain.get() < 0)
    return std::unexpected(failureOf("Cyclone DDS does not start", network, domain.get(), DdsWords::given()));
  dds_qos_t* const qos = dds_create_qos();
  constexpr std::string_view kUserData = "enclave=/;";
  dds_qset_userdata(qos, kUserData.data(), kUserData.size());
  DdsEntity participant(dds_create_participant(id, qos, nullptr));
  dds_delete_qos(qos);
  const std::string said = DdsWords::given();
  if (participant.get() < 0)
    return std::unexpected(failureOf("no participant can be made", network, participant.get(), said));
  if (!said.empty())
    fmt::print(stderr, "{}: Cyclone DDS: {}\n", program_invocation_short_name, base::printable(said));
  return Participant(std::make_shared<Joined>(std::move(domain), std::move(participant), interface->name,
                                              interface->is_loopback));
}

}  // namespace hapticd::tools::ros
