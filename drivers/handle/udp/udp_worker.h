// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/base/status_board.h"
#include "drivers/handle/command_gate.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_frame.h"
#include "drivers/handle/udp/conversation.h"
#include "drivers/handle/udp/cpu_budget.h"
#include "drivers/handle/udp/packet.h"
#include "drivers/handle/udp/peer_clock.h"
#include "drivers/handle/udp/udp_settings.h"
#include "drivers/handle/udp/udp_socket.h"

namespace hapticd::drivers::udp {

/// Settings of a UdpWorker.
struct WorkerSettings {
  Ipv4Endpoint local;
  Ipv4Endpoint peer;           ///< without a port: any port of that address
  std::vector<std::byte> key;  ///< empty: packets are not authenticated
};

/// The thread function of a UdpHandle and its state: processes states, replies to each with the newest
/// command, and determines whether the peer is present.
/// Thread: one.
class UdpWorker {
 public:
  UdpWorker(const WorkerSettings& settings, HandleFrame frame, HandleChannels& channels,
            StatusBoard<HandleStatus>& board, CommandGate& gate)
      : settings_(settings), frame_(frame), channels_(channels), board_(board), gate_(gate) {}

  /// Binds the socket; packets that arrive from then on are queued until run(). Returns true if it is bound.
  bool openSocket();

  /// Runs until `stop_event` (an eventfd) is readable, then commands the peer to exert no force.
  void run(int stop_event);

 private:
  struct Arrived {
    StatePacket packet;
    std::int64_t time_ns = 0;
  };

  std::int64_t nextDueNs() const;

  void receiveAll();
  void take(const UdpSocket::Datagram& datagram, std::int64_t now_ns);
  void takeOver(const StatePacket& packet, const Ipv4Endpoint& from, std::int64_t now_ns);
  void noteRefusal(std::string why, std::int64_t now_ns);
  void answerUnproven(const Header& heard, const Ipv4Endpoint& from, std::int64_t now_ns);
  void publishNewest();
  void beginSession();
  bool isAlive(std::int64_t now_ns) const;

  void sendCommand(std::int64_t now_ns);
  void send(const CommandPacket& packet, const Ipv4Endpoint& to);
  void sendGoodbye();

  void become(HandlePresence presence, std::int64_t now_ns);
  void report(std::int64_t now_ns);
  std::string detail() const;
  std::string advice() const;

  WorkerSettings settings_;
  HandleFrame frame_;
  HandleChannels& channels_;
  StatusBoard<HandleStatus>& board_;
  CommandGate& gate_;
  UdpSocket socket_;
  Conversation conversation_;

  HandlePresence presence_ = HandlePresence::absent;
  Ipv4Endpoint from_;                   // sender of the newest state
  std::uint64_t session_of_frame_ = 0;  // the peer's session that corresponds to the frame's session
  bool session_began_ = false;          // the frame's session has begun but nothing was published in it yet
  std::optional<Arrived> newest_;       // fresh, not published yet
  std::int64_t fresh_ns_ = 0;           // arrival of the newest fresh state
  std::int64_t state_interval_ns_ = 0;  // between states, smoothed
  CpuBudget budget_;
  PeerClock peer_clock_;
  DelayEstimate delay_;
  std::uint64_t measurements_ = 0;

  std::int64_t command_sent_ns_ = 0;
  std::int64_t answered_ns_ = 0;  // time of the last reply to an unproven packet
  std::string bind_failure_;
  int send_failure_ = 0;  // errno
  std::string refusal_;   // of the last rejected packet
  std::int64_t refused_ns_ = 0;
  std::int64_t reported_ns_ = 0;
};

}  // namespace hapticd::drivers::udp
