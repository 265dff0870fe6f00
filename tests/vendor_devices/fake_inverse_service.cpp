// SPDX-License-Identifier: Apache-2.0
#include "tests/vendor_devices/fake_inverse_service.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <nettle/base64.h>
#include <nettle/sha1.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "rt/base/clock.h"

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

namespace {

using nlohmann::json;

constexpr std::int64_t kStepNs = 250'000;
constexpr int kEventPortStep = 19;

json jsonOf(const rt::Vec3& vector) {
  return {{"x", vector.x}, {"y", vector.y}, {"z", vector.z}};
}

json jsonOf(const rt::Quaternion& rotation) {
  return {{"w", rotation.w}, {"x", rotation.x}, {"y", rotation.y}, {"z", rotation.z}};
}

/// Both ports that belong together.
std::pair<base::Descriptor, base::Descriptor> listenAtBoth() {
  constexpr int kTries = 100;
  for (int i = 0; i < kTries; ++i) {
    base::Descriptor first = listenAt(0);
    const int second_port = portOf(first) + kEventPortStep;
    if (second_port > 65535) continue;
    if (base::Descriptor second = listenAt(second_port)) return {std::move(first), std::move(second)};
  }
  throw std::runtime_error("no two free ports");
}

json restingDevice(bool full) {
  json device{{"device_id", FakeInverseService::kOtherDevice},
              {"state",
               {{"cursor_position", jsonOf(rt::Vec3{0.1, 0.1, 0.1})},
                {"cursor_velocity", jsonOf(rt::Vec3{})},
                {"current_cursor_force", jsonOf(rt::Vec3{})}}}};
  if (full) device["config"] = {{"type", "inverse3"}};
  return device;
}

}  // namespace

FakeInverseService::FakeInverseService(const InverseServiceSettings& settings)
    : settings_(settings),
      version_(settings.version),
      answer_delay_ns_(settings.answer_delay_ns),
      hand_(settings.hand, static_cast<double>(kStepNs) * 1e-9) {
  std::tie(listener_, event_listener_) = listenAtBoth();
  port_ = portOf(listener_);
  if (!settings_.event_channel) event_listener_.close();
  moved_to_ns_ = rt::monotonicNow_ns();
  thread_ = std::thread([this] { run(); });
}

FakeInverseService::~FakeInverseService() {
  ends_ = true;
  thread_.join();
}

void FakeInverseService::setFaults(std::uint32_t faults) {
  const std::lock_guard lock(mutex_);
  if ((faults & kGripAsleep) != 0) asleep_since_m_ = hand_.position_m_in_world();
  faults_ = faults;
}

void FakeInverseService::setAnswerDelay(std::int64_t delay_ns) {
  const std::lock_guard lock(mutex_);
  answer_delay_ns_ = delay_ns;
}

void FakeInverseService::setVersion(const std::string& version) {
  const std::lock_guard lock(mutex_);
  version_ = version;
}

void FakeInverseService::dropConnections() {
  const std::lock_guard lock(mutex_);
  for (Simulation& client : clients_) client.connection.drop();
  for (ServerConnection& listener : listeners_) listener.drop();
}

void FakeInverseService::sendEvent(const std::string& name, const std::string& level, const std::string& data,
                                   const std::string& device) {
  const std::lock_guard lock(mutex_);
  const std::string text = R"({"name":")" + name + R"(","category":"device","level":")" + level +
                           R"(","data":{"device_family":"inverse","device_id":")" + device + '"' + data +
                           R"(},"message":"as the fake says"})";
  for (ServerConnection& listener : listeners_) listener.send(text);
}

std::size_t FakeInverseService::eventListeners() {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::ranges::count_if(listeners_, [](const ServerConnection& one) { return one.isWebSocket(); }));
}

InverseServiceRecord FakeInverseService::record() {
  const std::lock_guard lock(mutex_);
  return record_;
}

void FakeInverseService::run() {
  while (!ends_) {
    std::vector<pollfd> watched{{listener_.get(), POLLIN, 0}, {event_listener_.get(), POLLIN, 0}};
    for (const Simulation& client : clients_) watched.push_back({client.connection.descriptor(), POLLIN, 0});
    for (const ServerConnection& one : listeners_) watched.push_back({one.descriptor(), POLLIN, 0});
    const timespec step{0, kStepNs};
    ::ppoll(watched.data(), watched.size(), &step, nullptr);
    const std::lock_guard lock(mutex_);
    accept();
    const std::int64_t now_ns = rt::monotonicNow_ns();
    for (Simulation& client : clients_) serve(client, now_ns);
    for (ServerConnection& listener : listeners_) {
      listener.fill();
      listener.nextRequest();
      while (listener.nextMessage()) {
      }
    }
    moveArm(now_ns);
    for (const Simulation& client : clients_) noteEnd(client);
    std::erase_if(clients_, [](const Simulation& client) { return !client.connection.isOpen(); });
    std::erase_if(listeners_, [](const ServerConnection& one) { return !one.isOpen(); });
    record_.open_connections = static_cast<std::size_t>(
        std::ranges::count_if(clients_, [](const Simulation& one) { return one.connection.isWebSocket(); }));
  }
}

