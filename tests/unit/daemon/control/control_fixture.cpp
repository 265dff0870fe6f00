// SPDX-License-Identifier: Apache-2.0
#include "control_fixture.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace hapticd::daemon::test {

RawClient::RawClient(const std::string& path)
    : RawClient(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), path) {}

RawClient::RawClient(int socket, const std::string& path) : socket_(socket) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  EXPECT_EQ(0, ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address)) << path;
}

RawClient::RawClient(RawClient&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), input_(std::move(other.input_)) {}

void RawClient::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count < 0) return;  // closed by the server; reply() shows it
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
}

void RawClient::call(std::string_view text) {
  send(message(text));
}

void RawClient::pass(std::string_view text, const std::vector<int>& descriptors) {
  const std::string bytes = message(text);
  iovec part{const_cast<char*>(bytes.data()), bytes.size()};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  const std::size_t size = descriptors.size() * sizeof(int);
  std::vector<cmsghdr> control(CMSG_SPACE(size) / sizeof(cmsghdr) + 1);
  header.msg_control = control.data();
  header.msg_controllen = CMSG_SPACE(size);
  cmsghdr* const rights = CMSG_FIRSTHDR(&header);
  rights->cmsg_level = SOL_SOCKET;
  rights->cmsg_type = SCM_RIGHTS;
  rights->cmsg_len = CMSG_LEN(size);
  std::memcpy(CMSG_DATA(rights), descriptors.data(), size);
  EXPECT_EQ(::sendmsg(socket_, &header, MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
}

std::size_t RawClient::sendWithoutWaiting(std::string_view bytes) {
  const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  return count < 0 ? 0 : static_cast<std::size_t>(count);
}

std::string RawClient::reply() {
  for (;;) {
    if (const std::size_t end = input_.find('\0'); end != std::string::npos) {
      std::string text = input_.substr(0, end);
      input_.erase(0, end + 1);
      return text;
    }
    pollfd descriptor{socket_, POLLIN, 0};
    if (::poll(&descriptor, 1, 60'000) <= 0) return kNoAnswer;
    char chunk[65536];
    const ssize_t count = ::recv(socket_, chunk, sizeof chunk, 0);
    if (count <= 0) return kClosed;
    input_.append(chunk, static_cast<std::size_t>(count));
  }
}

nlohmann::json RawClient::json() {
  return nlohmann::json::parse(reply(), nullptr, false);
}

bool RawClient::canSend() {
  return ::send(socket_, " ", 1, MSG_NOSIGNAL) == 1;
}

bool RawClient::silent() const {
  pollfd descriptor{socket_, POLLIN, 0};
  return input_.empty() && ::poll(&descriptor, 1, 0) == 0;
}

void RawClient::endInput() {
  ::shutdown(socket_, SHUT_WR);
}

void RawClient::close() {
  if (socket_ >= 0) ::close(std::exchange(socket_, -1));
}

std::string message(std::string_view text) {
  return std::string(text) + '\0';
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
