// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/trace_format.h"

#include <charconv>

#include "drivers/trace/format/messages.h"
#include "drivers/trace/mcap/mcap_definitions.h"
#include "drivers/trace/mcap/mcap_scanner.h"

namespace hapticd::drivers {

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

}  // namespace hapticd::drivers
