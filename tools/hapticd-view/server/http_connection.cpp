// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/http_connection.h"

#include <fmt/format.h>
#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <boost/asio/buffer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/base/descriptor.h"
#include "tools/hapticd-view/server/access.h"
#include "tools/hapticd-view/server/web_socket_client.h"

namespace hapticd::tools::view {
namespace {

using boost::asio::ip::address;
using boost::asio::ip::tcp;

void put(const address& from, __be32 (&to)[4]) {
  if (from.is_v4()) {
    const auto bytes = from.to_v4().to_bytes();
    std::memcpy(to, bytes.data(), bytes.size());
  } else {
    const auto bytes = from.to_v6().to_bytes();
    std::memcpy(to, bytes.data(), bytes.size());
  }
}

struct Question {
  nlmsghdr head;
  inet_diag_req_v2 body;
};

/// Asks for the socket at the other end.
Question questionAbout(const address& remote, std::uint16_t remote_port, const address& local,
                       std::uint16_t local_port) {
  Question question{};
  question.head.nlmsg_len = sizeof question;
  question.head.nlmsg_type = SOCK_DIAG_BY_FAMILY;
  question.head.nlmsg_flags = NLM_F_REQUEST;
  question.body.sdiag_family = remote.is_v4() ? AF_INET : AF_INET6;
  question.body.sdiag_protocol = IPPROTO_TCP;
  question.body.idiag_states = ~0U;
  put(remote, question.body.id.idiag_src);
  put(local, question.body.id.idiag_dst);
  question.body.id.idiag_sport = htons(remote_port);
  question.body.id.idiag_dport = htons(local_port);
  question.body.id.idiag_cookie[0] = question.body.id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
  return question;
}

/// Nothing: the kernel knows no such socket of a process.
std::optional<uid_t> userIn(const std::byte* answer, std::size_t bytes) {
  nlmsghdr head{};
  inet_diag_msg body{};
  if (bytes < NLMSG_HDRLEN + sizeof body) return std::nullopt;
  std::memcpy(&head, answer, sizeof head);
  std::memcpy(&body, answer + NLMSG_HDRLEN, sizeof body);
  if (head.nlmsg_type != SOCK_DIAG_BY_FAMILY) return std::nullopt;
  // a socket that listens at that port is another one, and one that was closed belongs to nobody
  if (body.idiag_state == TCP_LISTEN || body.idiag_inode == 0) return std::nullopt;
  return body.idiag_uid;
}

std::optional<uid_t> userAt(const tcp::endpoint& remote, const tcp::endpoint& local) {
  const base::Descriptor socket(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_SOCK_DIAG));
  if (!socket) return std::nullopt;
  const Question question = questionAbout(plainAddress(remote.address()), remote.port(),
                                          plainAddress(local.address()), local.port());
  if (::send(socket.get(), &question, sizeof question, 0) < 0) return std::nullopt;
  std::array<std::byte, 4096> answer;
  const ssize_t bytes = ::recv(socket.get(), answer.data(), answer.size(), MSG_DONTWAIT);
  if (bytes < 0) return std::nullopt;
  return userIn(answer.data(), static_cast<std::size_t>(bytes));
}

}  // namespace

address plainAddress(const address& any) {
  if (!any.is_v6() || !any.to_v6().is_v4_mapped()) return any;
  return boost::asio::ip::make_address_v4(boost::asio::ip::v4_mapped, any.to_v6());
}

std::string connectionOwner(const tcp::endpoint& remote, const tcp::endpoint& local) {
  if (const auto user = userAt(remote, local)) return fmt::format("user {}", *user);
  return plainAddress(remote.address()).to_string();
}

