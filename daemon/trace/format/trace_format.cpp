// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/format/trace_format.h"

#include <sys/timex.h>

#include <charconv>
#include <fstream>
#include <system_error>

#include "daemon/trace/format/messages.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "daemon/trace/mcap/mcap_reader.h"
#include "rt/base/clock.h"

namespace hapticd::trace {
namespace {

/// 2026-01-01: there was no hapticd that wrote traces with numbers before.
constexpr std::int64_t kEarliest_ns = 1'767'225'600 * rt::kNsPerSecond;

/// A PC always has such a clock, whether the kernel names it or not: in the chip set or of the hypervisor.
#if defined(__x86_64__)
constexpr bool kHasOwnClock = true;
#else
constexpr bool kHasOwnClock = false;
#endif

/// Whether the kernel has set its clock from one of the devices when it started.
bool wasSetFromDevice(const std::filesystem::path& root) {
  std::error_code failure;
  for (std::filesystem::directory_iterator clock(root / "sys/class/rtc", failure), end;
       !failure && clock != end; clock.increment(failure)) {
    if (char was_set = '0'; std::ifstream(clock->path() / "hctosys") >> was_set && was_set == '1')
      return true;
  }
  return false;
}

}  // namespace

WallClock WallClock::read(const std::filesystem::path& root) {
  timex state{};
  const bool good = ::adjtimex(&state) != -1;
  return {.realtime_ns = rt::realtimeNow_ns(),
          .synchronised = good && (state.status & STA_UNSYNC) == 0,
          .kept_by_battery = kHasOwnClock || wasSetFromDevice(root)};
}

bool WallClock::isSet(std::int64_t latest_ns) const {
  if (realtime_ns < kEarliest_ns) return false;
  return synchronised || (kept_by_battery && realtime_ns >= latest_ns);
}

void TraceHead::take(const std::vector<std::pair<std::string, std::string>>& metadata) {
  for (const auto& [name, value] : metadata) {
    if (name == kClockKey) clock_is_set = value == kClockIsSet;
    if (name == kNumberKey) std::from_chars(value.data(), value.data() + value.size(), number);
  }
}

TraceHead readTraceHead(const std::filesystem::path& trace) {
  using enum mcap::Opcode;
  TraceHead found;
  auto scanner = mcap::Scanner::open(trace);
  while (scanner) {
    const auto head = scanner->head();
    if (!head || head->opcode == chunk || head->opcode == message || head->opcode == data_end) break;
    if (head->opcode == metadata || head->opcode == channel) {
      const auto record = scanner->next();
      mcap::MetadataRecord named;
      mcap::ChannelRecord defined;
      if (!record) break;
      if (head->opcode == metadata && mcap::MetadataRecord::of(record->content, named) &&
          named.name == kTraceMetadata) {
        found.take(named.pairs);
      }
      if (head->opcode == channel && mcap::ChannelRecord::of(record->content, defined)) {
        found.depth = found.depth || defined.topic == kChannelName<DepthRecord>.topic;
      }
    }
    scanner->jump(head->end());
  }
  return found;
}

}  // namespace hapticd::trace
