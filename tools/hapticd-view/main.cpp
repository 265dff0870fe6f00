// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>
#include <CLI/CLI.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "config/base/program.h"
#include "config/settings/settings.h"
#include "tools/hapticd-view/box_link/box_source.h"
#include "tools/hapticd-view/box_link/fixture_changes.h"
#include "tools/hapticd-view/box_link/varlink_stream.h"
#include "tools/hapticd-view/server/access.h"
#include "tools/hapticd-view/server/listener.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools::view {
namespace {

struct BridgeOptions {
  std::string socket = config::Settings().control.status_socket;
  std::string control_socket = {};        ///< empty: viewers may not change the box
  bool add_fixtures = false;              ///< they may add fixtures
  bool move_hand = false;                 ///< they may move the hand of a simulated handle
  std::string listen = "127.0.0.1:8765";  ///< unused where the service manager passes sockets
  std::vector<std::string> hosts = {};
  std::vector<std::string> origins = {};
  std::string page = {};
  std::string token = {};  ///< empty: none is needed
  std::optional<double> idle_exit_s = {};
  std::string version = {};
};

/// The first of the options that let viewers change the box.
const char* controlOption(const BridgeOptions& options) {
  return options.add_fixtures ? "--add-fixtures" : "--move-hand";
}

struct BridgeFailure {
  base::Error error;
  int status = 0;  ///< of the program, sysexits.h
};

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
      : source_(context_, options.socket, options.version,
                options.add_fixtures ? options.control_socket : std::string(),
                options.move_hand ? options.control_socket : std::string()),
        open_to_everybody_(context_, options.socket),
        server_{.context = context_,
                .source = source_,
                .rules = {.local_address = "",
                          .hosts = options.hosts,
                          .origins = options.origins,
                          .token = options.token},
                .page = std::move(page),
                .ask_open_to_everybody =
                    [this, changes = !options.control_socket.empty()](OpenToEverybody::Answer answer) {
                      // to change the box takes the token, whoever may look
                      if (changes) return answer(false);
                      open_to_everybody_.ask(std::move(answer));
                    }},
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
    return options.control_socket.empty() ? std::nullopt : beyondLoopback(controlOption(options));
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
  /// Why the box cannot be changed from where it listens; nothing: it can. `option` lets viewers do so.
  std::optional<BridgeFailure> beyondLoopback(const char* option) const {
    for (const Listener& listener : listeners_) {
      if (listener.isLoopback()) continue;
      return BridgeFailure{
          {option,
           listener.endpointText() + " can be reached over the network, and the link is not encrypted",
           "listen on 127.0.0.1, and use 'ssh -L' from elsewhere"},
          EX_USAGE};
    }
    return std::nullopt;
  }

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

/// Serves until SIGTERM, SIGINT or the idle time has passed. Prints the address it listens at.
/// Thread: main.
std::optional<BridgeFailure> runBridge(const BridgeOptions& options) {
  auto page = PageFiles::in(options.page);
  if (!page) return BridgeFailure{page.error(), EX_NOINPUT};
  Bridge bridge(options, std::move(*page));
  if (auto failure = bridge.listen(options)) return failure;
  bridge.run();
  return std::nullopt;
}

constexpr const char* kTokenFile = "/run/hapticd-view/token";

int fail(const base::Error& error, int status) {
  fmt::print(stderr, "hapticd-view: {}\n", error.text());
  return status;
}

/// The folder of the page: of an installation beside the program, else that of the source tree.
std::string pageFolder() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  for (const char* installed : {"../share/hapticd/view", "../../share/hapticd/view"}) {
    const auto folder = (program.parent_path() / installed).lexically_normal();
    if (!error && std::filesystem::exists(folder / "index.html", error)) return folder.string();
  }
  return HAPTICD_VIEW_PAGE;
}

