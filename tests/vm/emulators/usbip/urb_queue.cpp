// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/urb_queue.h"

#include <algorithm>

namespace hapticd::test::usbip {

Urb& UrbQueue::add(const Command& command) {
  if (free_.empty()) free_.emplace_back();
  waiting_.splice(waiting_.end(), free_, free_.begin());
  waiting_.back().command = command;
  return waiting_.back();
}

const Urb* UrbQueue::oldest(std::uint8_t endpoint) const {
  const auto found =
      std::ranges::find(waiting_, endpoint, [](const Urb& urb) { return urb.command.endpoint; });
  return found != waiting_.end() ? &*found : nullptr;
}

bool UrbQueue::remove(std::uint32_t sequence) {
  const auto found =
      std::ranges::find(waiting_, sequence, [](const Urb& urb) { return urb.command.sequence; });
  if (found == waiting_.end()) return false;
  free_.splice(free_.begin(), waiting_, found);
  return true;
}

}  // namespace hapticd::test::usbip
