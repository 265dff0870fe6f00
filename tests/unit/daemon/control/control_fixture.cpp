// SPDX-License-Identifier: Apache-2.0
#include "control_fixture.h"

#include <stdlib.h>

#include <filesystem>
#include <utility>

namespace hapticd::daemon::test {

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "hapticd-test-XXXXXX").string();
  EXPECT_NE(nullptr, ::mkdtemp(pattern.data()));
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

nlohmann::json errorReply(const std::string& name, const nlohmann::json& parameters) {
  return {{"error", name}, {"parameters", parameters}};
}

nlohmann::json invalidParameter(const std::string& field) {
  return errorReply("org.varlink.service.InvalidParameter", {{"parameter", field}});
}

nlohmann::json ControlFixture::askStatus(const std::string& method, const std::string& parameters) const {
  RawClient client = statusClient();
  client.call(R"({"method":")" + method + R"(","parameters":)" + parameters + "}");
  return client.json();
}

nlohmann::json ControlFixture::askControl(const std::string& method, const std::string& parameters) const {
  RawClient client = controlClient();
  client.call(R"({"method":")" + method + R"(","parameters":)" + parameters + "}");
  return client.json();
}

void ControlFixture::start() {
  server_options.listeners = {
      {.access = Access::read, .path = statusPath(), .mode = 0666, .group = "", .descriptor = -1},
      {.access = Access::control, .path = controlPath(), .mode = 0660, .group = "", .descriptor = -1}};
  service_options.log = [this](const JournalEntry& entry) {
    service_->onEvent(entry);
    const std::lock_guard lock(mutex_);
    log_.push_back(entry);
  };
  std::filesystem::create_directories(folder.path("state"));
  box.start();
  service_ = std::make_unique<ControlService>(box, service_options);
  auto server = VarlinkServer::create(server_options, *service_);
  ASSERT_TRUE(server) << server.error().text();
  server_ = std::move(*server);
  thread_ = std::thread([this] { server_->run(std::chrono::milliseconds(2), [this] { periodic(); }); });
}

void ControlFixture::stop() {
  if (thread_.joinable()) {
    server_->requestStop();
    thread_.join();
  }
  server_.reset();
}

void ControlFixture::periodic() {
  std::vector<rt::Tick> ticks;
  std::vector<JournalEntry> events;
  {
    const std::lock_guard lock(mutex_);
    ticks.swap(ticks_);
    events.swap(events_);
    warnings_ = service_->warnings();
  }
  box.periodic();
  for (const rt::Tick& tick : ticks) service_->onTick(tick);
  for (const JournalEntry& event : events) service_->onEvent(event);
  service_->periodic(*server_);
}

void ControlFixture::addTicks(const std::vector<rt::Tick>& ticks) {
  const std::lock_guard lock(mutex_);
  ticks_.insert(ticks_.end(), ticks.begin(), ticks.end());
}

void ControlFixture::addEvent(const JournalEntry& entry) {
  const std::lock_guard lock(mutex_);
  events_.push_back(entry);
}

std::vector<std::string> ControlFixture::warnings() const {
  const std::lock_guard lock(mutex_);
  return warnings_;
}

std::vector<JournalEntry> ControlFixture::log() const {
  const std::lock_guard lock(mutex_);
  return log_;
}

std::vector<std::map<std::string_view, std::string>> ControlFixture::logged(config::EventKind event) const {
  std::vector<std::map<std::string_view, std::string>> found;
  for (const JournalEntry& entry : log()) {
    if (entry.event == event) found.emplace_back(entry.fields.begin(), entry.fields.end());
  }
  return found;
}

}  // namespace hapticd::daemon::test
