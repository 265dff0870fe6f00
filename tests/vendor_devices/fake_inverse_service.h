// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <list>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "config/base/descriptor.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "rt/base/vec3.h"

namespace hapticd::test {

/// A message of a WebSocket client.
struct ClientMessage {
  int opcode = 0;  ///< 1 text, 8 close
  std::string payload;
};

/// One HTTP connection to a server, which may become a WebSocket (RFC 6455); shares no code with the client.
/// It does not block. Thread: one.
class ServerConnection {
 public:
  explicit ServerConnection(base::Descriptor socket) : socket_(std::move(socket)) {}

  int descriptor() const { return socket_.get(); }
  bool isOpen() const { return static_cast<bool>(socket_); }
  bool isWebSocket() const { return web_socket_; }
  void drop() { socket_.close(); }

  /// Takes what has arrived; drops the connection where the other side has.
  void fill();
  /// The target of a plain GET that has arrived. A request for a WebSocket is answered.
  std::optional<std::string> nextRequest();
  std::optional<ClientMessage> nextMessage();
  /// Answers a plain request, and closes.
  void answer(int status, const std::string& body);
  /// Sends a text message, or with opcode 8 a close.
  void send(std::string_view payload, int opcode = 1);

 private:
  void write(std::string_view bytes);

  base::Descriptor socket_;
  bool web_socket_ = false;
  std::string input_;
};

/// A port of 127.0.0.1 that is listened at.
base::Descriptor listenAt(int port);
int portOf(const base::Descriptor& listener);

/// What can be wrong with a fake service; bits.
enum InverseFault : std::uint32_t {
  kRefuses = 1,        ///< connections are closed at once
  kSilent = 2,         ///< frames are not answered
  kIgnoresForces = 4,  ///< as one that does not know the key
  kNoEcho = 8,         ///< forces are exerted, but current_cursor_force stays zero
  kPushes = 16,        ///< exerts 0.5 N along x whatever is commanded
  kUnplugged = 32,     ///< the device is not there
  kNotFinite = 64,     ///< positions are NaN, or beyond all numbers
  kMissing = 128,      ///< the state has no position
  kWrongTypes = 256,   ///< the position is a text
  kGarbage = 512,      ///< answers are no JSON
  kJump = 1024,        ///< positions are 0.3 m off
  kNotCalibrated = 2048,
  kNoPower = 4096,
  kUnasked = 8192,      ///< each frame is answered twice
  kGripAsleep = 16384,  ///< the grip's orientation and buttons stay what they are
};

/// How a fake service is.
struct InverseServiceSettings {
  std::string version = "3.5.0.0";  ///< of GET /version; empty: there is no such page
  bool envelope = false;            ///< GET /version answers {"ok", "data"}
  std::string key = "vector";       ///< the only one in which forces are understood; empty: both
  double force_gate_gain = 1;       ///< first-order filter per millisecond; 1: none
  double force_scale = 1;
  double workspace_scale = 1;
  std::int64_t idle_ns = 50'000'000;  ///< a force is dropped when no frame has come for so long
  std::int64_t answer_delay_ns = 0;   ///< from a frame to its answer
  bool event_channel = true;
  std::string grip = "wireless_verse_grip";  ///< name of the list that holds it; empty: none
  std::string type = "inverse3";
  std::optional<rt::Vec3> fixed_m = {};  ///< the device stands there and moves with (0.1, 0.2, -0.3) m/s
  drivers::SimulatedHandleSettings hand = {
      .start_m_in_world = {0, -0.12, 0.15}, .direction_in_world = {0, 0, -1}, .travel_m = 0.03};
};

/// What a fake service has seen and done.
struct InverseServiceRecord {
  rt::Vec3 exerted_n;  ///< now
  double most_exerted_n = 0;
  std::int64_t last_exerted_ns = 0;  ///< when it exerted something last
  std::int64_t last_frame_ns = 0;
  rt::Vec3 commanded_n;  ///< by the last frame with a force that it understood
  std::uint64_t frames = 0;
  std::uint64_t frames_before_force = 0;  ///< of the newest simulation connection
  std::int64_t connected_ns = 0;          ///< when it came
  std::size_t most_outstanding = 0;       ///< frames without an answer
  std::uint64_t connections = 0;          ///< simulation channels so far
  std::size_t open_connections = 0;       ///< simulation channels now
  bool zero_before_end = false;           ///< the last force of the last connection that ended was zero
  bool clear_before_end = false;          ///< and a clear came after it
  bool closed_in_order = false;           ///< and a close frame
};

/// The Inverse Service as far as public documents describe it, with two devices: 049D in a simulated hand,
/// and 04BA at rest at (0.1, 0.1, 0.1). It has a thread of its own. Thread: any.
class FakeInverseService {
 public:
  static constexpr const char* kDevice = "049D";
  static constexpr const char* kOtherDevice = "04BA";

  explicit FakeInverseService(const InverseServiceSettings& settings = {});
  ~FakeInverseService();
  FakeInverseService(const FakeInverseService&) = delete;
  FakeInverseService& operator=(const FakeInverseService&) = delete;

  /// Of the simulation channel; that of the events is 19 higher.
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  void setFaults(std::uint32_t faults);
  void setAnswerDelay(std::int64_t delay_ns);
  void setVersion(const std::string& version);
  /// Ends all connections without a close frame.
  void dropConnections();
  /// Sends an event of device 049D to all who listen. `data`: further members, each with a comma before it.
  void sendEvent(const std::string& name, const std::string& level, const std::string& data = "",
                 const std::string& device = kDevice);
  std::size_t eventListeners();
  InverseServiceRecord record();

 private:
  struct Simulation {
    explicit Simulation(ServerConnection from) : connection(std::move(from)) {}

    ServerConnection connection;
    bool greeted = false;
    std::deque<std::int64_t> due_ns;  // of answers
    bool last_zero = true;
    bool cleared = false;
    bool closed = false;
  };

  void run();
  void accept();
  void serve(Simulation& client, std::int64_t now_ns);
  void take(Simulation& client, const std::string& text, std::int64_t now_ns);
  void noteEnd(const Simulation& client);
  void moveArm(std::int64_t now_ns);
  std::string versionPage() const;
  std::string stateText(bool full);
  nlohmann::json deviceJson(bool full) const;
  nlohmann::json gripJson() const;

  const InverseServiceSettings settings_;
  base::Descriptor listener_;
  base::Descriptor event_listener_;
  int port_ = 0;
  std::mutex mutex_;  // of everything below
  std::string version_;
  std::uint32_t faults_ = 0;
  std::int64_t answer_delay_ns_;
  drivers::SimulatedHand hand_;
  rt::Vec3 asleep_since_m_;
  std::int64_t moved_to_ns_ = 0;
  std::uint64_t steps_ = 0;
  std::uint64_t answers_ = 0;
  rt::Vec3 target_n_;  // of the newest frame
  InverseServiceRecord record_;
  std::list<Simulation> clients_;
  std::list<ServerConnection> listeners_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace hapticd::test
