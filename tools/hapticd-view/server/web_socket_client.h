// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "tools/hapticd-view/live/message_sink.h"
#include "tools/hapticd-view/live/source.h"
#include "tools/hapticd-view/server/outbox.h"
#include "tools/hapticd-view/server/server.h"

namespace hapticd::tools::view {

using UpgradeRequest = boost::beast::http::request<boost::beast::http::empty_body>;

/// Whether a request offers one of the Foxglove protocols, and which one is answered; empty: none.
std::string foxgloveProtocolOf(const UpgradeRequest& request);

/// A client with a WebSocket: sends what its session has for it, and closes the connection when the client
/// takes or answers nothing for too long. Lives as long as its connection.  Thread: the io_context's.
class WebSocketClient final : public MessageSink,
                              public ConnectedClient,
                              public std::enable_shared_from_this<WebSocketClient> {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::chrono::seconds kPingInterval{15};
  static constexpr std::chrono::seconds kAnswerLimit{30};    ///< from a ping to any sign of life
  static constexpr std::chrono::seconds kProgressLimit{60};  ///< in which a client takes at least one byte
  static constexpr std::chrono::seconds kCloseLimit{5};
  static constexpr int kMaxMessagesPerSecond = 100;  ///< from the client

  /// `name`: of the client, for the log. `stream`: the connection after the header of the request.
  WebSocketClient(Server& server, boost::beast::tcp_stream stream, std::string name, std::string owner);
  ~WebSocketClient() override;
  WebSocketClient(const WebSocketClient&) = delete;
  WebSocketClient& operator=(const WebSocketClient&) = delete;

  /// Answers the upgrade. `protocol`: the Foxglove protocol agreed on; empty: `/live`.
  void start(const UpgradeRequest& request, const std::string& protocol);
  const std::string& owner() const override { return owner_; }
  void goAway() override;

  void send(Message message, MessageKey key) override;
  bool waits(MessageKey key) const override { return outbox_.waits(key); }
  void withdraw(MessageKey key) override { outbox_.withdraw(key); }
  void close(std::string_view reason) override;

 private:
  void begin(const std::string& protocol);
  void read();
  void take();
  void write();
  void watch();
  bool isAlive(Clock::time_point now);
  void ping();
  void closeWith(boost::beast::websocket::close_code code, std::string_view reason);
  void finish(const std::string& reason);

  Server& server_;
  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  boost::asio::steady_timer watch_timer_;
  std::string name_;
  std::string owner_;
  std::unique_ptr<Session> session_;
  boost::beast::flat_buffer input_;

  Outbox outbox_;

  std::string close_reason_;
  std::optional<Clock::time_point> closing_since_;
  Clock::time_point last_sign_;      // of life: a message, a pong
  Clock::time_point last_progress_;  // of what it takes
  Clock::time_point last_open_;      // as a WebSocket
  Clock::time_point last_ping_;
  std::uint64_t acknowledged_ = 0;  // bytes
  Clock::time_point message_second_;
  int messages_in_second_ = 0;
  bool finished_ = false;
  bool registered_ = false;

  std::uint64_t sent_messages_ = 0;
  std::uint64_t sent_bytes_ = 0;
};

}  // namespace hapticd::tools::view
