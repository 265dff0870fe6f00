// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>
#include <sys/types.h>

#include <optional>
#include <string>

#include "config/descriptor.h"
#include "config/error.h"

namespace hapticd::daemon {

/// What the clients of a socket may do.
enum class Access {
  read,     ///< methods that change nothing
  control,  ///< all methods
};

struct ListenerOptions {
  Access access = Access::read;
  std::string path;     ///< of the socket file to create
  mode_t mode = 0660;   ///< of that file, whatever the umask
  std::string group;    ///< of that file, if it exists and may be given; empty: the process's own
  int descriptor = -1;  ///< an open listening socket (systemd's) to take over instead of creating one
};

/// A listening AF_UNIX stream socket. The file that it created is removed with it, unless it is by then
/// another's.
class ListeningSocket {
 public:
  /// Removes what a dead daemon left at the path. On failure a descriptor in `options` stays the caller's.
  /// Errors: a live daemon at the path, something else than a socket at the path, no such folder, no
  /// permission.
  static config::Result<ListeningSocket> open(const ListenerOptions& options);

  ListeningSocket(ListeningSocket&&) noexcept = default;
  ListeningSocket& operator=(ListeningSocket&&) = delete;
  ~ListeningSocket();

  int descriptor() const noexcept { return descriptor_.get(); }
  Access access() const noexcept { return access_; }
  /// Of the socket file; nothing where there is none.
  std::optional<gid_t> group() const noexcept { return group_; }

 private:
  ListeningSocket(config::Descriptor descriptor, Access access) noexcept
      : descriptor_(std::move(descriptor)), access_(access) {}

  static config::Result<ListeningSocket> adopt(const ListenerOptions& options);
  static config::Result<ListeningSocket> create(const ListenerOptions& options);

  void rememberGroup(const char* path);

  config::Descriptor descriptor_;
  Access access_;
  std::optional<gid_t> group_;
  std::string created_path_;  // empty: nothing to remove
  dev_t device_ = 0;          // of the created file
  ino_t inode_ = 0;           // of the created file
};

}  // namespace hapticd::daemon
