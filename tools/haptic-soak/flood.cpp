// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-soak/flood.h"

#include <grp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>

namespace hapticd::tools {
namespace {

constexpr int kProcesses = 4;
constexpr uid_t kNobody = 65534;

/// Returns more calls than the kernel buffers for one connection.
std::string manyCalls(bool oneway) {
  const std::string call = std::string(R"({"method":"io.hapticd.Status.GetParameters")") +
                           (oneway ? R"(,"oneway":true})" : "}") + '\0';
  std::string calls;
  while (calls.size() < 256 * 1024) calls += call;
  return calls;
}

int connectTo(const sockaddr_un& address) {
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return socket;
  ::close(socket);
  return -1;
}

/// Sends until the kernel accepts no more bytes. Returns false if the connection must be closed.
bool fill(int socket, const std::string& calls) {
  return socket >= 0 && ::send(socket, calls.data(), calls.size(), MSG_NOSIGNAL | MSG_DONTWAIT) > 0;
}

/// Floods the socket with all connections of one process; ended by a signal only.
[[noreturn]] void flood(const sockaddr_un& address, std::size_t connections) {
  const std::string oneway = manyCalls(true);
  const std::string two_way = manyCalls(false);
  std::vector<int> sockets(connections, -1);
  for (std::size_t turn = 0;; ++turn) {
    int& socket = sockets[turn % connections];
    if (socket >= 0) ::close(socket);
    socket = connectTo(address);
    while (fill(socket, turn / connections % 2 == 0 ? oneway : two_way)) {
    }
  }
}

void becomeNobody() {
  if (::geteuid() != 0) return;
  if (::setgroups(0, nullptr) != 0 || ::setgid(kNobody) != 0 || ::setuid(kNobody) != 0) ::_exit(1);
}

}  // namespace

Flood::Flood(const std::string& socket, int connections) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  socket.copy(address.sun_path, sizeof address.sun_path - 1);
  const int processes = std::min(kProcesses, connections);
  for (int i = 0; i < processes; ++i) {
    const auto share =
        static_cast<std::size_t>(connections / processes + (i < connections % processes ? 1 : 0));
    const pid_t process = ::fork();
    if (process == 0) {
      becomeNobody();
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::signal(SIGINT, SIG_DFL);
      ::signal(SIGTERM, SIG_DFL);
      flood(address, share);
    }
    if (process > 0) processes_.push_back(process);
  }
}

Flood::~Flood() {
  for (const pid_t process : processes_) {
    ::kill(process, SIGKILL);
    ::waitpid(process, nullptr, 0);
  }
}

bool Flood::isRunning() const {
  return !processes_.empty() && std::ranges::all_of(processes_, [](pid_t process) {
    return ::waitpid(process, nullptr, WNOHANG) == 0;
  });
}

}  // namespace hapticd::tools