namespace {

namespace beast = boost::beast;
namespace http = boost::beast::http;
using boost::system::error_code;

constexpr std::uint32_t kMaxHeaderBytes = 8 * 1024;
constexpr std::chrono::seconds kHeaderLimit{5};
constexpr std::chrono::seconds kAnswerLimit{30};  // in which a client takes a file
constexpr std::chrono::seconds kLingerLimit{1};
constexpr int kMaxLingering = 64;  // reads
constexpr int kReceiveBufferBytes = 64 * 1024;

constexpr const char* kTokenPage =
    "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>hapticd: token "
    "needed</title></head>\n"
    "<body><h1>This view needs a token</h1>\n<p>Run <code>hapticctl view</code> on the box and open the "
    "address "
    "that it prints.</p></body></html>\n";

/// `name`: a number that Beast has for it, or a text.
template <typename Name>
std::vector<std::string> fieldsOf(const UpgradeRequest& request, Name name) {
  std::vector<std::string> values;
  const auto [begin, end] = request.equal_range(name);
  for (auto field = begin; field != end; ++field) values.emplace_back(field->value());
  return values;
}

class HttpConnection final : public WaitingConnection, public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(boost::asio::ip::tcp::socket socket, Server& server, std::string owner)
      : server_(server), stream_(std::move(socket)), owner_(std::move(owner)) {
    server_.connections.push_back(this);
  }
  ~HttpConnection() override {
    server_.connections.remove(this);
    server_.last_use = std::chrono::steady_clock::now();
  }
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  void start() {
    error_code error;
    const auto remote = stream_.socket().remote_endpoint(error);
    const auto local = stream_.socket().local_endpoint(error);
    if (error) return;
    name_ = fmt::format("{}:{}", remote.address().to_string(), remote.port());
    local_address_ = plainAddress(local.address()).to_string();
    stream_.socket().set_option(boost::asio::socket_base::receive_buffer_size(kReceiveBufferBytes), error);
    parser_.header_limit(kMaxHeaderBytes);
    parser_.body_limit(0);
    stream_.expires_after(kHeaderLimit);
    const auto self = shared_from_this();
    http::async_read_header(stream_, buffer_, parser_,
                            [self](const error_code& failed, std::size_t) { self->onHeader(failed); });
  }

  OpenConnection state() const override { return {.owner = owner_, .is_admitted = is_admitted_}; }
  void giveWay() override {
    gave_way_ = true;
    server_.connections.remove(this);
    server_.log.refuse(name_, "it has sent no request yet, and there are too many connections");
    stream_.close();
  }

 private:
  void onHeader(const error_code& error) {
    if (gave_way_) return;
    if (error == http::error::header_limit || error == http::error::buffer_overflow)
      return refuse({.status = 431, .reason = fmt::format("a header longer than {} bytes", kMaxHeaderBytes)});
    if (error == beast::error::timeout) {
      server_.log.refuse(name_, fmt::format("no complete header within {} s", kHeaderLimit.count()));
      return;
    }
    if (error == http::error::end_of_stream || error == boost::asio::error::connection_reset) return;
    if (error) return refuse({.status = 400, .reason = "not HTTP: " + error.message()});

    const UpgradeRequest& request = parser_.get();
    head_ = {.method = std::string(request.method_string()),
             .target = std::string(request.target()),
             .hosts = fieldsOf(request, http::field::host),
             .origins = fieldsOf(request, http::field::origin),
             .fetch_sites = fieldsOf(request, "Sec-Fetch-Site"),
             .cookies = fieldsOf(request, http::field::cookie),
             .has_body = parser_.chunked() || parser_.content_length().value_or(0) > 0};
    AccessRules rules = server_.rules;
    rules.local_address = local_address_;
    const auto refusal = refusalOf(head_, rules);
    if (!refusal) return answer();
    if (!refusal->by_token) return refuse(*refusal);
    const auto self = shared_from_this();
    server_.ask_open_to_everybody([self, refused = *refusal](bool is_open) {
      if (self->gave_way_) return;
      if (is_open) return self->answer();
      self->refuse(refused);
    });
  }

  void answer() {
    is_admitted_ = true;
    if (beast::websocket::is_upgrade(parser_.get())) return upgrade();
    const std::string path = pathOf(head_.target);
    if (const auto token = tokenInQuery(head_.target); token && path == "/") return moveToken(*token);
    const PageFiles::File* file = server_.page.find(path);
    if (file == nullptr) {
      auto response = newResponse(http::status::not_found, "text/plain; charset=utf-8");
      response.body() = "There is no such file.\n";
      return send(std::move(response));
    }
    auto response = newResponse(http::status::ok, file->type);
    response.body() = file->content;
    send(std::move(response));
  }

  /// From the address, where it would stay in the history, into a cookie that no script can read.
  void moveToken(const std::string& token) {
    auto response = newResponse(http::status::see_other, "text/plain; charset=utf-8");
    response.set(http::field::location, "/");
    // An open box needs no token, and then the one in the address may be anything.
    if (isSameToken(token, server_.rules.token)) {
      response.set(http::field::set_cookie,
                   fmt::format("{}={}; HttpOnly; SameSite=Strict; Path=/", kTokenCookie, token));
    }
    send(std::move(response));
  }

