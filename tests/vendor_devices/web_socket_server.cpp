// SPDX-License-Identifier: Apache-2.0
#include "tests/vendor_devices/web_socket_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <nettle/base64.h>
#include <nettle/sha1.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>

namespace hapticd::test {
namespace {

/// The value of a field of a request, whose name is found whatever its case.
std::string fieldOf(const std::string& head, std::string name) {
  const auto lower = [](std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
  };
  const std::size_t at = lower(head).find("\r\n" + lower(std::move(name)) + ":");
  if (at == std::string::npos) return {};
  const std::size_t begin = head.find_first_not_of(' ', head.find(':', at) + 1);
  return head.substr(begin, head.find("\r\n", begin) - begin);
}

std::string acceptKeyFor(const std::string& key) {
  const std::string text = key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
  sha1_ctx context{};
  sha1_init(&context);
  sha1_update(&context, text.size(), reinterpret_cast<const std::uint8_t*>(text.data()));
  std::array<std::uint8_t, SHA1_DIGEST_SIZE> digest{};
  sha1_digest(&context, digest.size(), digest.data());
  std::string encoded(BASE64_ENCODE_RAW_LENGTH(SHA1_DIGEST_SIZE), '\0');
  base64_encode_raw(encoded.data(), digest.size(), digest.data());
  return encoded;
}

std::uint64_t bigEndian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

}  // namespace

base::Descriptor listenAt(int port) {
  base::Descriptor listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int yes = 1;
  ::setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool listens =
      ::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      ::listen(listener.get(), 8) == 0;
  return listens ? std::move(listener) : base::Descriptor();
}

int portOf(const base::Descriptor& listener) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getsockname(listener.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

void ServerConnection::fill() {
  std::array<char, 65536> buffer;
  while (isOpen()) {
    const ssize_t count = ::recv(socket_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (count <= 0) return drop();
    input_.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

std::optional<std::string> ServerConnection::nextRequest() {
  const std::size_t end = input_.find("\r\n\r\n");
  if (web_socket_ || end == std::string::npos) return std::nullopt;
  const std::string head = input_.substr(0, end + 2);
  input_.erase(0, end + 4);
  const std::string key = fieldOf(head, "Sec-WebSocket-Key");
  if (key.empty()) {
    const std::size_t target = head.find(' ') + 1;
    return head.substr(target, head.find(' ', target) - target);
  }
  write(
      "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: "
      "Upgrade\r\nSec-WebSocket-Accept: " +
      acceptKeyFor(key) + "\r\n\r\n");
  web_socket_ = true;
  return std::nullopt;
}

std::optional<ClientMessage> ServerConnection::nextMessage() {
  if (!web_socket_ || input_.size() < 2) return std::nullopt;
  std::size_t length = static_cast<unsigned char>(input_[1]) & 0x7fU;
  const std::size_t wide = length == 126 ? 2 : length == 127 ? 8 : 0;
  if (input_.size() < 2 + wide + 4) return std::nullopt;
  if (wide > 0) length = bigEndian(std::string_view(input_).substr(2, wide));
  const std::size_t begin = 2 + wide + 4;
  if (input_.size() < begin + length) return std::nullopt;
  ClientMessage message{input_[0] & 0x0f, input_.substr(begin, length)};
  for (std::size_t i = 0; i < length; ++i) message.payload[i] ^= input_[2 + wide + i % 4];
  input_.erase(0, begin + length);
  return message;
}

void ServerConnection::answer(int status, const std::string& body) {
  write("HTTP/1.1 " + std::to_string(status) +
        " Answer\r\nContent-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
        "\r\nConnection: close\r\n\r\n" + body);
  drop();
}

void ServerConnection::send(std::string_view payload, int opcode) {
  std::string frame(1, static_cast<char>(0x80 | opcode));
  if (payload.size() < 126) {
    frame += static_cast<char>(payload.size());
  } else {
    frame += static_cast<char>(126);
    frame += static_cast<char>(payload.size() >> 8U);
    frame += static_cast<char>(payload.size() & 0xffU);
  }
  write(frame.append(payload));
}

/// A client that does not read what fits into the buffers of the kernel is dropped.
void ServerConnection::write(std::string_view bytes) {
  if (!isOpen()) return;
  const ssize_t count = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (count != static_cast<ssize_t>(bytes.size())) drop();
}

}  // namespace hapticd::test
