// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/client/varlink_client.h"

#include <fmt/format.h>
#include <grp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string_view>
#include <utility>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

using Clock = std::chrono::steady_clock;

/// Four times the longest reply of the daemon.
constexpr std::size_t kMaxReplyBytes = 1024 * 1024;

/// The group of the socket file; haptic if it cannot be read.
std::string groupOf(const std::string& path) {
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0) return "haptic";
  struct group entry {};
  struct group* found = nullptr;
  std::array<char, 4096> names;
  if (::getgrgid_r(file.st_gid, &entry, names.data(), names.size(), &found) != 0 || !found) return "haptic";
  return entry.gr_name;
}

ClientError connectError(const std::string& path, int error) {
  const std::string running =
      "is hapticd running? Start it with 'systemctl start hapticd', or name its socket with --socket or "
      "HAPTICD_SOCKET";
  ClientError result{ClientError::Kind::no_connection, "", running, {}, error};
  switch (error) {
    case ENOENT:
      result.what = fmt::format("there is no socket {}", path);
      break;
    case ECONNREFUSED:
      result.what = fmt::format("nothing listens on {}", path);
      break;
    case EACCES:
    case EPERM:
      result.what = fmt::format("no permission to use {}", path);
      result.remedy = fmt::format(
          "members of the group {} may: 'sudo usermod -aG {} $USER', then log in again; or use sudo",
          groupOf(path), groupOf(path));
      break;
    default:
      result.what = fmt::format("cannot connect to {}: {}", path, std::strerror(error));
  }
  return result;
}

ClientError errorReply(const Json& reply) {
  ClientError error{ClientError::Kind::error_reply, reply["error"].get<std::string>(), "", Json::object(), 0};
  if (reply.contains("parameters") && reply["parameters"].is_object()) error.parameters = reply["parameters"];
  return error;
}

}  // namespace

