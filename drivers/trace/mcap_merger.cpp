// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/mcap_merger.h"

#include <algorithm>
#include <utility>

namespace hapticd::drivers::mcap {

bool Merger::isLater(const Stretch& a, const Stretch& b) {
  const auto key = [](const Stretch& stretch) {
    return std::pair(stretch.messages[stretch.next].first, stretch.offset);
  };
  return key(a) > key(b);
}

void Merger::add(std::uint64_t offset, std::string records) {
  Stretch stretch{.offset = offset,
                  .records = std::make_unique<const std::string>(std::move(records)),
                  .messages = {},
                  .next = 0};
  visitRecords(*stretch.records, [&](Opcode opcode, std::string_view content, std::uint64_t at) {
    MessageRecord message;
    if (opcode == Opcode::message && MessageRecord::of(content, message)) {
      stretch.messages.emplace_back(message.time_ns, at);
    }
    return true;
  });
  if (stretch.messages.empty()) return;
  stretch.messages.shrink_to_fit();
  std::ranges::sort(stretch.messages);  // of equal times the earlier in the file comes first
  bytes_ += stretch.records->size();
  stretches_.push_back(std::move(stretch));
  std::ranges::push_heap(stretches_, isLater);
}

bool Merger::next(std::uint64_t until_ns, MessageRecord& message) {
  if (stretches_.empty()) return false;
  const Stretch& earliest = stretches_.front();
  const auto [time_ns, at] = earliest.messages[earliest.next];
  if (time_ns > until_ns) return false;
  ByteReader record(std::string_view(*earliest.records).substr(at + 1));  // after the opcode
  MessageRecord::of(record.sized<std::uint64_t>(), message);
  std::ranges::pop_heap(stretches_, isLater);
  Stretch& taken = stretches_.back();
  if (++taken.next < taken.messages.size()) {
    std::ranges::push_heap(stretches_, isLater);
  } else {
    bytes_ -= taken.records->size();
    last_ = std::move(taken.records);
    stretches_.pop_back();
  }
  return true;
}

}  // namespace hapticd::drivers::mcap
