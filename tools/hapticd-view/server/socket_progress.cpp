// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/socket_progress.h"

#include <linux/tcp.h>  // glibc's structure ends before the field that is needed; both cannot be included
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstddef>

namespace hapticd::tools::view {

std::optional<std::uint64_t> acknowledgedBytes(int socket) {
  tcp_info info{};
  socklen_t size = sizeof info;
  if (::getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return std::nullopt;
  if (size < offsetof(tcp_info, tcpi_bytes_acked) + sizeof info.tcpi_bytes_acked) return std::nullopt;
  return info.tcpi_bytes_acked;
}

}  // namespace hapticd::tools::view
