// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/server/listening_socket.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

namespace hapticd::daemon {
namespace {

constexpr int kBacklog = 32;

std::string reason(int error) {
  return std::strerror(error);
}

base::Result<sockaddr_un> addressOf(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty()) return base::failure("socket", "the path is empty", "name a path in the group 'control'");
  if (path.find('\0') != std::string::npos || path.size() >= sizeof address.sun_path) {
    return base::failure(path,
                         fmt::format("the path has {} bytes, at most {} are possible", path.size(),
                                     sizeof address.sun_path - 1),
                         "choose a shorter path in the group 'control'");
  }
  path.copy(address.sun_path, path.size());
  return address;
}

/// The result of connect() to the address: 0 if somebody accepts, else errno.
int probe(const sockaddr_un& address) {
  const base::Descriptor client(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!client) return errno;
  const int result = ::connect(client.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  return result == 0 ? 0 : errno;
}

base::Result<void> removeStale(const std::string& path, const sockaddr_un& address) {
  struct stat file {};
  if (::lstat(path.c_str(), &file) != 0) return {};  // bind() reports what is wrong, if anything is
  if (!S_ISSOCK(file.st_mode)) {
    return base::failure(path, "there is a file that is not a socket", "move it away or choose another path");
  }
  const int answer = probe(address);
  if (answer == 0 || answer == EAGAIN) {
    return base::failure(path, "another daemon listens there",
                         "stop it first ('systemctl stop hapticd'), or choose another path");
  }
  if (answer != ECONNREFUSED && answer != ENOENT) {
    return base::failure(path, "cannot determine whether another daemon listens there: " + reason(answer),
                         "check the owner and the mode of the file, or remove it");
  }
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) {
    return base::failure(path, "cannot remove what an earlier daemon left there: " + reason(errno),
                         "check the owner and the mode of the folder");
  }
  return {};
}

base::Result<void> bindTo(int descriptor, const std::string& path, const sockaddr_un& address) {
  if (::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return {};
  const int error = errno;
  const std::string folder = std::filesystem::absolute(path).parent_path().string();
  switch (error) {
    case ENOENT:
      return base::failure(path, fmt::format("the folder {} does not exist", folder),
                           "create it, or choose another path in the group 'control'");
    case EACCES:
    case EPERM:
    case EROFS:
      return base::failure(path,
                           fmt::format("no permission to create a file in {}: {}", folder, reason(error)),
                           "change the folder's owner, or choose another path in the group 'control'");
    default:
      return base::failure(path, "cannot create the socket: " + reason(error), "choose another path");
  }
}

/// Best effort: if the group cannot be set, the socket keeps the group of the process, which suits an
/// unprivileged user.
void giveToGroup(const std::string& path, const std::string& group) {
  const auto number = group.empty() ? std::nullopt : groupNamed(group);
  if (!number) return;
  [[maybe_unused]] const int result = ::chown(path.c_str(), static_cast<uid_t>(-1), *number);
}

}  // namespace

base::Result<ListeningSocket> ListeningSocket::open(const ListenerOptions& options) {
  return options.descriptor >= 0 ? adopt(options) : create(options);
}

base::Result<ListeningSocket> ListeningSocket::adopt(const ListenerOptions& options) {
  int listening = 0;
  socklen_t size = sizeof listening;
  sockaddr_un address{};
  socklen_t address_size = sizeof address;
  const bool usable =
      ::getsockopt(options.descriptor, SOL_SOCKET, SO_ACCEPTCONN, &listening, &size) == 0 && listening != 0 &&
      ::getsockname(options.descriptor, reinterpret_cast<sockaddr*>(&address), &address_size) == 0 &&
      address.sun_family == AF_UNIX;
  if (!usable) {
    return base::failure(fmt::format("descriptor {}", options.descriptor), "is not a listening Unix socket",
                         "check ListenStream= in the socket unit");
  }
  const int flags = ::fcntl(options.descriptor, F_GETFL);
  ::fcntl(options.descriptor, F_SETFL, flags | O_NONBLOCK);
  ::fcntl(options.descriptor, F_SETFD, FD_CLOEXEC);
  ListeningSocket listener(base::Descriptor(options.descriptor), options.access);
  address.sun_path[sizeof address.sun_path - 1] = '\0';
  listener.rememberGroup(address.sun_path);
  return listener;
}

/// The path of the socket; empty for a socket without a file.
void ListeningSocket::rememberGroup(const char* path) {
  struct stat file {};
  if (::stat(path, &file) == 0) group_ = file.st_gid;
}

base::Result<ListeningSocket> ListeningSocket::create(const ListenerOptions& options) {
  const auto address = addressOf(options.path);
  if (!address) return std::unexpected(address.error());
  if (auto removed = removeStale(options.path, *address); !removed) return std::unexpected(removed.error());

  ListeningSocket listener(base::Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)),
                           options.access);
  if (!listener.descriptor_) return base::failure(options.path, "cannot open a socket: " + reason(errno), "");
  if (auto bound = bindTo(listener.descriptor(), options.path, *address); !bound) {
    return std::unexpected(bound.error());
  }
  listener.created_path_ = options.path;
  struct stat file {};
  if (::lstat(options.path.c_str(), &file) != 0) {
    return base::failure(options.path, "the socket vanished: " + reason(errno), "");
  }
  listener.device_ = file.st_dev;
  listener.inode_ = file.st_ino;

  // Nobody can connect before listen(), so nobody connects before the mode is right.
  giveToGroup(options.path, options.group);
  if (::chmod(options.path.c_str(), options.mode) != 0) {
    return base::failure(options.path, "cannot set the socket's mode: " + reason(errno), "");
  }
  listener.rememberGroup(options.path.c_str());
  if (::listen(listener.descriptor(), kBacklog) != 0) {
    return base::failure(options.path, "cannot listen: " + reason(errno), "");
  }
  return listener;
}

ListeningSocket::~ListeningSocket() {
  if (!descriptor_ || created_path_.empty()) return;
  struct stat file {};
  if (::lstat(created_path_.c_str(), &file) != 0) return;
  if (file.st_dev == device_ && file.st_ino == inode_) ::unlink(created_path_.c_str());
}

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
