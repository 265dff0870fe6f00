// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/bridge.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <optional>
#include <utility>

#include "config/base/program.h"
#include "tools/hapticd-view/box_link/box_source.h"
#include "tools/hapticd-view/box_link/varlink_stream.h"
#include "tools/hapticd-view/server/listener.h"

namespace hapticd::tools::view {
namespace {

using boost::system::error_code;

constexpr double kIdleExitUnderActivationS = 60;
/// In which clients are told that the program ends.
constexpr std::chrono::milliseconds kFarewell{500};

/// An io_context that can drop what still waits before it dies itself.
class Context : public boost::asio::io_context {
 public:
  using io_context::io_context;
  void dropHandlers() { shutdown(); }
};

/// The program's parts, and when it ends.
class Bridge {
 public:
  Bridge(const BridgeOptions& options, PageFiles page)
      : source_(context_, options.socket, options.version),
        open_to_everybody_(context_, options.socket),
        server_{.context = context_,
                .source = source_,
                .rules = {.local_address = "",
                          .hosts = options.hosts,
                          .origins = options.origins,
                          .token = options.token},
                .page = std::move(page),
                .ask_open_to_everybody =
                    [this](OpenToEverybody::Answer answer) { open_to_everybody_.ask(std::move(answer)); }},
        signals_(context_, SIGTERM, SIGINT),
        timer_(context_) {}
  /// Connections are owned by what waits for them, and use the other parts to the end.
  ~Bridge() { context_.dropHandlers(); }
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  std::optional<BridgeFailure> listen(const BridgeOptions& options) {
    for (const int socket : socketsFromServiceManager()) {
      auto listener = Listener::of(server_, socket);
      if (!listener) return BridgeFailure{listener.error(), EX_UNAVAILABLE};
      listeners_.push_back(std::move(*listener));
      idle_exit_s_ = kIdleExitUnderActivationS;
    }
    if (listeners_.empty()) {
      auto listener = Listener::at(server_, options.listen);
      if (!listener) return BridgeFailure{listener.error(), EX_UNAVAILABLE};
      listeners_.push_back(std::move(*listener));
    }
    if (options.idle_exit_s) idle_exit_s_ = options.idle_exit_s;
    return std::nullopt;
  }

  void run() {
    for (Listener& listener : listeners_) {
      listener.start();
      fmt::print("hapticd-view listens at {}\n", listener.endpointText());
      if (!listener.isLoopback()) warnOfNetwork(listener.endpointText());
    }
    base::flushOutput();
    signals_.async_wait([this](const error_code& error, int) {
      if (!error) stop();
    });
    if (idle_exit_s_) watchIdle();
    notifyReady();
    context_.run();
  }

 private:
  void warnOfNetwork(const std::string& endpoint) {
    server_.log.write(fmt::format(
        "warning: {} can be reached over the network, and the link is not encrypted: who listens in sees the "
        "picture and the token (listen on 127.0.0.1, and use 'ssh -L 8765:127.0.0.1:8765' from elsewhere)",
        endpoint));
  }

  void watchIdle() {
    timer_.expires_after(std::chrono::seconds(1));
    timer_.async_wait([this](const error_code& error) {
      if (error) return;
      const auto idle = std::chrono::steady_clock::now() - server_.last_use;
      const bool nobody = server_.clients.empty() && server_.connections.empty();
      if (nobody && idle > std::chrono::duration<double>(*idle_exit_s_)) return stop();
      watchIdle();
    });
  }

  void stop() {
    if (std::exchange(server_.stopping, true)) return;
    notifyStopping();
    signals_.cancel();
    for (Listener& listener : listeners_) listener.stop();
    for (ConnectedClient* client : server_.clients) client->goAway();
    timer_.expires_after(server_.clients.empty() ? std::chrono::milliseconds(0) : kFarewell);
    timer_.async_wait([this](const error_code&) { context_.stop(); });
  }

  Context context_{1};
  BoxSource source_;
  OpenToEverybody open_to_everybody_;
  Server server_;
  std::vector<Listener> listeners_;
  boost::asio::signal_set signals_;
  boost::asio::steady_timer timer_;
  std::optional<double> idle_exit_s_;
};

}  // namespace

std::optional<BridgeFailure> runBridge(const BridgeOptions& options) {
  auto page = PageFiles::in(options.page);
  if (!page) return BridgeFailure{page.error(), EX_NOINPUT};
  Bridge bridge(options, std::move(*page));
  if (auto failure = bridge.listen(options)) return failure;
  bridge.run();
  return std::nullopt;
}

}  // namespace hapticd::tools::view
