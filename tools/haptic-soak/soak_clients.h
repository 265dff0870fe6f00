// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace hapticd::tools {

/// Statistics of one client.
struct ClientTally {
  std::string name;
  std::uint64_t calls = 0;          ///< answered; for a stream its replies
  std::uint64_t refused = 0;        ///< answered with an error, as they should
  std::uint64_t not_applied = 0;    ///< the force loop did not take the change in time
  std::uint64_t wrongly_taken = 0;  ///< must have been refused
  std::uint64_t unanswered = 0;     ///< no connection, no reply, or an invalid reply
  std::uint64_t left_out = 0;       ///< replies of the stream that the client was too slow for
  std::string first_problem;        ///< of `unanswered` and `wrongly_taken`
};

/// The sockets and programs that the clients use, and the seed of their variation.
struct ClientSetting {
  std::string status_socket;
  std::string control_socket;
  std::string hapticctl;  ///< program
  std::uint64_t seed = 1;
};

/// All clients, each with a thread of its own, from construction until stop().
class SoakClients {
 public:
  explicit SoakClients(const ClientSetting& setting);
  ~SoakClients() { stop(); }
  SoakClients(const SoakClients&) = delete;
  SoakClients& operator=(const SoakClients&) = delete;

  /// Ends all clients and returns their statistics.
  std::vector<ClientTally> stop();

 private:
  std::vector<std::unique_ptr<ClientTally>> tallies_;
  std::vector<std::jthread> threads_;
};

}  // namespace hapticd::tools