int run(int argc, char** argv) {
  CLI::App app{
      "hapticd-view: shows what the box sees and exerts, live, to browsers and to viewers that speak the\n"
      "Foxglove WebSocket protocol. It only reads, unless --add-fixtures lets its page add virtual "
      "fixtures,\nor --move-hand lets it move the hand of a simulated handle."};
  app.footer(
      "SIGTERM or Ctrl-C ends it. 'hapticctl view' prints the address with the token.\n"
      "From another computer: ssh -L 8765:127.0.0.1:8765 BOX, and then the same address there.\n"
      "Exit status: 0 done, 64 usage, 66 no page, 69 the address cannot be used, 73 no token,\n"
      "77 no right to control.");
  BridgeOptions options;
  options.version = HAPTICD_VERSION;
  std::string token_file = kTokenFile;
  bool no_token = false;
  bool make_token = false;
  std::string control_socket = config::Settings().control.control_socket;
  app.add_option("--socket", options.socket, "of a running hapticd (" + options.socket + ")")
      ->type_name("FILE");
  app.add_option_function<std::string>(
         "--trace",
         [](const std::string& trace) {
           throw CLI::ValidationError(
               "--trace", "only a running box is shown: open " + trace + " itself in Foxglove or Lichtblick");
         })
      ->group("");  // hidden: for those who had it from a build of the sources
  app.add_option("--listen", options.listen,
                 "where to answer (" + options.listen + "); port 0: any free one, which is printed")
      ->type_name("ADDRESS:PORT");
  app.add_option("--allow-host", options.hosts,
                 "further name of this computer that clients may use, for each; others are refused")
      ->type_name("NAME");
  auto* origin = app.add_option("--allow-origin", options.origins,
                                "further site whose pages may look, for each: https://example.org, file://")
                     ->type_name("ORIGIN");
  app.add_option("--page", options.page, "folder with the page (that of the installation)")->type_name("DIR");
  auto* file =
      app.add_option("--token-file", token_file,
                     fmt::format("with what clients must show, made when it is absent ({})", kTokenFile))
          ->type_name("FILE");
  app.add_flag("--no-token", no_token, "everybody who reaches the address may look")->excludes(file);
  auto* adds = app.add_flag(
      "--add-fixtures", options.add_fixtures,
      "let the page add virtual fixtures, with the rights of who runs this program: whoever has "
      "the token can then push a hand. Only on a loopback address, and with a token file that no "
      "other user can read");
  adds->excludes("--no-token")->excludes(origin);
  auto* moves = app.add_flag("--move-hand", options.move_hand,
                             "let the page move the hand of a simulated handle that follows a person "
                             "(simulated_handle.follows_person), one page at a time; on the same conditions");
  moves->excludes("--no-token")->excludes(origin);
  const auto* control =
      app.add_option("--control-socket", control_socket, "for these two (" + control_socket + ")")
          ->type_name("FILE");
  app.add_flag("--make-token", make_token, "only make the token file if it is absent, and end");
  app.add_option("--idle-exit", options.idle_exit_s,
                 "end after this long without a viewer (60 where the service manager listens, else never)")
      ->type_name("SECONDS")
      ->check(within(1.0, 1e6));
  app.set_version_flag("-V,--version", std::string("hapticd-view ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
    if (!control->empty() && adds->empty() && moves->empty())
      throw CLI::RequiresError("--control-socket", "--add-fixtures or --move-hand");
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  const bool controls = options.add_fixtures || options.move_hand;
  if (!no_token) {
    const auto token = tokenOf(token_file, controls ? TokenReaders::owner : TokenReaders::owner_and_group);
    if (!token) return fail(token.error(), EX_CANTCREAT);
    options.token = *token;
  }
  if (make_token) return EX_OK;
  if (controls) {
    if (auto allowed = mayControl(control_socket, controlOption(options)); !allowed)
      return fail(allowed.error(), EX_NOPERM);
    options.control_socket = control_socket;
  }
  if (options.page.empty()) options.page = pageFolder();
  if (auto failure = runBridge(options)) return fail(failure->error, failure->status);
  return EX_OK;
}

}  // namespace
}  // namespace hapticd::tools::view

int main(int argc, char** argv) {
  return hapticd::base::runProgram("hapticd-view", [&] { return hapticd::tools::view::run(argc, argv); });
}
