// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/listener.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <systemd/sd-daemon.h>

#include <charconv>
#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include "config/base/value_text.h"
#include "tools/hapticd-view/server/http_connection.h"

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

namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr const char* kForm = "name an address and a port: 127.0.0.1:8765, [::1]:8765";

/// "[::1]" or "127.0.0.1", and a port.
std::optional<tcp::endpoint> endpointFrom(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return std::nullopt;
  std::string address = text.substr(0, colon);
  const bool is_bracketed = address.size() > 2 && address.front() == '[' && address.back() == ']';
  if (is_bracketed) address = address.substr(1, address.size() - 2);
  error_code error;
  const auto parsed = boost::asio::ip::make_address(address, error);
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, wrong] = std::from_chars(text.data() + colon + 1, end, port);
  if (error || wrong != std::errc() || stop != end || parsed.is_v6() != is_bracketed) return std::nullopt;
  return tcp::endpoint(parsed, port);
}

}  // namespace

base::Result<Listener> Listener::at(Server& server, const std::string& endpoint) {
  const auto parsed = endpointFrom(endpoint);
  if (!parsed) {
    return std::unexpected(
        base::Error{"--listen", base::inQuotes(endpoint) + " is not an address and a port", kForm});
  }
  Listener listener(server);
  auto& acceptor = listener.state_->acceptor;
  error_code error;
  acceptor.open(parsed->protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(*parsed, error);
  if (!error) acceptor.listen(static_cast<int>(Server::kConnectionLimits.all), error);
  if (error) return std::unexpected(base::Error{"--listen", endpoint + ": " + error.message(), kForm});
  return listener;
}

base::Result<Listener> Listener::of(Server& server, int descriptor) {
  Listener listener(server);
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  const bool known = ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  const bool is_v6 = address.ss_family == AF_INET6;
  error_code error;
  if (known && (is_v6 || address.ss_family == AF_INET))
    listener.state_->acceptor.assign(is_v6 ? tcp::v6() : tcp::v4(), descriptor, error);
  if (!listener.state_->acceptor.is_open()) {
    return std::unexpected(base::Error{"the service manager's socket", "is not one of TCP",
                                       "see ListenStream= in 'systemctl cat hapticd-view.socket'"});
  }
  return listener;
}

void Listener::start() {
  accept(state_);
}

void Listener::stop() {
  error_code ignored;
  state_->acceptor.close(ignored);
  state_->pause.cancel();
}

std::string Listener::endpointText() const {
  error_code ignored;
  const auto endpoint = state_->acceptor.local_endpoint(ignored);
  const std::string address = endpoint.address().to_string();
  if (endpoint.address().is_v6()) return fmt::format("[{}]:{}", address, endpoint.port());
  return fmt::format("{}:{}", address, endpoint.port());
}

bool Listener::isLoopback() const {
  error_code ignored;
  return state_->acceptor.local_endpoint(ignored).address().is_loopback();
}

void Listener::accept(const std::shared_ptr<State>& state) {
  state->acceptor.async_accept([state](const error_code& error, tcp::socket socket) {
    if (!state->acceptor.is_open()) return;
    if (error) {  // too many open files, or the client is gone already
      state->pause.expires_after(std::chrono::milliseconds(100));
      state->pause.async_wait([state](const error_code& cancelled) {
        if (!cancelled) accept(state);
      });
      return;
    }
    serveConnection(std::move(socket), state->server);
    accept(state);
  });
}

}  // namespace hapticd::tools::view
