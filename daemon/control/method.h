// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "daemon/control/listening_socket.h"
#include "daemon/control/varlink_server.h"

namespace hapticd::daemon {

/// A method of an interface, and the function that answers it.
struct Method {
  std::string_view name;  ///< with the interface, "io.hapticd.Status.GetStatus"
  Access access = Access::read;
  bool streams = false;                           ///< whether it must be called with the flag "more"
  bool shows_depth = false;                       ///< whether it needs Caller::sees_depth
  std::vector<std::string_view> parameters = {};  ///< names of the parameters that it knows
  std::function<void(const Call&, const Caller&, Replies&)> answer;
};

}  // namespace hapticd::daemon