ClientResult<VarlinkClient> VarlinkClient::connect(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    return std::unexpected(connectError(path, path.empty() ? ENOENT : ENAMETOOLONG));
  }
  path.copy(address.sun_path, path.size());

  VarlinkClient client(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), path);
  if (client.socket_ < 0) return std::unexpected(connectError(path, errno));
  // Also limits how long connect() waits for a place in the queue.
  const timeval limit{kTimeLimit.count(), 0};
  ::setsockopt(client.socket_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  if (::connect(client.socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return std::unexpected(connectError(path, errno));
  }
  return client;
}

VarlinkClient::VarlinkClient(VarlinkClient&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      path_(std::move(other.path_)),
      input_(std::move(other.input_)),
      received_(std::move(other.received_)),
      interrupt_(other.interrupt_),
      promises_more_(other.promises_more_) {}

VarlinkClient::~VarlinkClient() {
  if (socket_ >= 0) ::close(socket_);
}

pid_t VarlinkClient::serviceProcess() const noexcept {
  ucred peer{};
  socklen_t size = sizeof peer;
  return ::getsockopt(socket_, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 ? peer.pid : 0;
}

ClientResult<Json> VarlinkClient::call(const std::string& method, const Json& parameters,
                                       std::chrono::milliseconds limit, int descriptor) {
  auto sent = send({{"method", method}, {"parameters", parameters}}, descriptor);
  if (!sent) return std::unexpected(sent.error());
  return next(limit);
}

ClientResult<void> VarlinkClient::subscribe(const std::string& method, const Json& parameters) {
  return send({{"method", method}, {"parameters", parameters}, {"more", true}});
}

ClientResult<Json> VarlinkClient::next(std::chrono::milliseconds limit) {
  auto message = receiveMessage(limit);
  if (!message) return std::unexpected(message.error());
  Json reply = Json::parse(*message, nullptr, /*allow_exceptions=*/false);
  if (!reply.is_object()) return std::unexpected(broken("the answer is not a Varlink reply"));
  promises_more_ = flagAt(reply, "continues");
  if (reply.contains("error") && reply["error"].is_string()) return std::unexpected(errorReply(reply));
  if (!reply.contains("parameters") || !reply["parameters"].is_object()) return Json::object();
  return std::move(reply["parameters"]);
}

namespace {

/// As send(); `descriptor` is passed along, -1: none.
ssize_t sendSome(int socket, std::string_view bytes, int descriptor) {
  if (descriptor < 0) return ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  iovec part{const_cast<char*>(bytes.data()), bytes.size()};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* const rights = CMSG_FIRSTHDR(&message);
  rights->cmsg_level = SOL_SOCKET;
  rights->cmsg_type = SCM_RIGHTS;
  rights->cmsg_len = CMSG_LEN(sizeof(int));
  std::memcpy(CMSG_DATA(rights), &descriptor, sizeof descriptor);
  return ::sendmsg(socket, &message, MSG_NOSIGNAL);
}

}  // namespace

ClientResult<void> VarlinkClient::send(const Json& call, int descriptor) {
  std::string message = call.dump(-1, ' ', false, Json::error_handler_t::replace);
  message.push_back('\0');
  for (std::size_t sent = 0; sent < message.size();) {
    const ssize_t count =
        sendSome(socket_, std::string_view(message).substr(sent), sent == 0 ? descriptor : -1);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int error = errno;
      // a service that closes the connection may have sent the reason before
      if (takeWhatHasCome()) return {};
      return std::unexpected(broken(fmt::format("the call was not taken: {}", std::strerror(error))));
    }
    sent += static_cast<std::size_t>(count);
  }
  return {};
}

/// Reads what has arrived; true if there is something for next().
bool VarlinkClient::takeWhatHasCome() {
  std::array<char, 4096> chunk;
  const ssize_t count = receiveSome(socket_, chunk, received_);
  if (count > 0) input_.append(chunk.data(), static_cast<std::size_t>(count));
  return !input_.empty();
}

ClientResult<std::string> VarlinkClient::receiveMessage(std::chrono::milliseconds limit) {
  const auto deadline = Clock::now() + limit;
  std::array<char, 65536> chunk;
  for (;;) {
    if (const std::size_t end = input_.find('\0'); end != std::string::npos) {
      std::string message = input_.substr(0, end);
      input_.erase(0, end + 1);
      return message;
    }
    if (input_.size() > kMaxReplyBytes) return std::unexpected(broken("the answer is too long"));
    if (auto ready = waitForInput(deadline); !ready) return std::unexpected(ready.error());
    const ssize_t count = receiveSome(socket_, chunk, received_);
    if (count > 0) {
      input_.append(chunk.data(), static_cast<std::size_t>(count));
    } else if (count == 0 || (errno != EAGAIN && errno != EINTR)) {
      return std::unexpected(broken("the connection was closed without an answer"));
    }
  }
}

ClientResult<void> VarlinkClient::waitForInput(Clock::time_point deadline) const {
  std::array<pollfd, 2> descriptors{{{socket_, POLLIN, 0}, {interrupt_, POLLIN, 0}}};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    const int ready = ::poll(descriptors.data(), descriptors.size(),
                             static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (ready > 0 && descriptors[1].revents != 0) {
      return std::unexpected(ClientError{ClientError::Kind::interrupted, "interrupted", "", {}, 0});
    }
    if (ready > 0) return {};
    if (ready == 0) return std::unexpected(noAnswer());
    if (errno != EINTR) return std::unexpected(broken(std::strerror(errno)));
  }
}

ClientError VarlinkClient::noAnswer() const {
  return {ClientError::Kind::no_answer,
          fmt::format("{}: no answer in time", path_),
          "hapticd may be starting or busy: try again, or see 'systemctl status hapticd'",
          {},
          0};
}

ClientError VarlinkClient::broken(std::string what) const {
  return {
      ClientError::Kind::no_connection,
      fmt::format("{}: {}", path_, what),
      "see 'systemctl status hapticd'; it refuses clients when too many are connected, and the socket may be "
      "another program's",
      {},
      0};
}

ssize_t receiveSome(int socket, std::span<char> bytes, base::Descriptor& descriptor) {
  constexpr std::size_t kMaxDescriptors = 4;  // room for all, so that none stays open unseen
  iovec part{bytes.data(), bytes.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kMaxDescriptors * sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t count = ::recvmsg(socket, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  if (count < 0) return count;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t descriptors = (header->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t i = 0; i < descriptors; ++i) {
      int number = -1;
      std::memcpy(&number, CMSG_DATA(header) + i * sizeof(int), sizeof number);
      base::Descriptor received(number);
      if (!descriptor) descriptor = std::move(received);
    }
  }
  return count;
}

}  // namespace hapticd::tools