void FakeInverseService::accept() {
  const auto next = [](const base::Descriptor& listener) {
    return base::Descriptor(::accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  };
  const bool refuses = (faults_ & kRefuses) != 0;
  while (base::Descriptor socket = next(listener_)) {
    if (!refuses) clients_.emplace_back(ServerConnection(std::move(socket)));
  }
  if (!event_listener_) return;
  while (base::Descriptor socket = next(event_listener_)) {
    if (!refuses) listeners_.emplace_back(std::move(socket));
  }
}

void FakeInverseService::serve(Simulation& client, std::int64_t now_ns) {
  ServerConnection& connection = client.connection;
  connection.fill();
  if (const auto target = connection.nextRequest()) {
    const bool known = *target == "/version" && !version_.empty();
    return connection.answer(known ? 200 : 404, known ? versionPage() : R"({"ok":false,"error":"unknown"})");
  }
  if (!connection.isWebSocket()) return;
  if (!std::exchange(client.greeted, true)) {
    ++record_.connections;
    record_.frames_before_force = 0;
    record_.connected_ns = now_ns;
    connection.send(stateText(true));
  }
  while (const auto message = connection.nextMessage()) {
    if (message->opcode == 8) {
      client.closed = true;
      connection.send(message->payload, 8);
      return connection.drop();
    }
    if (message->opcode != 1) continue;
    take(client, message->payload, now_ns);
    if ((faults_ & kSilent) == 0) client.due_ns.push_back(now_ns + answer_delay_ns_);
    record_.most_outstanding = std::max(record_.most_outstanding, client.due_ns.size());
  }
  while (!client.due_ns.empty() && client.due_ns.front() <= now_ns) {
    client.due_ns.pop_front();
    moveArm(now_ns);
    connection.send(stateText(false));
    if ((faults_ & kUnasked) != 0) connection.send(stateText(false));
  }
}

void FakeInverseService::take(Simulation& client, const std::string& text, std::int64_t now_ns) {
  ++record_.frames;
  record_.last_frame_ns = now_ns;
  const json frame = json::parse(text);
  for (const json& device : frame.at("inverse3")) {
    if (device.at("device_id") != kDevice) continue;
    const json& commands = device.at("commands");
    if (commands.contains("clear")) {
      target_n_ = {};
      client.cleared = true;
    }
    if (!commands.contains("set_cursor_force")) continue;
    client.cleared = false;
    for (const auto& [key, value] : commands.at("set_cursor_force").items()) {
      const rt::Vec3 force_n{value.at("x"), value.at("y"), value.at("z")};
      client.last_zero = norm(force_n) == 0;
      if (client.last_zero && norm(record_.commanded_n) == 0) ++record_.frames_before_force;
      const bool understood = settings_.key.empty() || key == settings_.key;
      if (!understood || (faults_ & kIgnoresForces) != 0) continue;
      target_n_ = force_n;
      if (!client.last_zero) record_.commanded_n = force_n;
    }
  }
}

void FakeInverseService::noteEnd(const Simulation& client) {
  if (client.connection.isOpen() || !client.greeted) return;
  record_.zero_before_end = client.last_zero;
  record_.clear_before_end = client.cleared;
  record_.closed_in_order = client.closed;
}

void FakeInverseService::moveArm(std::int64_t now_ns) {
  // a test on a loaded machine: the hand does not wait for it, but makes no leaps either
  constexpr std::int64_t kMostBehindNs = 50'000'000;
  moved_to_ns_ = std::max(moved_to_ns_, now_ns - kMostBehindNs);
  while (now_ns - moved_to_ns_ >= kStepNs) {
    moved_to_ns_ += kStepNs;
    const bool idle = moved_to_ns_ - record_.last_frame_ns > settings_.idle_ns;
    constexpr std::uint64_t kStepsPerFilter = 4;
    rt::Vec3 wanted_n = idle || (faults_ & kUnplugged) != 0 ? rt::Vec3{} : settings_.force_scale * target_n_;
    if ((faults_ & kPushes) != 0) wanted_n = {0.5, 0, 0};
    if (++steps_ % kStepsPerFilter == 0)
      record_.exerted_n = record_.exerted_n + settings_.force_gate_gain * (wanted_n - record_.exerted_n);
    constexpr double kNothingN = 1e-6;  // a filter's tail
    if (norm(record_.exerted_n) < kNothingN) record_.exerted_n = {};
    const double exerted_n = norm(record_.exerted_n);
    record_.most_exerted_n = std::max(record_.most_exerted_n, exerted_n);
    if (exerted_n > 0) record_.last_exerted_ns = moved_to_ns_;
    hand_.step(record_.exerted_n);
  }
}

std::string FakeInverseService::versionPage() const {
  const json page{{"project_name", "haply-inverse-service"}, {"project_version", version_}};
  return (settings_.envelope ? json{{"ok", true}, {"data", page}} : page).dump();
}

json FakeInverseService::deviceJson(bool full) const {
  const rt::Vec3 jump{(faults_ & kJump) != 0 ? 0.3 : 0, 0, 0};
  const rt::Vec3 place = settings_.fixed_m.value_or(hand_.position_m_in_world()) + jump;
  const rt::Vec3 velocity = settings_.fixed_m ? rt::Vec3{0.1, 0.2, -0.3} : hand_.velocity_m_per_s_in_world();
  const rt::Vec3 echo = (faults_ & kNoEcho) != 0 ? rt::Vec3{} : record_.exerted_n;
  json device{{"device_id", kDevice},
              {"state",
               {{"cursor_position", jsonOf(place)},
                {"cursor_velocity", jsonOf(velocity)},
                {"current_cursor_force", jsonOf(echo)},
                {"control_mode", "idle"}}},
              {"status",
               {{"calibrated", (faults_ & kNotCalibrated) == 0},
                {"power_supply", (faults_ & kNoPower) == 0},
                {"ready", true}}}};
  if ((faults_ & kMissing) != 0) device["state"].erase("cursor_position");
  if ((faults_ & kWrongTypes) != 0) device["state"]["cursor_position"] = "here";
  if (!full) return device;
  device["config"] = {
      {"type", settings_.type},
      {"handedness", "right"},
      {"preset", "defaults"},
      {"basis", {{"permutation", "XYZ"}}},
      {"gravity_compensation", {{"enabled", true}, {"scaling_factor", 1.0}}},
      {"filters", {{"force_gate", {{"gain", settings_.force_gate_gain}}}, {"damping", {{"scalar", 0.0}}}}}};
  const double scale = settings_.workspace_scale;
  device["state"]["transform"] = {{"scale", jsonOf(rt::Vec3{scale, scale, scale})}};
  return device;
}

json FakeInverseService::gripJson() const {
  // 16-bit components, 50 times a second
  constexpr std::uint64_t kStepsPerGrip = 80;
  const double turned = (faults_ & kGripAsleep) != 0
                            ? asleep_since_m_.z
                            : 0.1 + 0.001 * static_cast<double>(steps_ / kStepsPerGrip % 100);
  const rt::Quaternion held = rt::normalised({turned, 0, 0, 1});
  json state{{"orientation", jsonOf(held)}};
  if (settings_.grip == "verse_grip") {
    state["button"] = true;
    state["hall"] = 1;
  } else {
    state["buttons"] = {{"a", true}, {"b", false}, {"c", true}};
  }
  return {{"device_id", "61576"}, {"state", state}};
}

std::string FakeInverseService::stateText(bool full) {
  ++answers_;
  if ((faults_ & kGarbage) != 0) return R"({"inverse3":[{"device_id":)";
  json message{{"inverse3", json::array()}};
  if ((faults_ & kUnplugged) == 0) message["inverse3"].push_back(deviceJson(full));
  message["inverse3"].push_back(restingDevice(full));
  if (!settings_.grip.empty()) message[settings_.grip] = json::array({gripJson()});
  if (full) message["session_id"] = 7;
  if ((faults_ & kNotFinite) == 0 || full) return message.dump();
  // JSON has no word for these, but a service may write them all the same
  const char* const bad = answers_ % 3 == 0 ? "NaN" : answers_ % 3 == 1 ? "1e999" : "null";
  return R"({"inverse3":[{"device_id":"049D","state":{"cursor_position":{"x":)" + std::string(bad) +
         R"(,"y":0,"z":0},"current_cursor_force":{"x":0,"y":0,"z":0}}}]})";
}

}  // namespace hapticd::test
