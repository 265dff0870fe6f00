// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/commands/message_gate.h"

#include <fmt/format.h>

#include "config/base/value_text.h"

namespace hapticd::tools::ros {

std::optional<std::string> MessageGate::refusal(const MessageHead& head, std::int64_t utc_ns, Time time) {
  if (!rules_.frame.empty() && head.frame != rules_.frame) {
    return fmt::format("its frame_id is {} and must be {} (transform it, then set header.frame_id)",
                       base::inQuotes(head.frame), base::inQuotes(rules_.frame));
  }
  if (auto old = refusalByAge(head, utc_ns)) return old;
  if (head.publisher == publisher_) newest_ = time;
  if (rules_.one_publisher && head.publisher != publisher_ && time - newest_ < kSilence)
    return "another publisher sends to this topic (end one of them)";
  if (!rate_.allows(time)) {
    return fmt::format(
        "there are more than {} messages a second, and the others are dropped (publish less often)",
        rules_.most_per_second);
  }
  return std::nullopt;
}

void MessageGate::used(const MessageHead& head, Time time) {
  publisher_ = head.publisher;
  newest_ = time;
}

std::optional<std::string> MessageGate::refusalByAge(const MessageHead& head, std::int64_t utc_ns) const {
  const std::chrono::nanoseconds age(utc_ns - head.made_utc_ns());
  if (age <= rules_.oldest && age >= -kEarliest) return std::nullopt;
  const double age_s = std::chrono::duration<double>(age).count();
  const char* const remedy = "synchronise the clocks of both computers, for instance with chrony";
  if (age_s < 0) return fmt::format("its time is {:.3f} s from now ({})", -age_s, remedy);
  return fmt::format("it is {:.3f} s old, and may be {:.3f} s (send it at once, and {})", age_s,
                     std::chrono::duration<double>(rules_.oldest).count(), remedy);
}

}  // namespace hapticd::tools::ros
