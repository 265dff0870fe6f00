// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/base/reconnection.h"

#include <poll.h>

namespace hapticd::tools {

bool mayPass(const ClientError& error) {
  using Kind = ClientError::Kind;
  if (error.kind != Kind::error_reply) return true;
  return error.what == "io.hapticd.Status.TooManyConnections";
}

bool Reconnection::waited(std::chrono::milliseconds wait) const {
  const Clock::time_point end = Clock::now() + wait;
  if (end > deadline_) return false;
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0) return true;
    pollfd signal{signals_, POLLIN, 0};
    if (::poll(&signal, 1, static_cast<int>(left.count())) > 0 && !goesOn_()) return false;
  }
}

}  // namespace hapticd::tools
