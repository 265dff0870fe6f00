// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace hapticd::daemon {

/// Who is at the other end of a Unix socket, as the kernel knows it from the moment of connecting.
struct Peer {
  uid_t uid = 0;
  pid_t pid = 0;
  std::vector<gid_t> groups;  ///< the primary one and the supplementary ones
};

/// Nothing where the kernel does not tell.
std::optional<Peer> peerOf(int socket);

bool isMember(const Peer& peer, std::optional<gid_t> group);
/// Whether the peer may change something: root, the user of this process, and members of `group`.
bool mayControl(const Peer& peer, std::optional<gid_t> group);

/// The number of a group; nothing where there is none of that name.
std::optional<gid_t> groupNamed(const std::string& name);

}  // namespace hapticd::daemon
