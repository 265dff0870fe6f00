// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace hapticd::daemon {

/// The process at the other end of a Unix socket, as the kernel recorded it when it connected.
struct Peer {
  uid_t uid = 0;
  pid_t pid = 0;
  std::vector<gid_t> groups;  ///< the primary group and the supplementary ones
};

/// The peer of a socket; nothing if the kernel does not report it.
std::optional<Peer> peerOf(int socket);

bool isMember(const Peer& peer, std::optional<gid_t> group);
/// Whether the peer may change something: root, the user of this process, and members of `group`.
bool mayControl(const Peer& peer, std::optional<gid_t> group);

/// The number of a group; nothing if there is no group of that name.
std::optional<gid_t> groupNamed(const std::string& name);

}  // namespace hapticd::daemon
