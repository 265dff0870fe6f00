// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/service_manager.h"

#include <systemd/sd-daemon.h>

namespace hapticd::tools::view {

std::vector<int> socketsFromServiceManager() {
  std::vector<int> sockets;
  const int count = ::sd_listen_fds(/*unset_environment=*/1);
  for (int i = 0; i < count; ++i) sockets.push_back(SD_LISTEN_FDS_START + i);
  return sockets;
}

void notifyReady() {
  ::sd_notify(0, "READY=1");
}

void notifyStopping() {
  ::sd_notify(0, "STOPPING=1");
}

}  // namespace hapticd::tools::view
