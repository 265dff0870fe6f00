// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/system_calls.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

namespace hapticd::drivers {
namespace {

template <typename Call>
int withoutInterruption(Call call) {
  for (;;) {
    const int result = call();
    if (result >= 0) return result;
    if (errno != EINTR) return -errno;
  }
}

}  // namespace

int KernelCalls::open(const std::string& path) {
  return withoutInterruption([&] { return ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); });
}

void KernelCalls::close(int descriptor) {
  ::close(descriptor);
}

int KernelCalls::ioctl(int descriptor, unsigned long request, void* argument) {
  return withoutInterruption([&] { return ::ioctl(descriptor, request, argument); });
}

const std::byte* KernelCalls::map(int descriptor, std::size_t bytes, std::size_t offset) {
  void* const address = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, descriptor, static_cast<off_t>(offset));
  return address == MAP_FAILED ? nullptr : static_cast<const std::byte*>(address);
}

void KernelCalls::unmap(const std::byte* address, std::size_t bytes) {
  ::munmap(const_cast<std::byte*>(address), bytes);
}

int KernelCalls::poll(int descriptor, std::chrono::milliseconds limit) {
  pollfd waiting{descriptor, POLLIN, 0};
  const int ready = withoutInterruption([&] { return ::poll(&waiting, 1, static_cast<int>(limit.count())); });
  return ready > 0 ? waiting.revents : ready;
}

}  // namespace hapticd::drivers
