// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/server/varlink_connection.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>
#include <system_error>
#include <utility>

#include "daemon/control/server/varlink_message.h"

namespace hapticd::daemon {
namespace {

/// Stands for an end that is not known yet.
constexpr std::size_t kJustPassed = std::numeric_limits<std::size_t>::max();

}  // namespace

VarlinkConnection::VarlinkConnection(base::Descriptor socket, const Caller& caller)
    : socket_(std::move(socket)), caller_(caller) {}

bool VarlinkConnection::receive() {
  input_waits = false;
  input_.erase(0, taken_);
  scanned_ -= std::min(scanned_, taken_);
  passed_end_ -= std::min(passed_end_, taken_);
  taken_ = 0;

  const std::size_t held = input_.size();
  const std::size_t room = std::min(longestCall() + 1 - held, kMaxCallBytes + 1);
  if (room == 0) return false;
  input_.resize(held + room);
  ssize_t received = -1;
  do {
    received = receiveSome(input_.data() + held, room);
  } while (received < 0 && errno == EINTR);
  input_.resize(held + static_cast<std::size_t>(std::max<ssize_t>(received, 0)));
  if (received > 0 && passed_ && passed_end_ == kJustPassed) passed_end_ = input_.size();
  if (received > 0) return true;
  if (received == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) input_ended_ = true;
  return false;
}

/// As recv(). Where the client may control, a descriptor that comes along replaces the previous one; of
/// several at once the first does. The kernel ends a read behind the bytes that a descriptor came with.
ssize_t VarlinkConnection::receiveSome(char* to, std::size_t room) noexcept {
  if (caller_.access != Access::control) return ::recv(socket_.get(), to, room, MSG_DONTWAIT);
  iovec bytes{to, room};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t received = ::recvmsg(socket_.get(), &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  if (received < 0) return received;
  const cmsghdr* const rights = CMSG_FIRSTHDR(&message);
  if (!rights || rights->cmsg_level != SOL_SOCKET || rights->cmsg_type != SCM_RIGHTS) return received;
  // Padding leaves room for more than one, and each that came is open.
  for (std::size_t at = CMSG_LEN(0); at + sizeof(int) <= rights->cmsg_len; at += sizeof(int)) {
    int number = -1;
    std::memcpy(&number, CMSG_DATA(rights) + (at - CMSG_LEN(0)), sizeof(number));
    base::Descriptor descriptor(number);
    if (at == CMSG_LEN(0)) passed_ = std::move(descriptor);
    passed_end_ = kJustPassed;
  }
  return received;
}

bool VarlinkConnection::hasInput() noexcept {
  return readyForCall() && (input_waits || input_ended_ || gone || hasMessage() || overfull());
}

bool VarlinkConnection::hasMessage() noexcept {
  scanned_ = std::min(input_.find('\0', std::max(scanned_, taken_)), input_.size());
  return scanned_ < input_.size();
}

std::optional<std::string_view> VarlinkConnection::takeMessage() {
  if (!hasMessage()) return std::nullopt;
  const std::string_view message(input_.data() + taken_, scanned_ - taken_);
  if (passed_end_ <= taken_) passed_.close();  // of an earlier message, whose method did not take it
  taken_ = scanned_ + 1;
  return message;
}

base::Descriptor VarlinkConnection::takeDescriptor() noexcept {
  return passed_end_ <= taken_ ? std::move(passed_) : base::Descriptor();
}

bool VarlinkConnection::overfull() const noexcept {
  return input_.size() - taken_ > longestCall() && scanned_ == input_.size();
}

void VarlinkConnection::send(std::string_view message, int descriptor) {
  output_.erase(0, sent_);
  sent_ = 0;
  if (descriptor >= 0) {
    attached_ = base::Descriptor(::fcntl(descriptor, F_DUPFD_CLOEXEC, 0));
    // The client would wait for it in vain.
    if (!attached_) dead = true;
  }
  output_ += message;
  flush();
}

void VarlinkConnection::flush() {
  while (!dead && !outputEmpty()) {
    const ssize_t count = sendSome();
    if (count >= 0) {
      sent_ += static_cast<std::size_t>(count);
      attached_.close();
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      return;
    } else if (errno != EINTR) {
      dead = true;
    }
  }
}

/// Sends what the kernel takes at once, with the descriptor if one is attached; as sendmsg().
ssize_t VarlinkConnection::sendSome() noexcept {
  iovec bytes{output_.data() + sent_, output_.size() - sent_};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  if (attached_) {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* const rights = CMSG_FIRSTHDR(&message);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(sizeof(int));
    const int descriptor = attached_.get();
    std::memcpy(CMSG_DATA(rights), &descriptor, sizeof(descriptor));
  }
  return ::sendmsg(socket_.get(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
}

void LingeringSockets::add(ConnectionId id, base::Descriptor socket, Clock::time_point now) {
  ::shutdown(socket.get(), SHUT_WR);
  if (sockets_.size() == most_) sockets_.erase(sockets_.begin());
  sockets_.push_back({id, std::move(socket), now + kMaxAge});
}

void LingeringSockets::drain(ConnectionId id) {
  const auto found = std::ranges::find(sockets_, id, &Lingering::id);
  if (found == sockets_.end()) return;
  std::array<char, 16384> discarded;
  const ssize_t received = ::recv(found->socket.get(), discarded.data(), discarded.size(), MSG_DONTWAIT);
  const bool left =
      received == 0 || (received < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
  if (left) sockets_.erase(found);
}

void LingeringSockets::closeOld(Clock::time_point now) {
  std::erase_if(sockets_, [=](const Lingering& socket) { return now >= socket.end; });
}

namespace {

/// For devices, traces and profiles, which are opened later.
constexpr std::size_t kForFiles = 48;

ConnectionLimits within(const ConnectionLimits& limits, std::size_t places, std::size_t least) {
  const std::size_t all = std::clamp(places, std::min(least, limits.all), limits.all);
  if (all == limits.all) return limits;
  return {all, std::min(limits.per_user, all - all / 4 - 1)};
}

}  // namespace

ServerLimits limitsWithin(const ServerLimits& limits, std::size_t descriptors) {
  const std::size_t room = descriptors > kForFiles ? descriptors - kForFiles : 0;
  if (room >= limits.read.all + limits.control.all + limits.lingering) return limits;
  constexpr std::size_t kMin = 4;
  return {.read = within(limits.read, room / 3, kMin),
          .control = within(limits.control, room / 3, kMin),
          .lingering = std::clamp(room / 6, std::min(kMin, limits.lingering), limits.lingering)};
}

std::size_t freeDescriptors() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
  std::error_code failure;
  std::size_t open = 0;
  for (std::filesystem::directory_iterator entry("/proc/self/fd", failure), end; !failure && entry != end;
       entry.increment(failure))
    ++open;
  return limit.rlim_cur > open ? limit.rlim_cur - open : 0;
}

void DescriptorReserve::refill() {
  while (held_.size() < size_) {
    base::Descriptor opened(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    if (!opened) return;
    held_.push_back(std::move(opened));
  }
}

}  // namespace hapticd::daemon
