// SPDX-License-Identifier: Apache-2.0
#include "tests/support/disk_stall.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace hapticd::test {
namespace {

/// A call that may wait for a disk, and its argument that tells which.
struct Call {
  int number;
  int argument;
  bool is_path;  ///< the argument is a path, not a descriptor
};

constexpr Call kCalls[] = {
#ifdef SYS_open
    {SYS_open, 0, true},        {SYS_stat, 0, true},       {SYS_lstat, 0, true},
    {SYS_mkdir, 0, true},       {SYS_rename, 0, true},     {SYS_unlink, 0, true},
#endif
    {SYS_openat, 1, true},      {SYS_newfstatat, 1, true}, {SYS_statx, 1, true},
    {SYS_mkdirat, 1, true},     {SYS_renameat2, 1, true},  {SYS_unlinkat, 1, true},
    {SYS_statfs, 0, true},      {SYS_write, 0, false},     {SYS_writev, 0, false},
    {SYS_pwrite64, 0, false},   {SYS_fsync, 0, false},     {SYS_fdatasync, 0, false},
    {SYS_getdents64, 0, false}, {SYS_ftruncate, 0, false}, {SYS_fallocate, 0, false},
};

int seccomp(unsigned int operation, unsigned int flags, void* arguments) {
  return static_cast<int>(::syscall(SYS_seccomp, operation, flags, arguments));
}

/// Notifies of the calls above, and permits all others.
int listenerOfOwnCalls() {
  constexpr std::size_t kCount = std::size(kCalls);
  std::array<sock_filter, kCount + 3> filter{};
  filter[0] = {BPF_LD | BPF_W | BPF_ABS, 0, 0, offsetof(seccomp_data, nr)};
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto to_notification = static_cast<std::uint8_t>(kCount - i);
    filter[1 + i] = {BPF_JMP | BPF_JEQ | BPF_K, to_notification, 0,
                     static_cast<std::uint32_t>(kCalls[i].number)};
  }
  filter[kCount + 1] = {BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ALLOW};
  filter[kCount + 2] = {BPF_RET | BPF_K, 0, 0, SECCOMP_RET_USER_NOTIF};
  sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return -1;
  return seccomp(SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_NEW_LISTENER, &program);
}

/// Sends a byte, with a descriptor if that is one.
bool sendDescriptor(int socket, int descriptor) {
  char byte = 0;
  iovec bytes{&byte, 1};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  if (descriptor >= 0) {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* const rights = CMSG_FIRSTHDR(&message);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(sizeof(int));
    std::memcpy(CMSG_DATA(rights), &descriptor, sizeof descriptor);
  }
  return ::sendmsg(socket, &message, MSG_NOSIGNAL) == 1;
}

/// The descriptor that the child sent; none if it could not.
base::Descriptor receiveDescriptor(int socket) {
  char byte = 0;
  iovec bytes{&byte, 1};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  int descriptor = -1;
  if (::recvmsg(socket, &message, MSG_CMSG_CLOEXEC) == 1) {
    if (const cmsghdr* const rights = CMSG_FIRSTHDR(&message))
      std::memcpy(&descriptor, CMSG_DATA(rights), sizeof descriptor);
  }
  return base::Descriptor(descriptor);
}

std::string pathAt(pid_t thread, std::uint64_t address) {
  std::array<char, 4096> text{};
  // Up to the end of the page, behind which there may be nothing.
  const std::size_t size = text.size() - address % text.size();
  iovec local{text.data(), size};
  iovec remote{reinterpret_cast<void*>(address), size};
  if (::process_vm_readv(thread, &local, 1, &remote, 1, 0) <= 0) return "";
  return std::string(text.data(), ::strnlen(text.data(), size));
}

std::string pathOf(pid_t thread, std::uint64_t descriptor) {
  std::array<char, 4096> text{};
  const std::string link = "/proc/" + std::to_string(thread) + "/fd/" + std::to_string(descriptor);
  const ssize_t size = ::readlink(link.c_str(), text.data(), text.size());
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "";
}

}  // namespace

DiskStall::DiskStall(std::filesystem::path folder)
    : folder_(std::move(folder)), wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw std::runtime_error("no socket pair");
  parent_end_ = base::Descriptor(ends[0]);
  child_end_ = base::Descriptor(ends[1]);
}

DiskStall::~DiskStall() {
  stop_ = true;
  end();
  if (thread_.joinable()) thread_.join();
}

void DiskStall::end() {
  stalled_ = false;
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t woken = ::write(wake_.get(), &one, sizeof one);
}

bool DiskStall::install() const {
  const int listener = listenerOfOwnCalls();
  return sendDescriptor(child_end_.get(), listener) && listener >= 0;
}

bool DiskStall::supervise() {
  child_end_.close();  // so that a child that ended before install() is noticed
  calls_ = receiveDescriptor(parent_end_.get());
  if (!calls_) return false;
  thread_ = std::thread([this] { answerCalls(); });
  return true;
}

void DiskStall::answerCalls() {
  while (!stop_) {
    std::array<pollfd, 2> ready{{{calls_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}}};
    ::poll(ready.data(), ready.size(), -1);
    std::uint64_t woken = 0;
    [[maybe_unused]] const ssize_t taken = ::read(wake_.get(), &woken, sizeof woken);
    if (!stalled_) {
      for (const std::uint64_t call : std::exchange(held_, {})) letGoOn(call);
      waiting_ = 0;
    }
    if ((ready[0].revents & POLLHUP) != 0) return;  // the program has ended
    if ((ready[0].revents & POLLIN) == 0) continue;
    seccomp_notif call{};
    if (::ioctl(calls_.get(), SECCOMP_IOCTL_NOTIF_RECV, &call) != 0) continue;
    if (stalled_ && reachesForFolder(static_cast<pid_t>(call.pid), call.data)) {
      held_.push_back(call.id);
      waiting_ = held_.size();
    } else {
      letGoOn(call.id);
    }
  }
}

bool DiskStall::reachesForFolder(pid_t thread, const seccomp_data& call) const {
  const Call* const known = std::ranges::find(kCalls, call.nr, &Call::number);
  if (known == std::end(kCalls)) return false;
  const std::uint64_t argument = call.args[known->argument];
  return (known->is_path ? pathAt(thread, argument) : pathOf(thread, argument)).starts_with(folder_);
}

void DiskStall::letGoOn(std::uint64_t call) const {
  seccomp_notif_resp response{};
  response.id = call;
  response.flags = SECCOMP_USER_NOTIF_FLAG_CONTINUE;
  ::ioctl(calls_.get(), SECCOMP_IOCTL_NOTIF_SEND, &response);
}

}  // namespace hapticd::test
