// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>
#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "config/base/descriptor.h"
#include "config/base/error.h"

namespace hapticd::daemon {

/// What the clients of a socket may do.
enum class Access {
  read,     ///< methods that change nothing
  control,  ///< all methods
};

struct ListenerOptions {
  Access access = Access::read;
  std::string path;    ///< path of the socket file to create
  mode_t mode = 0660;  ///< mode of that file, regardless of the umask
  std::string
      group;  ///< group of that file, if the group exists and may be set; empty: the group of the process
  int descriptor = -1;  ///< an open listening socket (systemd's) to take over instead of creating one
};

/// A listening AF_UNIX stream socket. Its destructor removes the socket file that it created, unless another
/// process has replaced that file.
class ListeningSocket {
 public:
  /// Opens the socket; a socket file that a dead daemon left at the path is removed. On failure a descriptor
  /// in `options` stays the caller's. Errors: a live daemon at the path, something other than a socket at the
  /// path, no such folder, no permission.
  static base::Result<ListeningSocket> open(const ListenerOptions& options);

  ListeningSocket(ListeningSocket&&) noexcept = default;
  ListeningSocket& operator=(ListeningSocket&&) = delete;
  ~ListeningSocket();

  int descriptor() const noexcept { return descriptor_.get(); }
  Access access() const noexcept { return access_; }
  /// The group of the socket file; nothing if there is no file.
  std::optional<gid_t> group() const noexcept { return group_; }

 private:
  ListeningSocket(base::Descriptor descriptor, Access access) noexcept
      : descriptor_(std::move(descriptor)), access_(access) {}

  static base::Result<ListeningSocket> adopt(const ListenerOptions& options);
  static base::Result<ListeningSocket> create(const ListenerOptions& options);

  void rememberGroup(const char* path);

  base::Descriptor descriptor_;
  Access access_;
  std::optional<gid_t> group_;
  std::string created_path_;  // empty: nothing to remove
  dev_t device_ = 0;          // of the created file
  ino_t inode_ = 0;           // of the created file
};

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
