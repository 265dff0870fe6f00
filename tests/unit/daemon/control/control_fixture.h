// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "box_under_test.h"
#include "daemon/control/control_service.h"
#include "daemon/control/server/varlink_server.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::daemon::test {

using hapticd::test::TemporaryFolder;

/// A client that sends and receives bytes, which the tests write by hand.
class RawClient {
 public:
  static constexpr const char* kClosed = "<closed>";
  static constexpr const char* kNoAnswer = "<no answer>";

  explicit RawClient(const std::string& path);
  /// Connects an existing socket, for tests in which no new one can be opened.
  static RawClient adopt(int socket, const std::string& path) { return RawClient(socket, path); }
  RawClient(RawClient&& other) noexcept;
  RawClient& operator=(RawClient&&) = delete;
  ~RawClient() { close(); }

  int descriptor() const noexcept { return socket_; }
  void send(std::string_view bytes);
  /// Sends one message: `text` and the NUL.
  void call(std::string_view text);
  /// Sends one message with descriptors.
  void pass(std::string_view text, const std::vector<int>& descriptors);
  /// Sends as many bytes as possible without waiting.
  std::size_t sendWithoutWaiting(std::string_view bytes);

  /// The next message without its NUL, kClosed when there is none any more, kNoAnswer after 60 s (so long
  /// that a loaded machine does not fail).
  std::string reply();
  /// Returns the next message as JSON; a discarded value if it is not JSON.
  nlohmann::json json();

  /// Whether the server would still take something; without SIGPIPE.
  bool canSend();

  /// Whether reply() has returned everything that has arrived.
  bool silent() const;

  /// Closes the sending direction, as `printf ... | socat` does.
  void endInput();
  void close();

 private:
  RawClient(int socket, const std::string& path);

  int socket_;
  std::string input_;
};

/// `text` and the NUL.
std::string message(std::string_view text);

/// Returns the error reply with this name and these parameters.
nlohmann::json errorReply(const std::string& name,
                          const nlohmann::json& parameters = nlohmann::json::object());
nlohmann::json invalidParameter(const std::string& field);

/// The control API on two real sockets, served by a thread of the test, in front of a running box.
class ControlFixture : public testing::Test {
 protected:
  ~ControlFixture() override { stop(); }

  /// Listeners are added by start().
  ServerOptions server_options;
  ControlServiceOptions service_options{.apply_timeout = std::chrono::minutes(10), .log = {}};

  void start();
  void stop();
  RawClient statusClient() const { return RawClient(statusPath()); }
  RawClient controlClient() const { return RawClient(controlPath()); }
  /// The warnings of the service at its last period.
  std::vector<std::string> warnings() const;
  std::string statusPath() const { return folder.path("Status"); }
  std::string controlPath() const { return folder.path("Control"); }

  /// The reply to one call on a new connection.
  nlohmann::json askStatus(const std::string& method, const std::string& parameters = "{}") const;
  nlohmann::json askControl(const std::string& method, const std::string& parameters = "{}") const;

  /// The reply to a call of io.hapticd.Control.
  nlohmann::json ask(const std::string& method,
                     const nlohmann::json& parameters = nlohmann::json::object()) const {
    return askControl("io.hapticd.Control." + method, parameters.dump());
  }

  /// Hands the service ticks as the daemon does.
  void addTicks(const std::vector<rt::Tick>& ticks);
  /// Hands the service an entry of the journal as the daemon does.
  void addEvent(const JournalEntry& entry);
  std::vector<JournalEntry> log() const;
  /// The fields of all events of that kind in the log so far.
  std::vector<std::map<std::string_view, std::string>> logged(config::EventKind event) const;

  TemporaryFolder folder;
  BoxUnderTest box{folder.path("state")};

 private:
  void periodic();

  mutable std::mutex mutex_;
  std::vector<rt::Tick> ticks_;
  std::vector<JournalEntry> events_;
  std::vector<std::string> warnings_;  // of the service at its last period
  std::vector<JournalEntry> log_;
  std::unique_ptr<ControlService> service_;
  std::unique_ptr<VarlinkServer> server_;
  std::thread thread_;
};

}  // namespace hapticd::daemon::test
