// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/server/peer.h"

#include <grp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace hapticd::daemon {
namespace {

/// Reads SO_PEERGROUPS, socket(7): the kernel refuses a buffer that is too small and reports the size needed.
std::optional<std::vector<gid_t>> supplementaryGroupsOf(int socket) {
  std::vector<gid_t> groups(64);
  auto size = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  int result = ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size);
  if (result != 0 && errno == ERANGE) {
    groups.resize(size / sizeof(gid_t));
    result = ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size);
  }
  if (result != 0) return std::nullopt;
  groups.resize(size / sizeof(gid_t));
  return groups;
}

}  // namespace

std::optional<Peer> peerOf(int socket) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return std::nullopt;
  Peer peer{credentials.uid, credentials.pid, {}};
  // Without the list the peer counts as a member of its primary group only: it may do less, never more.
  if (auto groups = supplementaryGroupsOf(socket)) peer.groups = std::move(*groups);
  peer.groups.push_back(credentials.gid);
  return peer;
}

bool isMember(const Peer& peer, std::optional<gid_t> group) {
  return group && std::ranges::find(peer.groups, *group) != peer.groups.end();
}

bool mayControl(const Peer& peer, std::optional<gid_t> group) {
  return peer.uid == 0 || peer.uid == ::geteuid() || isMember(peer, group);
}

std::optional<gid_t> groupNamed(const std::string& name) {
  struct group entry {};
  struct group* found = nullptr;
  std::array<char, 4096> names;
  if (::getgrnam_r(name.c_str(), &entry, names.data(), names.size(), &found) != 0 || !found)
    return std::nullopt;
  return entry.gr_gid;
}

}  // namespace hapticd::daemon
