// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/base/feed.h"

#include <fmt/format.h>

#include <utility>

namespace hapticd::daemon {
namespace {

/// After this long without anything usable the next one begins a feed.
constexpr std::chrono::seconds kPause{10};
/// For so long a warning names a client that was refused.
constexpr std::chrono::seconds kShown{2};

/// One process may have several connections.
std::string nameOf(const Caller& caller) {
  return fmt::format("pid {} of uid {} (connection {})", caller.pid, caller.uid, caller.connection);
}

}  // namespace

Feed::Feed(std::string what, int most_per_second)
    : what_(std::move(what)), most_per_second_(most_per_second), rate_(most_per_second) {}

std::string Feed::refusal(const Caller& caller, Clock::time_point now, Clock::duration patience) {
  const bool is_owner = owner_.connection == caller.connection;
  if (is_owner) heard_ = now;
  if (is_owner || owner_.connection == kNoConnection || now - heard_ >= patience) return "";
  refused_ = caller;
  refused_at_ = now;
  return fmt::format("another program feeds {}: {} (end one of the two)", what_, nameOf(owner_));
}

bool Feed::used(const Caller& caller, Clock::time_point now) {
  owner_ = caller;
  heard_ = now;
  return now - std::exchange(used_, now) >= kPause;
}

void Feed::closed(ConnectionId connection) {
  if (owner_.connection == connection) owner_.connection = kNoConnection;
}

void Feed::addWarnings(Clock::time_point now, std::vector<std::string>& list) const {
  if (const int came = rate_.excess(now); came > 0) {
    list.push_back(fmt::format(
        "{} {} come in a second, of which {} are taken and the others dropped evenly (send fewer)", came,
        what_, most_per_second_));
  }
  if (now - refused_at_ < kShown && owner_.connection != kNoConnection &&
      owner_.connection != refused_.connection) {
    list.push_back(fmt::format("two programs feed {}: {} has begun, so {} is refused (end one of the two)",
                               what_, nameOf(owner_), nameOf(refused_)));
  }
}

}  // namespace hapticd::daemon
