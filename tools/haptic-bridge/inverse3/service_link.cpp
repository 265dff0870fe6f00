// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/inverse3/service_link.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <utility>

#include "config/base/value_text.h"

namespace hapticd::tools::inverse3 {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Clock = std::chrono::steady_clock;
using boost::system::error_code;

constexpr std::size_t kMaxMessageBytes = 1024 * 1024;
constexpr std::chrono::milliseconds kSlice{20};
constexpr std::chrono::milliseconds kWritePatience{100};
constexpr std::chrono::milliseconds kClosePatience{200};

/// Runs handlers until `done()`; false: not by the deadline, or it was given up.
template <typename Done>
bool runUntil(asio::io_context& io, Done done, Clock::time_point deadline, const GivesUp& gives_up) {
  while (!done()) {
    const auto left = deadline - Clock::now();
    if (left <= Clock::duration::zero() || (gives_up && gives_up())) return false;
    io.restart();
    io.run_one_for(std::min<Clock::duration>(left, kSlice));
  }
  return true;
}

asio::ip::tcp::endpoint tcpEndpointOf(const ServiceEndpoint& endpoint) {
  error_code ignored;  // serviceEndpointFrom() has parsed it
  return {asio::ip::make_address(endpoint.address, ignored), endpoint.port};
}

base::Error failure(const ServiceEndpoint& endpoint, const std::string& what) {
  return {"Inverse Service at " + endpoint.text(), what,
          "systemctl status haply-inverse-service; --address names another place"};
}

/// One step of opening a connection, with its result.
class Step {
 public:
  /// Returns the handler of an asynchronous operation; this outlives it.
  auto handler() {
    return [this](const error_code& error, auto&&...) { result_ = error; };
  }
  base::Result<void> waitFor(asio::io_context& io, Clock::time_point deadline, const GivesUp& gives_up,
                             const ServiceEndpoint& endpoint) {
    if (!runUntil(
            io, [this] { return result_.has_value(); }, deadline, gives_up))
      return std::unexpected(failure(endpoint, "does not answer"));
    const error_code result = *std::exchange(result_, std::nullopt);
    if (result) return std::unexpected(failure(endpoint, result.message()));
    return {};
  }

 private:
  std::optional<error_code> result_;
};

}  // namespace

std::string ServiceEndpoint::text() const {
  return fmt::format("{}:{}", address, port);
}

base::Result<ServiceEndpoint> serviceEndpointFrom(const std::string& text) {
  const auto refused = [&] {
    return std::unexpected(base::Error{"--address", base::inQuotes(text) + " is not ADDRESS:PORT",
                                       "for example 127.0.0.1:10001"});
  };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return refused();
  ServiceEndpoint endpoint{text.substr(0, colon), 0};
  if (endpoint.address == "localhost") endpoint.address = "127.0.0.1";
  const auto port = base::numberFrom<std::uint16_t>(std::string_view(text).substr(colon + 1));
  error_code error;
  asio::ip::make_address_v4(endpoint.address, error);
  if (error || !port || *port == 0) return refused();
  endpoint.port = *port;
  return endpoint;
}

base::Result<std::string> httpGet(const ServiceEndpoint& endpoint, const std::string& target,
                                  std::chrono::milliseconds patience, const GivesUp& gives_up) {
  const auto deadline = Clock::now() + patience;
  asio::io_context io;
  Step step;
  http::request<http::empty_body> request{http::verb::get, target, 11};
  request.set(http::field::host, endpoint.text());
  request.set(http::field::connection, "close");
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> answer;
  answer.body_limit(kMaxMessageBytes);
  beast::tcp_stream stream(io);  // last, so that it ends before what its operations use

  stream.async_connect(tcpEndpointOf(endpoint), step.handler());
  if (auto ok = step.waitFor(io, deadline, gives_up, endpoint); !ok) return std::unexpected(ok.error());
  http::async_write(stream, request, step.handler());
  if (auto ok = step.waitFor(io, deadline, gives_up, endpoint); !ok) return std::unexpected(ok.error());
  http::async_read(stream, buffer, answer, step.handler());
  if (auto ok = step.waitFor(io, deadline, gives_up, endpoint); !ok) return std::unexpected(ok.error());
  if (answer.get().result() != http::status::ok) {
    return std::unexpected(
        failure(endpoint, fmt::format("answers GET {} with status {}", target, answer.get().result_int())));
  }
  return answer.get().body();
}

/// The socket with its buffers. A read is always pending, so that answers and control frames are taken
/// whenever the context runs.
class ServiceLink::Socket {
 public:
  explicit Socket(ServiceEndpoint endpoint) : endpoint_(std::move(endpoint)), socket_(io_) {}

