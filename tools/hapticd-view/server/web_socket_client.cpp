// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/web_socket_client.h"

#include <fmt/format.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/http/field.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <string_view>

#include "tools/hapticd-view/live/foxglove_session.h"
#include "tools/hapticd-view/live/live_session.h"
#include "tools/hapticd-view/server/socket_progress.h"

namespace hapticd::tools::view {
namespace {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using boost::system::error_code;

constexpr std::chrono::seconds kWatchInterval{2};
/// What the kernel keeps of what a client does not read; enough for a frame of 600 KiB in flight.
constexpr int kSendBufferBytes = 512 * 1024;

std::string dropsText(std::uint64_t replaced, std::uint64_t dropped) {
  if (replaced == 0 && dropped == 0) return "nothing dropped";
  return fmt::format("dropped: {} replaced by newer ones, {} for want of room", replaced, dropped);
}

}  // namespace

std::string foxgloveProtocolOf(const UpgradeRequest& request) {
  std::string found;
  // both mean the same messages here
  for (const auto& name : beast::http::token_list(request[beast::http::field::sec_websocket_protocol])) {
    if (name == "foxglove.sdk.v1") return "foxglove.sdk.v1";
    if (name == "foxglove.websocket.v1") found = "foxglove.websocket.v1";
  }
  return found;
}

WebSocketClient::WebSocketClient(Server& server, beast::tcp_stream stream, std::string name,
                                 std::string owner)
    : server_(server),
      socket_(std::move(stream)),
      watch_timer_(server.context),
      name_(std::move(name)),
      owner_(std::move(owner)),
      outbox_(server.outboxes),
      last_sign_(Clock::now()),
      last_progress_(last_sign_),
      last_open_(last_sign_),
      last_ping_(last_sign_) {
  server_.clients.push_back(this);
}

WebSocketClient::~WebSocketClient() {
  finish("the program ends");
  server_.clients.remove(this);
}

void WebSocketClient::start(const UpgradeRequest& request, const std::string& protocol) {
  beast::tcp_stream& stream = beast::get_lowest_layer(socket_);
  stream.expires_never();  // isAlive() decides instead
  error_code ignored;
  stream.socket().set_option(boost::asio::ip::tcp::no_delay(true), ignored);
  stream.socket().set_option(boost::asio::socket_base::send_buffer_size(kSendBufferBytes), ignored);
  socket_.set_option(
      websocket::stream_base::timeout{websocket::stream_base::none(), websocket::stream_base::none(), false});
  socket_.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& response) {
    if (!protocol.empty()) response.set(beast::http::field::sec_websocket_protocol, protocol);
  }));
  socket_.auto_fragment(false);  // a frame leaves in one piece, without a copy
  socket_.control_callback([this](websocket::frame_type, beast::string_view) { last_sign_ = Clock::now(); });
  const auto self = shared_from_this();
  socket_.async_accept(request, [self, protocol](const error_code& error) {
    if (error) return self->finish("no WebSocket: " + error.message());
    self->begin(protocol);
  });
  watch();
}

void WebSocketClient::begin(const std::string& protocol) {
  server_.log.write(fmt::format("client {} connected to {}", name_, protocol.empty() ? "/live" : protocol));
  if (protocol.empty()) {
    const auto on_refused = [this](const std::string& problem) {
      server_.log.refuse(name_, "a change of fixtures: " + problem);
    };
    session_ = std::make_unique<LiveSession>(server_.source, *this, LiveSession::Clock::now, on_refused);
  } else {
    session_ = makeFoxgloveSession(server_.source, *this);
  }
  socket_.read_message_max(session_->longestMessage());
  server_.source.add(*session_);
  registered_ = true;
  write();
  read();
}

void WebSocketClient::read() {
  const auto self = shared_from_this();
  socket_.async_read(input_, [self](const error_code& error, std::size_t) {
    if (self->finished_) return;
    if (error)
      return self->finish(error == websocket::error::closed ? "closed by the client" : error.message());
    self->take();
  });
}

void WebSocketClient::take() {
  const Clock::time_point now = Clock::now();
  last_sign_ = now;
  if (now - message_second_ > std::chrono::seconds(1)) {
    message_second_ = now;
    messages_in_second_ = 0;
  }
  if (++messages_in_second_ > kMaxMessagesPerSecond) {
    close(fmt::format("more than {} messages a second", kMaxMessagesPerSecond));
  } else if (!closing_since_ && socket_.got_text()) {
    const auto bytes = input_.cdata();
    session_->onText({static_cast<const char*>(bytes.data()), bytes.size()});
  }
  input_.consume(input_.size());
  read();
}

