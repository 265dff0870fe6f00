// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <utility>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {

/// The newest events, for those who come later; bounded in number and in bytes.  Thread: one.
class RecentEvents {
 public:
  static constexpr std::size_t kMaxEvents = 64;         ///< as many as the daemon shows to a new client
  static constexpr std::size_t kMaxBytes = 256 * 1024;  ///< as JSON text

  /// An event that is longer than all may be is not kept.
  void add(const Json& event) {
    const std::size_t bytes = event.dump(-1, ' ', false, Json::error_handler_t::replace).size();
    events_.emplace_back(event, bytes);
    bytes_ += bytes;
    while (events_.size() > kMaxEvents || bytes_ > kMaxBytes) {
      bytes_ -= events_.front().second;
      events_.pop_front();
    }
  }
  void clear() { *this = RecentEvents(); }
  std::size_t size() const { return events_.size(); }
  bool contains(const Json& event) const {
    return std::ranges::any_of(events_, [&](const auto& kept) { return kept.first == event; });
  }

  /// Calls `take` with each event, oldest first.
  template <typename Take>
  void forEach(Take take) const {
    for (const auto& [event, bytes] : events_) take(event);
  }

 private:
  std::deque<std::pair<Json, std::size_t>> events_;  // with their size
  std::size_t bytes_ = 0;
};

}  // namespace hapticd::tools::view
