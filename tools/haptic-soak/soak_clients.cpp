// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-soak/soak_clients.h"

#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <random>
#include <stop_token>

#include "tools/haptic-soak/random_changes.h"
#include "tools/lib/child/child_process.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {
namespace {

using std::chrono::milliseconds;

/// A running client: its settings, random numbers and statistics.
struct Work {
  const ClientSetting setting;
  std::mt19937_64 random;
  std::stop_token stop;
  ClientTally& tally;

  /// Sleeps for `time`, or until the stop; returns false if the client must end.
  bool pause(milliseconds time) {
    std::mutex mutex;
    std::condition_variable_any condition;
    std::unique_lock lock(mutex);
    condition.wait_for(lock, stop, time, [] { return false; });
    return !stop.stop_requested();
  }
  milliseconds between(int first_ms, int last_ms) {
    return milliseconds(std::uniform_int_distribution<int>(first_ms, last_ms)(random));
  }
  void problem(const std::string& what) {
    if (tally.first_problem.empty()) tally.first_problem = what;
  }
  void unanswered(const ClientError& error) {
    ++tally.unanswered;
    problem(error.what);
  }
};

std::optional<VarlinkClient> connect(Work& work, const std::string& socket) {
  auto client = VarlinkClient::connect(socket);
  if (client) return std::move(*client);
  work.unanswered(client.error());
  return std::nullopt;
}

/// Counts a reply; an error reply is a reply too.
void count(Work& work, const ClientResult<Json>& reply) {
  if (reply) {
    ++work.tally.calls;
  } else if (reply.error().kind != ClientError::Kind::error_reply) {
    work.unanswered(reply.error());
  } else if (reply.error().what == "io.hapticd.Control.NotApplied") {
    ++work.tally.not_applied;
  } else {
    ++work.tally.refused;
  }
}

void countReply(Work& work, const ClientResult<Json>& reply) {
  count(work, reply);
  if (reply) work.tally.left_out = static_cast<std::uint64_t>(numberAt(*reply, "droppedCount"));
}

/// Reads all replies that have arrived.
void catchUp(Work& work, VarlinkClient& client) {
  constexpr int kMostWaiting = 1000;
  for (int i = 0; i < kMostWaiting; ++i) {
    const auto reply = client.next(milliseconds(5));
    if (!reply) return;
    countReply(work, reply);
  }
}

/// Reads the replies of a stream, with a pause after each.
void watch(Work& work, int interval_ms, milliseconds pause) {
  auto client = connect(work, work.setting.status_socket);
  if (!client || !client->subscribe("io.hapticd.Status.Monitor", {{"intervalMs", interval_ms}})) return;
  do {
    const auto reply = client->next(VarlinkClient::kTimeLimit);
    countReply(work, reply);
    if (!reply) return;
  } while (work.pause(pause));
  if (pause > milliseconds(0)) catchUp(work, *client);
}

void watchQuickly(Work& work) {
  watch(work, 20, milliseconds(0));
}

/// Reads a stream more slowly than it sends, so that the daemon must skip replies.
void watchSlowly(Work& work) {
  watch(work, 20, milliseconds(1000));
}

void watchWithHapticctl(Work& work) {
  auto child = ChildProcess::start(
      {work.setting.hapticctl, "--json", "--socket", work.setting.status_socket, "watch"}, {}, "");
  while (child && !child->ending() && work.pause(milliseconds(100))) {
  }
  if (!child || child->ending()) {
    ++work.tally.unanswered;
    work.problem(child ? "hapticctl watch ended: " + child->ending()->text() : child.error().text());
    return;
  }
  ++work.tally.calls;
}

/// Requests parameters on one connection, nearly without pauses.
void askParameters(Work& work) {
  auto client = connect(work, work.setting.status_socket);
  if (!client) return;
  const std::uint64_t unanswered = work.tally.unanswered;
  do {
    count(work, client->call("io.hapticd.Status.GetParameters"));
  } while (work.tally.unanswered == unanswered && work.pause(milliseconds(2)));
}

void changeParameters(Work& work, VarlinkClient& client) {
  const RandomChange change = randomChange(work.random);
  const auto reply = client.call("io.hapticd.Control.SetParameters", {{"parameters", change.parameters}});
  count(work, reply);
  if (!reply || change.allowed) return;
  ++work.tally.wrongly_taken;
  work.problem(change.parameters.dump());
}

void switchForce(Work& work, VarlinkClient& client) {
  const bool engage = work.between(0, 2).count() != 0;
  count(work, client.call(engage ? "io.hapticd.Control.Engage" : "io.hapticd.Control.Disengage"));
}

/// Changes parameters on one connection; one call in ten engages or disengages.
void steer(Work& work) {
  auto client = connect(work, work.setting.control_socket);
  if (!client) return;
  const std::uint64_t unanswered = work.tally.unanswered;
  do {
    const bool to_switch = work.between(0, 9).count() == 0;
    to_switch ? switchForce(work, *client) : changeParameters(work, *client);
  } while (work.tally.unanswered == unanswered && work.pause(work.between(5, 100)));
}

/// Sends bytes and closes the connection without reading.
void sendBytes(const std::string& path, const std::string& bytes) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  ::close(socket);
}

void sendGarbage(Work& work) {
  const bool to_control = work.between(0, 1).count() != 0;
  sendBytes(to_control ? work.setting.control_socket : work.setting.status_socket,
            randomGarbage(work.random));
}

/// Requests the status on a new connection each time, and sends garbage in between.
void askStatusAmongGarbage(Work& work) {
  do {
    sendGarbage(work);
    auto client = connect(work, work.setting.status_socket);
    if (client) count(work, client->call("io.hapticd.Status.GetStatus"));
  } while (work.pause(work.between(5, 20)));
}

struct ClientKind {
  const char* name;
  void (*work)(Work&);
};

constexpr ClientKind kClients[] = {
    {"stream, quick", watchQuickly},         {"stream, too slow", watchSlowly},
    {"hapticctl watch", watchWithHapticctl}, {"parameters", askParameters},
    {"changes, switching", steer},           {"status, garbage", askStatusAmongGarbage}};

}  // namespace

SoakClients::SoakClients(const ClientSetting& setting) {
  std::uint64_t number = 0;
  for (const ClientKind& kind : kClients) {
    ClientTally& tally = *tallies_.emplace_back(std::make_unique<ClientTally>());
    tally.name = kind.name;
    std::seed_seq seed{setting.seed, number++};
    threads_.emplace_back([kind, setting, random = std::mt19937_64(seed), &tally](std::stop_token stop) {
      Work work{setting, random, stop, tally};
      kind.work(work);
    });
  }
}

std::vector<ClientTally> SoakClients::stop() {
  for (std::jthread& thread : threads_) thread.request_stop();
  threads_.clear();
  std::vector<ClientTally> all;
  for (const auto& tally : tallies_) all.push_back(*tally);
  return all;
}

}  // namespace hapticd::tools
