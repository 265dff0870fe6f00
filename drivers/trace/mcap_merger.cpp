// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/mcap_merger.h"

#include <algorithm>
#include <utility>

namespace hapticd::drivers::mcap {

bool Merger::isLater(const Stretch& a, const Stretch& b) {
  const auto key = [](const Stretch& stretch) {
    return std::pair(stretch.messages[stretch.next].time_ns, stretch.offset);
  };
  return key(a) > key(b);
}

void Merger::add(std::uint64_t offset, std::string records) {
  Stretch stretch{.offset = offset,
                  .records = std::make_unique<const std::string>(std::move(records)),
                  .messages = {},
                  .next = 0};
  visitRecords(*stretch.records, [&](Opcode opcode, std::string_view content, std::uint64_t) {
    MessageRecord message;
    if (opcode == Opcode::message && MessageRecord::of(content, message)) stretch.messages.push_back(message);
    return true;
  });
  if (stretch.messages.empty()) return;
  std::ranges::stable_sort(stretch.messages, {}, &MessageRecord::time_ns);
  bytes_ += stretch.records->size();
  stretches_.push_back(std::move(stretch));
  std::ranges::push_heap(stretches_, isLater);
}

bool Merger::next(std::uint64_t until_ns, MessageRecord& message) {
  if (stretches_.empty()) return false;
  const Stretch& earliest = stretches_.front();
  if (earliest.messages[earliest.next].time_ns > until_ns) return false;
  message = earliest.messages[earliest.next];
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
