// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/dds/participant.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <linux/filter.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <netdb.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

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

/// Lets a socket receive only what arrives at the interface, by the device and not by addresses, which can be
/// forged. Returns 0, or -1 with errno.
int restrictTo(const Interface& interface, int descriptor) {
  if (interface.is_loopback)
    return ::setsockopt(descriptor, SOL_SOCKET, SO_BINDTODEVICE, interface.name.data(),
                        static_cast<socklen_t>(interface.name.size()));
  // bound to the device, it would not hear programs of this computer, which reach it by way of loopback
  std::array filter{
      sock_filter BPF_STMT(BPF_LD | BPF_W | BPF_ABS, std::uint32_t(SKF_AD_OFF + SKF_AD_HATYPE)),
      sock_filter BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ARPHRD_LOOPBACK, 2, 0),
      sock_filter BPF_STMT(BPF_LD | BPF_W | BPF_ABS, std::uint32_t(SKF_AD_OFF + SKF_AD_IFINDEX)),
      sock_filter BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ::if_nametoindex(interface.name.c_str()), 0, 1),
      sock_filter BPF_STMT(BPF_RET | BPF_K, std::uint32_t(-1)),
      sock_filter BPF_STMT(BPF_RET | BPF_K, 0)};
  const sock_fprog program{filter.size(), filter.data()};
  return ::setsockopt(descriptor, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program);
}

/// While it lives, what this thread binds is restricted to the interface.
class Restriction {
 public:
  explicit Restriction(const Interface& interface) : interface_(interface) { current = this; }
  ~Restriction() { current = nullptr; }
  Restriction(const Restriction&) = delete;
  Restriction& operator=(const Restriction&) = delete;

  bool apply(int descriptor) {
    ++sockets_;
    return restrictTo(interface_, descriptor) == 0;
  }
  int sockets() const { return sockets_; }

  static inline thread_local Restriction* current = nullptr;

 private:
  const Interface& interface_;
  int sockets_ = 0;
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
std::string configurationFor(const Interface& interface, std::uint32_t largest_message_bytes) {
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
      "{}<Internal><MaxSampleSize>{} B</MaxSampleSize><HeartbeatInterval>20 ms</HeartbeatInterval>"
      "<WriterLingerDuration>200 ms</WriterLingerDuration></Internal></Domain></CycloneDDS>",
      interface.name, interface.is_loopback ? " multicast=\"true\"" : "",
      interface.is_loopback ? "spdp" : "default", interface.is_loopback ? kLargeDatagrams : "", discovery,
      largest_message_bytes);
}

base::Error failureOf(const std::string& what, const Network& network, dds_return_t code,
                      const std::string& words) {
  return {fmt::format("DDS domain {}", network.domain),
          fmt::format("{}: {}{}", what, dds_strretcode(-code), words.empty() ? "" : " (" + words + ")"),
          "another --domain or --interface may do; the ports are those from " +
              std::to_string(7400 + 250 * network.domain) + " on"};
}

}  // namespace

/// In place of the C library's: Cyclone DDS binds what receives to every address of this computer whatever
/// its settings say, so each socket is restricted before it can receive anything.
extern "C" int bind(int descriptor, const sockaddr* address, socklen_t size) noexcept {
  Restriction* const restriction = address->sa_family == AF_INET ? Restriction::current : nullptr;
  if (restriction != nullptr && !restriction->apply(descriptor)) return -1;
  return static_cast<int>(::syscall(SYS_bind, descriptor, address, size));
}

base::Result<Participant> Participant::join(const Network& network) {
  static const DdsWords words;
  const auto interface = find(network.interface);
  if (!interface) return std::unexpected(interface.error());
  const auto id = static_cast<dds_domainid_t>(network.domain);

  DdsWords::keep();
  Restriction restriction(*interface);
  DdsEntity domain(
      dds_create_domain(id, configurationFor(*interface, network.largest_message_bytes).c_str()));
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
  if (restriction.sockets() == 0)
    return std::unexpected(base::Error{fmt::format("DDS domain {}", network.domain),
                                       "its sockets cannot be bound to " + interface->name,
                                       "this build and this Cyclone DDS do not go together"});
  if (!said.empty())
    fmt::print(stderr, "{}: Cyclone DDS: {}\n", program_invocation_short_name, base::printable(said));
  return Participant(std::make_shared<Joined>(std::move(domain), std::move(participant), interface->name,
                                              interface->is_loopback));
}

}  // namespace hapticd::tools::ros
