// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/disk_space.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

namespace hapticd::daemon {
namespace {

constexpr double kBytesPerMb = 1e6;
/// Space for the start of a trace: schemas and settings take about 50 kB, a second of uncompressed ticks 0.7
/// MB.
constexpr std::uint64_t kLeastToBegin_bytes = 1'000'000;

}  // namespace

std::uint64_t bytesOf(double megabytes) {
  return static_cast<std::uint64_t>(megabytes * kBytesPerMb);
}

std::string megabytes(std::uint64_t bytes) {
  return fmt::format("{:.1f} MB", static_cast<double>(bytes) / kBytesPerMb);
}

DiskSpace::DiskSpace(std::filesystem::path folder, double min_free_mb)
    : folder_(std::move(folder)), least_bytes_(bytesOf(min_free_mb)) {}

void DiskSpace::measure() {
  std::error_code failure;
  const std::filesystem::space_info space = std::filesystem::space(folder_, failure);
  free_bytes_ = failure ? std::nullopt : std::optional<std::uint64_t>(space.available);
}

config::Result<void> DiskSpace::enoughToBegin() const {
  return enough(std::max(least_bytes_, kLeastToBegin_bytes));
}

config::Result<void> DiskSpace::enough(std::uint64_t least_bytes) const {
  if (!free_bytes_ || *free_bytes_ >= least_bytes) return {};
  const char* const why =
      least_bytes == least_bytes_ ? "trace.min_free_mb asks for" : "a trace takes at its begin";
  return std::unexpected(
      config::Error{folder_.string(),
                    fmt::format("only {} are free, less than the {} that {}", megabytes(*free_bytes_),
                                megabytes(least_bytes), why),
                    "delete traces (hapticctl trace list, trace delete), or lower trace.min_free_mb"});
}

}  // namespace hapticd::daemon
