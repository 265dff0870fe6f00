// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "box_under_test.h"
#include "daemon/control/control_service.h"
#include "daemon/control/server/varlink_server.h"
#include "raw_client.h"

namespace hapticd::daemon::test {

/// A new folder that is removed with its content.
class TemporaryFolder {
 public:
  TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder();
  std::string path(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

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