  base::Result<void> open(Clock::time_point deadline, const GivesUp& gives_up) {
    beast::get_lowest_layer(socket_).async_connect(tcpEndpointOf(endpoint_), step_.handler());
    if (auto ok = step_.waitFor(io_, deadline, gives_up, endpoint_); !ok) return ok;
    error_code ignored;
    beast::get_lowest_layer(socket_).socket().set_option(asio::ip::tcp::no_delay(true), ignored);
    socket_.set_option(websocket::stream_base::timeout{websocket::stream_base::none(),
                                                       websocket::stream_base::none(), false});
    socket_.read_message_max(kMaxMessageBytes);
    socket_.auto_fragment(false);
    socket_.text(true);
    socket_.async_handshake(endpoint_.text(), "/", step_.handler());
    if (auto ok = step_.waitFor(io_, deadline, gives_up, endpoint_); !ok) return ok;
    read();
    return {};
  }

  base::Result<void> send(const std::string& text) {
    if (broken_) return lost();
    output_ = text;
    written_ = false;
    socket_.async_write(asio::buffer(output_), [this](const error_code& error, std::size_t) {
      written_ = true;
      if (error && !broken_) broken_ = error.message();
    });
    if (!runUntil(io_, [this] { return written_; }, Clock::now() + kWritePatience, {})) {
      broken_ = "takes nothing any more";
      drop();
    }
    return broken_ ? lost() : base::Result<void>{};
  }

  base::Result<std::optional<std::string>> receive(std::chrono::nanoseconds patience) {
    constexpr int kMaxHandlersAtOnce = 16;  // a service that floods must not hold the caller
    acknowledgeAtOnce();
    io_.restart();
    for (int i = 0; i < kMaxHandlersAtOnce && arrived_.empty() && !broken_; ++i) {
      if (io_.poll_one() == 0) break;
    }
    if (patience > patience.zero())
      runUntil(io_, [this] { return !arrived_.empty() || broken_; }, Clock::now() + patience, {});
    if (!arrived_.empty()) {
      std::optional<std::string> oldest = std::move(arrived_.front());
      arrived_.pop_front();
      return oldest;
    }
    if (broken_) return std::unexpected(lost().error());
    return std::nullopt;
  }

  void close() {
    if (!broken_) {
      socket_.async_close(websocket::close_code::normal, [this](const error_code&) { closed_ = true; });
      runUntil(io_, [this] { return closed_; }, Clock::now() + kClosePatience, {});
    }
    drop();
  }

 private:
  /// A service that collects small segments (Nagle's algorithm) keeps an answer until the one before it is
  /// acknowledged, which the kernel delays by 40 ms where nothing is sent. It forgets this by and by.
  void acknowledgeAtOnce() {
    const int on = 1;
    ::setsockopt(beast::get_lowest_layer(socket_).socket().native_handle(), IPPROTO_TCP, TCP_QUICKACK, &on,
                 sizeof on);
  }
  void read() {
    socket_.async_read(input_, [this](const error_code& error, std::size_t) {
      if (error) {
        if (!broken_) broken_ = error == websocket::error::closed ? "closed the connection" : error.message();
        return;
      }
      arrived_.push_back(beast::buffers_to_string(input_.data()));
      input_.consume(input_.size());
      read();
    });
  }
  /// Ends all operations; their handlers run here.
  void drop() {
    error_code ignored;
    beast::get_lowest_layer(socket_).socket().close(ignored);
    if (!broken_) broken_ = "closed";
    io_.restart();
    io_.run_for(kClosePatience);
  }
  base::Result<void> lost() const { return std::unexpected(failure(endpoint_, *broken_)); }

  ServiceEndpoint endpoint_;
  asio::io_context io_;
  Step step_;
  beast::flat_buffer input_;
  std::string output_;
  bool written_ = false;
  bool closed_ = false;
  std::deque<std::string> arrived_;
  std::optional<std::string> broken_;  // why nothing more comes
  websocket::stream<beast::tcp_stream> socket_;
};

ServiceLink::ServiceLink(std::unique_ptr<Socket> socket) : socket_(std::move(socket)) {}
ServiceLink::ServiceLink(ServiceLink&&) noexcept = default;
ServiceLink& ServiceLink::operator=(ServiceLink&&) noexcept = default;
ServiceLink::~ServiceLink() = default;

base::Result<ServiceLink> ServiceLink::open(const ServiceEndpoint& endpoint,
                                            std::chrono::milliseconds patience, const GivesUp& gives_up) {
  auto socket = std::make_unique<Socket>(endpoint);
  if (auto ok = socket->open(Clock::now() + patience, gives_up); !ok) return std::unexpected(ok.error());
  return ServiceLink(std::move(socket));
}

base::Result<void> ServiceLink::send(const std::string& text) {
  return socket_->send(text);
}

base::Result<std::optional<std::string>> ServiceLink::receive(std::chrono::nanoseconds patience) {
  return socket_->receive(patience);
}

void ServiceLink::close() {
  socket_->close();
}

}  // namespace hapticd::tools::inverse3
