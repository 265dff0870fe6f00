// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/connection_owner.h"

#include <fmt/format.h>
#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <optional>

#include "config/base/descriptor.h"

namespace hapticd::tools::view {
namespace {

using boost::asio::ip::address;
using boost::asio::ip::tcp;

void put(const address& from, __be32 (&to)[4]) {
  if (from.is_v4()) {
    const auto bytes = from.to_v4().to_bytes();
    std::memcpy(to, bytes.data(), bytes.size());
  } else {
    const auto bytes = from.to_v6().to_bytes();
    std::memcpy(to, bytes.data(), bytes.size());
  }
}

struct Question {
  nlmsghdr head;
  inet_diag_req_v2 body;
};

/// Asks for the socket at the other end.
Question questionAbout(const address& remote, std::uint16_t remote_port, const address& local,
                       std::uint16_t local_port) {
  Question question{};
  question.head.nlmsg_len = sizeof question;
  question.head.nlmsg_type = SOCK_DIAG_BY_FAMILY;
  question.head.nlmsg_flags = NLM_F_REQUEST;
  question.body.sdiag_family = remote.is_v4() ? AF_INET : AF_INET6;
  question.body.sdiag_protocol = IPPROTO_TCP;
  question.body.idiag_states = ~0U;
  put(remote, question.body.id.idiag_src);
  put(local, question.body.id.idiag_dst);
  question.body.id.idiag_sport = htons(remote_port);
  question.body.id.idiag_dport = htons(local_port);
  question.body.id.idiag_cookie[0] = question.body.id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
  return question;
}

/// Nothing: the kernel knows no such socket of a process.
std::optional<uid_t> userIn(const std::byte* answer, std::size_t bytes) {
  nlmsghdr head{};
  inet_diag_msg body{};
  if (bytes < NLMSG_HDRLEN + sizeof body) return std::nullopt;
  std::memcpy(&head, answer, sizeof head);
  std::memcpy(&body, answer + NLMSG_HDRLEN, sizeof body);
  if (head.nlmsg_type != SOCK_DIAG_BY_FAMILY) return std::nullopt;
  // a socket that listens at that port is another one, and one that was closed belongs to nobody
  if (body.idiag_state == TCP_LISTEN || body.idiag_inode == 0) return std::nullopt;
  return body.idiag_uid;
}

std::optional<uid_t> userAt(const tcp::endpoint& remote, const tcp::endpoint& local) {
  const base::Descriptor socket(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_SOCK_DIAG));
  if (!socket) return std::nullopt;
  const Question question = questionAbout(plainAddress(remote.address()), remote.port(),
                                          plainAddress(local.address()), local.port());
  if (::send(socket.get(), &question, sizeof question, 0) < 0) return std::nullopt;
  std::array<std::byte, 4096> answer;
  const ssize_t bytes = ::recv(socket.get(), answer.data(), answer.size(), MSG_DONTWAIT);
  if (bytes < 0) return std::nullopt;
  return userIn(answer.data(), static_cast<std::size_t>(bytes));
}

}  // namespace

address plainAddress(const address& any) {
  if (!any.is_v6() || !any.to_v6().is_v4_mapped()) return any;
  return boost::asio::ip::make_address_v4(boost::asio::ip::v4_mapped, any.to_v6());
}

std::string connectionOwner(const tcp::endpoint& remote, const tcp::endpoint& local) {
  if (const auto user = userAt(remote, local)) return fmt::format("user {}", *user);
  return plainAddress(remote.address()).to_string();
}

}  // namespace hapticd::tools::view