  void upgrade() {
    const UpgradeRequest& request = parser_.get();
    const std::string path = pathOf(head_.target);
    const std::string protocol = path == "/" ? foxgloveProtocolOf(request) : "";
    if (path == "/" && protocol.empty())
      return refuse({.status = 400, .reason = "a WebSocket at / that offers no Foxglove protocol"});
    if (path != "/" && path != "/live") return refuse({.status = 404, .reason = "no WebSocket at " + path});
    if (buffer_.size() > 0) return refuse({.status = 400, .reason = "data before the WebSocket is open"});
    constexpr ConnectionLimits kLimits = Server::kClientLimits;
    if (server_.clients.size() >= kLimits.all)
      return refuse({.status = 503, .reason = fmt::format("{} clients are connected already", kLimits.all)});
    if (std::ranges::count(server_.clients, owner_, &ConnectedClient::owner) >=
        static_cast<std::ptrdiff_t>(kLimits.per_owner)) {
      return refuse({.status = 503,
                     .reason = fmt::format("{} clients of this user are connected already ({})",
                                           kLimits.per_owner, owner_)});
    }
    std::make_shared<WebSocketClient>(server_, std::move(stream_), name_, owner_)->start(request, protocol);
  }

  using Response = http::response<http::string_body>;

  Response newResponse(http::status status, const std::string& type) const {
    Response response(status, 11);
    response.keep_alive(false);
    response.set(http::field::content_type, type);
    response.set(http::field::cache_control, "no-store");
    response.set("Content-Security-Policy",
                 "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
                 "connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Referrer-Policy", "no-referrer");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
    response.set("Cross-Origin-Opener-Policy", "same-origin");
    return response;
  }

  void refuse(const Refusal& refusal) {
    server_.log.refuse(name_, refusal.reason);
    const bool by_token = refusal.status == 401;
    auto response = newResponse(static_cast<http::status>(refusal.status),
                                by_token ? "text/html; charset=utf-8" : "text/plain; charset=utf-8");
    if (refusal.status == 405) response.set(http::field::allow, "GET");
    response.body() = by_token ? kTokenPage : "Refused: " + refusal.reason + ".\n";
    send(std::move(response));
  }

  void send(Response response) {
    response_ = std::move(response);
    response_.prepare_payload();
    stream_.expires_after(kAnswerLimit);
    const auto self = shared_from_this();
    http::async_write(stream_, response_, [self](const error_code& error, std::size_t) {
      if (!error) self->linger();
    });
  }

  /// Takes what the client still sends: closing a socket with unread data would make the client's system drop
  /// the answer.
  void linger() {
    error_code ignored;
    stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
    stream_.expires_after(kLingerLimit);
    discard(kMaxLingering);
  }
  void discard(int reads) {
    const auto self = shared_from_this();
    stream_.async_read_some(boost::asio::buffer(discarded_),
                            [self, reads](const error_code& error, std::size_t) {
                              if (!error && reads > 1) self->discard(reads - 1);
                            });
  }

  Server& server_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kMaxHeaderBytes};
  http::request_parser<http::empty_body> parser_;
  RequestHead head_;
  Response response_;
  std::string owner_;
  std::string name_;
  std::string local_address_;
  bool is_admitted_ = false;
  bool gave_way_ = false;
  std::array<char, 1024> discarded_{};
};

}  // namespace

void serveConnection(boost::asio::ip::tcp::socket socket, Server& server) {
  error_code error;
  const auto remote = socket.remote_endpoint(error);
  const auto local = socket.local_endpoint(error);
  if (error) return;
  std::string owner = connectionOwner(remote, local);
  std::vector<OpenConnection> open;
  for (const WaitingConnection* each : server.connections) open.push_back(each->state());
  const Admission admission = admissionOf(open, owner, Server::kConnectionLimits);
  if (admission.gives_way) {
    const auto place = static_cast<std::ptrdiff_t>(*admission.gives_way);
    (*std::next(server.connections.begin(), place))->giveWay();
  }
  if (!admission.is_served)
    return server.log.refuse(owner, fmt::format("{} connections are being answered already", open.size()));
  std::make_shared<HttpConnection>(std::move(socket), server, std::move(owner))->start();
}

}  // namespace hapticd::tools::view
