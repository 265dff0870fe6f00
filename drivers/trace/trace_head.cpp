// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/trace_head.h"

#include <charconv>

#include "drivers/trace/mcap_reader.h"
#include "drivers/trace/messages.h"
#include "drivers/trace/trace_format.h"

namespace hapticd::drivers {
namespace {

/// hapticd defines everything before the first message, other programs anywhere.
class Looking final : public mcap::Visitor {
 public:
  TraceHead head;

  void metadata(std::string_view name, mcap::Pairs pairs) override {
    if (name == kTraceMetadata) head.take(pairs);
  }
  void attachment(const mcap::AttachmentRecord&) override {}
  void channel(const mcap::Channel& channel) override { addChannel(channel.topic); }
  void addChannel(std::string_view topic) {
    head.depth = head.depth || topic == kChannelName<DepthRecord>.topic;
    has_channels = true;
  }
  std::string message(const mcap::Message&) override { return ""; }
  void chunk(std::uint64_t, std::uint64_t) override {}
  bool enough() const override { return head.depth; }

  bool has_channels = false;
};

/// Goes through the records in front of the first message.
void lookAtBegin(const std::filesystem::path& trace, Looking& looking) {
  auto scanner = mcap::Scanner::open(trace);
  while (scanner) {
    const auto head = scanner->head();
    using enum mcap::Opcode;
    if (!head || head->opcode == chunk || head->opcode == message || head->opcode == data_end) return;
    if (head->opcode == metadata || head->opcode == channel) {
      const auto record = scanner->next();
      if (!record) return;
      mcap::MetadataRecord named;
      mcap::ChannelRecord defined;
      if (head->opcode == metadata && mcap::MetadataRecord::of(record->content, named))
        looking.metadata(named.name, std::move(named.pairs));
      if (head->opcode == channel && mcap::ChannelRecord::of(record->content, defined))
        looking.addChannel(defined.topic);
    }
    scanner->jump(head->end());
  }
}

}  // namespace

void TraceHead::take(const std::vector<std::pair<std::string, std::string>>& metadata) {
  for (const auto& [name, value] : metadata) {
    if (name == kClockKey) clock_is_set = value == kClockIsSet;
    if (name == kNumberKey) std::from_chars(value.data(), value.data() + value.size(), number);
  }
}

TraceHead readTraceHead(const std::filesystem::path& trace) {
  Looking looking;
  lookAtBegin(trace, looking);
  if (!looking.has_channels)
    (void)mcap::read(trace, looking);  // faults are reported by whoever reads the trace
  return looking.head;
}

}  // namespace hapticd::drivers
