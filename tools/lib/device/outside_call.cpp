// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/device/outside_call.h"

#include <array>
#include <atomic>
#include <limits>

#include "rt/base/clock.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kNotBegun = std::numeric_limits<std::int64_t>::max();

}  // namespace

struct Place {
  std::atomic<const char*> name{nullptr};  // null: free
  std::atomic<std::int64_t> since_ns{kNotBegun};
};

namespace {

/// A driver's thread and those of its library.
std::array<Place, 4> places;  // NOLINT: calls are watched from elsewhere

}  // namespace

OutsideCall::OutsideCall(const char* name) noexcept {
  for (Place& place : places) {
    const char* free = nullptr;
    if (!place.name.compare_exchange_strong(free, name)) continue;
    place.since_ns = rt::monotonicNow_ns();
    place_ = &place;
    return;
  }
}

OutsideCall::~OutsideCall() {
  if (place_ == nullptr) return;
  place_->since_ns = kNotBegun;
  place_->name = nullptr;
}

std::optional<OutsideCall::Lasting> OutsideCall::hanging() noexcept {
  std::optional<Lasting> longest;
  const std::int64_t before_ns = rt::monotonicNow_ns() - kPatienceNs;
  for (Place& place : places) {
    const std::int64_t since_ns = place.since_ns;
    const char* const name = place.name;
    const bool same = name != nullptr && place.since_ns == since_ns;  // not that of the next call
    if (same && since_ns < before_ns && (!longest || since_ns < longest->since_ns))
      longest = Lasting{name, since_ns};
  }
  return longest;
}

}  // namespace hapticd::tools
