// SPDX-License-Identifier: Apache-2.0
#include "tests/system/fake_daemon.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace hapticd::test {
namespace {

using nlohmann::json;

bool sendAll(int socket, const json& message) {
  std::string bytes = message.dump();
  bytes.push_back('\0');
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = ::send(socket, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return false;
    sent += static_cast<std::size_t>(count);
  }
  return true;
}

}  // namespace

FakeDaemon::FakeDaemon(const std::filesystem::path& path)
    : listener_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)), end_(::eventfd(0, EFD_CLOEXEC)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.string().copy(address.sun_path, sizeof address.sun_path - 1);
  if (::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener_, 16) != 0) {
    throw std::runtime_error("cannot listen on " + path.string());
  }
  thread_ = std::thread([this] { serve(); });
}

FakeDaemon::~FakeDaemon() {
  ::eventfd_write(end_, 1);
  thread_.join();
  for (const Client& client : clients_) ::close(client.socket);
  ::close(listener_);
  ::close(end_);
}

void FakeDaemon::answer(const std::string& method, FakeAnswer answer) {
  const std::lock_guard lock(mutex_);
  answers_[method] = std::move(answer);
}

void FakeDaemon::answer(const std::string& method, const json& parameters) {
  answer(method, FakeAnswer{.replies = {parameters}});
}

void FakeDaemon::refuse(const std::string& method, const std::string& error, const json& parameters) {
  answer(method, FakeAnswer{.error = error, .error_parameters = parameters});
}

std::vector<json> FakeDaemon::calls() const {
  const std::lock_guard lock(mutex_);
  return calls_;
}

json FakeDaemon::newestCall(const std::string& method) const {
  const std::vector<json> all = calls();
  const auto found = std::find_if(all.rbegin(), all.rend(),
                                  [&](const json& call) { return call.value("method", "") == method; });
  return found == all.rend() ? json() : found->value("parameters", json::object());
}

void FakeDaemon::serve() {
  for (;;) {
    std::vector<pollfd> waiting{{end_, POLLIN, 0}, {listener_, POLLIN, 0}};
    for (const Client& client : clients_) waiting.push_back({client.socket, POLLIN, 0});
    ::poll(waiting.data(), waiting.size(), -1);
    if (waiting[0].revents != 0) return;
    for (std::size_t i = clients_.size(); i-- > 0;) {
      if (waiting[i + 2].revents == 0 || receive(clients_[i])) continue;
      ::close(clients_[i].socket);
      clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i));
    }
    if (waiting[1].revents != 0) accept();
  }
}

void FakeDaemon::accept() {
  const int socket = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (socket >= 0) clients_.push_back({socket, {}});
}

bool FakeDaemon::receive(Client& client) {
  std::array<char, 4096> bytes;
  const ssize_t count = ::recv(client.socket, bytes.data(), bytes.size(), 0);
  if (count <= 0) return false;
  client.input.append(bytes.data(), static_cast<std::size_t>(count));
  for (std::size_t end = 0; (end = client.input.find('\0')) != std::string::npos;) {
    const std::string message = client.input.substr(0, end);
    client.input.erase(0, end + 1);
    if (!reply(client.socket, message)) return false;
  }
  return true;
}

FakeAnswer FakeDaemon::answerTo(const json& call) {
  const std::lock_guard lock(mutex_);
  calls_.push_back(call);
  const std::string method = call.value("method", "");
  for (const std::string& key : {method, std::string()}) {
    const auto found = answers_.find(key);
    if (found == answers_.end()) continue;
    FakeAnswer answer = found->second;
    if (answer.in_turn) {
      answer.replies.resize(1);
      if (found->second.replies.size() > 1) found->second.replies.erase(found->second.replies.begin());
    }
    return answer;
  }
  return {.error = "org.varlink.service.MethodNotFound", .error_parameters = {{"method", method}}};
}

bool FakeDaemon::reply(int socket, const std::string& message) {
  const json call = json::parse(message, nullptr, false);
  if (!call.is_object()) return false;
  const FakeAnswer answer = answerTo(call);
  for (std::size_t i = 0; i < answer.replies.size(); ++i) {
    json reply{{"parameters", answer.replies[i]}};
    const bool last = i + 1 == answer.replies.size();
    if (!last || answer.endless || !answer.error.empty()) reply["continues"] = true;
    if (!sendAll(socket, reply)) return false;
  }
  if (!answer.error.empty()) {
    return sendAll(socket, {{"error", answer.error}, {"parameters", answer.error_parameters}});
  }
  return !answer.hangs_up;
}

}  // namespace hapticd::test
