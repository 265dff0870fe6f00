// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

/// The service manager (sd_listen_fds(3), sd_notify(3)); where there is none nothing happens.
namespace hapticd::tools::view {

/// The listening sockets that it has passed. The caller owns them.
std::vector<int> socketsFromServiceManager();

void notifyReady();
void notifyStopping();

}  // namespace hapticd::tools::view