void WebSocketClient::send(Message message, MessageKey key) {
  if (finished_ || closing_since_) return;
  outbox_.add(std::move(message), key);
  write();
}

void WebSocketClient::write() {
  if (finished_ || closing_since_ || !socket_.is_open()) return;
  const Message* const message = outbox_.beginTransmission();
  if (message == nullptr) return;
  socket_.text(message->is_text);
  const std::array buffers{boost::asio::const_buffer(message->head.data(), message->head.size()),
                           boost::asio::const_buffer(message->body.data(), message->body.size())};
  const auto self = shared_from_this();
  socket_.async_write(buffers, [self](const error_code& error, std::size_t bytes) {
    self->outbox_.endTransmission();
    if (self->finished_) return;
    if (error) return self->finish(error.message());
    ++self->sent_messages_;
    self->sent_bytes_ += bytes;
    self->write();
  });
}

void WebSocketClient::watch() {
  watch_timer_.expires_after(kWatchInterval);
  const auto self = shared_from_this();
  watch_timer_.async_wait([self](const error_code& error) {
    if (error || self->finished_) return;
    if (self->isAlive(Clock::now())) self->watch();
  });
}

/// Looks after the client; false: the connection has been closed.
bool WebSocketClient::isAlive(Clock::time_point now) {
  const int socket = beast::get_lowest_layer(socket_).socket().native_handle();
  const std::uint64_t taken = acknowledgedBytes(socket).value_or(acknowledged_);
  if (taken != acknowledged_ || !outbox_.isTransmitting()) last_progress_ = now;
  if (taken != acknowledged_ && outbox_.isTransmitting()) last_sign_ = now;
  acknowledged_ = taken;
  if (closing_since_ && now - *closing_since_ > kCloseLimit) {
    finish(close_reason_);
    return false;
  }
  // neither while the upgrade is answered, nor after an invalid frame while the client is to hang up
  if (socket_.is_open()) last_open_ = now;
  if (now - last_open_ > kCloseLimit) {
    finish("it neither talks by the protocol nor hangs up");
    return false;
  }
  if (now - last_progress_ > kProgressLimit) {
    finish(fmt::format("it has taken nothing for {} s", kProgressLimit.count()));
    return false;
  }
  // A client that takes what is sent, however slowly, is alive; its answer to a ping would wait behind that.
  if (outbox_.isTransmitting() || closing_since_) return true;
  if (last_ping_ > last_sign_ && now - last_ping_ > kAnswerLimit) {
    finish(fmt::format("no answer for {} s", kAnswerLimit.count()));
    return false;
  }
  const bool is_answered = last_ping_ <= last_sign_;
  if (is_answered && now - last_ping_ >= kPingInterval && socket_.is_open()) ping();
  return true;
}

void WebSocketClient::ping() {
  last_ping_ = Clock::now();
  const auto self = shared_from_this();
  socket_.async_ping({}, [self](const error_code&) {});
}

void WebSocketClient::close(std::string_view reason) {
  closeWith(websocket::close_code::policy_error, reason);
}

void WebSocketClient::goAway() {
  closeWith(websocket::close_code::going_away, "hapticd-view ends");
}

void WebSocketClient::closeWith(websocket::close_code code, std::string_view reason) {
  if (finished_ || closing_since_) return;
  if (!socket_.is_open()) return finish(std::string(reason));  // not yet a WebSocket
  closing_since_ = Clock::now();
  close_reason_ = reason;
  outbox_.clear();
  constexpr std::size_t kMaxReasonLength = 123;  // RFC 6455
  websocket::close_reason text(code);
  const std::string_view cut = reason.substr(0, kMaxReasonLength);
  text.reason.assign(cut.data(), cut.size());
  const auto self = shared_from_this();
  // waits for a message in transmission; kCloseLimit ends that
  socket_.async_close(text, [self](const error_code&) { self->finish(self->close_reason_); });
}

void WebSocketClient::finish(const std::string& reason) {
  if (finished_) return;
  finished_ = true;
  if (registered_) server_.source.remove(*session_);
  server_.last_use = Clock::now();
  watch_timer_.cancel();
  error_code ignored;
  beast::get_lowest_layer(socket_).socket().close(ignored);
  outbox_.clear();
  server_.log.write(fmt::format("client {} left: {}; {} messages, {} bytes, {}", name_, reason,
                                sent_messages_, sent_bytes_,
                                dropsText(outbox_.replaced(), outbox_.dropped())));
}

}  // namespace hapticd::tools::view
