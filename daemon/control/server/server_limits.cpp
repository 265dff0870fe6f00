// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/server/server_limits.h"

#include <fcntl.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

namespace hapticd::daemon {
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
