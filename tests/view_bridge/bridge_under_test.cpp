// SPDX-License-Identifier: Apache-2.0
#include "tests/view_bridge/bridge_under_test.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "tests/support/file_content.h"
#include "tests/support/program.h"

namespace hapticd::test {
namespace {

std::uint64_t bigEndian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

}  // namespace

RawClient::RawClient(int port, int receive_buffer)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const timeval limit{maxPatience().count(), 0};
  ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  ::setsockopt(socket_.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  if (receive_buffer > 0)
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("cannot connect to port " + std::to_string(port));
}

bool RawClient::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

std::string RawClient::receive(std::size_t most) {
  std::string bytes(most, '\0');
  const ssize_t count = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
  bytes.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return bytes;
}

std::string RawClient::receiveAll() {
  std::string all;
  for (std::string piece = receive(65536); !piece.empty(); piece = receive(65536)) all += piece;
  return all;
}

bool RawClient::isClosed() {
  const auto deadline = std::chrono::steady_clock::now() + maxPatience();
  while (!receive(65536).empty()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
  }
  return std::chrono::steady_clock::now() < deadline;
}

std::string upgradeRequest(int port, const std::string& target, const std::string& fields) {
  return "GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
         fields + "\r\n";
}

WebSocketPeer::WebSocketPeer(int port, const std::string& target, const std::string& fields,
                             int receive_buffer)
    : raw_(port, receive_buffer) {
  raw_.send(upgradeRequest(port, target, fields));
  std::size_t end = std::string::npos;
  while ((end = input_.find("\r\n\r\n")) == std::string::npos) {
    const std::string piece = raw_.receive(4096);
    if (piece.empty()) break;
    input_ += piece;
  }
  if (end == std::string::npos) return;
  answer_ = input_.substr(0, end + 4);
  input_.erase(0, end + 4);
}

void WebSocketPeer::sendFrame(unsigned char first, std::string_view payload) {
  std::string frame(1, static_cast<char>(first));
  constexpr char kMasked = static_cast<char>(0x80);
  if (payload.size() < 126) {
    frame += static_cast<char>(kMasked | static_cast<char>(payload.size()));
  } else {
    frame += static_cast<char>(kMasked | 126);
    frame += static_cast<char>(payload.size() >> 8U);
    frame += static_cast<char>(payload.size() & 0xffU);
  }
  frame += std::string(4, '\0');  // a mask of zeros leaves the payload as it is
  frame += payload;
  raw_.send(frame);
}

bool WebSocketPeer::fill(std::size_t bytes) {
  while (input_.size() < bytes) {
    const std::string piece = raw_.receive(1024 * 1024);
    if (piece.empty()) return false;
    input_ += piece;
  }
  return true;
}

std::optional<WebSocketMessage> WebSocketPeer::next() {
  for (;;) {
    if (!fill(2)) return std::nullopt;
    std::size_t length = static_cast<unsigned char>(input_[1]) & 0x7fU;
    const std::size_t wide = length == 126 ? 2 : length == 127 ? 8 : 0;
    if (!fill(2 + wide)) return std::nullopt;
    if (wide > 0) length = bigEndian(std::string_view(input_).substr(2, wide));
    if (!fill(2 + wide + length)) return std::nullopt;
    WebSocketMessage message{input_[0] & 0x0f, input_.substr(2 + wide, length)};
    input_.erase(0, 2 + wide + length);
    if (message.opcode != 9) return message;
    sendFrame(0x8a, message.payload);
  }
}

nlohmann::json WebSocketPeer::nextOf(const std::string& type, int most) {
  for (int i = 0; i < most; ++i) {
    const auto message = next();
    if (!message || message->opcode == 8) return {};
    if (message->opcode != 1) continue;
    nlohmann::json json = nlohmann::json::parse(message->payload);
    if (json.at("type") == type) return json;
  }
  return {};
}

std::string WebSocketPeer::nextBinary(int most) {
  for (int i = 0; i < most; ++i) {
    const auto message = next();
    if (!message || message->opcode == 8) return {};
    if (message->opcode == 2) return message->payload;
  }
  return {};
}

namespace {

std::vector<std::string> commandOf(const DaemonHome& home, const TemporaryFolder& folder,
                                   const std::vector<std::string>& options) {
  folder.write("index.html", "<!doctype html><title>the page</title>");
  folder.write("view.js", "let view;");
  std::vector<std::string> command{HAPTICD_VIEW_PROGRAM,
                                   "--socket",
                                   home.statusSocket(),
                                   "--listen",
                                   "127.0.0.1:0",
                                   "--page",
                                   folder.path().string(),
                                   "--token-file",
                                   (folder.path() / "token").string()};
  command.insert(command.end(), options.begin(), options.end());
  return command;
}

/// Of the line "hapticd-view listens at 127.0.0.1:PORT".
int portIn(const std::string& output) {
  const std::size_t begin = output.find("listens at 127.0.0.1:");
  const std::size_t end = output.find('\n', begin);
  if (begin == std::string::npos || end == std::string::npos) return 0;
  return std::stoi(output.substr(output.rfind(':', end) + 1));
}

}  // namespace

BridgeUnderTest::BridgeUnderTest(const DaemonHome& home, const std::vector<std::string>& options)
    : program_(commandOf(home, folder_, options)) {
  const bool listens =
      becomesTrue([&] { return !program_.running() || (port_ = portIn(program_.output())) != 0; });
  if (!listens || port_ == 0) {
    ADD_FAILURE() << "hapticd-view does not listen: " << program_.errors();
    return;
  }
  token_ = contentOf(folder_.path() / "token").substr(0, 32);
}

std::string BridgeUnderTest::goodFields() const {
  return "Host: 127.0.0.1:" + std::to_string(port_) + "\r\nCookie: hapticd-view=" + token_ + "\r\n";
}

std::size_t BridgeUnderTest::residentBytes() const {
  std::ifstream file("/proc/" + std::to_string(program_.pid()) + "/statm");
  std::size_t all = 0;
  std::size_t resident = 0;
  file >> all >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

bool BridgeUnderTest::logs(const std::string& text) {
  const bool logged = becomesTrue([&] { return program_.errors().find(text) != std::string::npos; });
  if (!logged) ADD_FAILURE() << "no \"" << text << "\" in: " << program_.errors();
  return logged;
}

std::string BridgeUnderTest::answerTo(const std::string& request) const {
  RawClient client(port_);
  client.send(request);
  return client.receiveAll();
}

}  // namespace hapticd::test
