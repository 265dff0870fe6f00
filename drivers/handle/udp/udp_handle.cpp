// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/udp/udp_handle.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/base/descriptor.h"
#include "drivers/handle/command_gate.h"
#include "drivers/handle/handle_frame.h"
#include "drivers/handle/udp/conversation.h"
#include "drivers/handle/udp/packet.h"
#include "drivers/handle/udp/udp_socket.h"
#include "rt/base/clock.h"

namespace hapticd::drivers::udp {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kLostNs = 100 * kMs;
constexpr std::int64_t kCommandIntervalNs = 5 * kMs;  // while no state requests one
// Limits replies to unproven packets, so that they cannot multiply traffic.
constexpr std::int64_t kAnswerIntervalNs = 5 * kMs;
constexpr std::int64_t kReportIntervalNs = 100 * kMs;
constexpr std::chrono::milliseconds kRetryPeriod{1000};
constexpr std::int64_t kRefusalConcernsNs = 10'000 * kMs;
constexpr int kMaxPacketsAtOnce = 64;  // then commands and stop requests get their turn
constexpr std::size_t kReceiveBytes = 256;
constexpr int kGoodbyes = 5;

/// Waits until `stop_event` or `other` (-1: none) is readable or the time has passed; returns true for
/// stop_event.
bool stopsWithin(std::int64_t wait_ns, int stop_event, int other) {
  std::array<pollfd, 2> files{{{stop_event, POLLIN, 0}, {other, POLLIN, 0}}};
  const std::int64_t bounded_ns = std::max<std::int64_t>(wait_ns, 0);
  const timespec timeout{bounded_ns / rt::kNsPerSecond, bounded_ns % rt::kNsPerSecond};
  return ::ppoll(files.data(), files.size(), &timeout, nullptr) > 0 && files[0].revents != 0;
}

bool comesFrom(const Ipv4Endpoint& from, const Ipv4Endpoint& peer) {
  return from.address == peer.address && (peer.port == 0 || from.port == peer.port);
}

/// Settings of a UdpWorker.
struct WorkerSettings {
  Ipv4Endpoint local;
  Ipv4Endpoint peer;           ///< without a port: any port of that address
  std::vector<std::byte> key;  ///< empty: packets are not authenticated
};

base::Error at(const char* parameter, base::Error error) {
  error.where = parameter;
  return error;
}

base::Result<WorkerSettings> workerSettingsFrom(const config::HandleSettings& settings) {
  WorkerSettings worker;
  const auto local = ipv4EndpointFrom(settings.of<UdpHandleSettings>().address);
  if (!local) return std::unexpected(at("udp_handle.address", local.error()));
  worker.local = {local->address, static_cast<std::uint16_t>(settings.of<UdpHandleSettings>().port)};
  const auto peer = ipv4EndpointFrom(settings.of<UdpHandleSettings>().peer);
  if (!peer) return std::unexpected(at("udp_handle.peer", peer.error()));
  worker.peer = *peer;
  auto key = keyFrom(settings.of<UdpHandleSettings>().key_file);
  if (!key) return std::unexpected(key.error());
  worker.key = std::move(*key);
  return worker;
}

/// Processes states, replies to each with the newest command, and determines whether the peer is present.
class UdpWorker final : public HandleWorker {
 public:
  /// `stop_event`: an eventfd, readable once the thread is to end; this closes it.
  UdpWorker(const WorkerSettings& settings, const std::string& identity, const HandleFrame& frame,
            base::Descriptor stop_event, HandleChannels* channels)
      : HandleWorker(identity, "", kRetryPeriod),
        settings_(settings),
        frame_(frame),
        stop_event_(std::move(stop_event)),
        channels_(channels) {}

  /// Binds the socket; packets that arrive from then on are queued until run(). Returns true if it is bound.
  bool openSocket() {
    auto opened = UdpSocket::boundTo(settings_.local);
    if (opened) socket_ = std::move(*opened);
    bind_failure_ = opened ? std::string() : opened.error().text();
    report(rt::monotonicNow_ns());
    return socket_.isOpen();
  }

  void requestStop() override {
    HandleWorker::requestStop();
    ::eventfd_write(stop_event_.get(), 1);
  }

  HandleStatus status() const override {
    HandleStatus status = HandleWorker::status();
    status.last_hop = gate_.lastHop();
    return status;
  }

 private:
  struct Arrived {
    StatePacket packet;
    std::int64_t time_ns = 0;
  };

  std::int64_t nextDueNs() const {
    const std::int64_t report_ns = reported_ns_ + kReportIntervalNs;
    return isAlive(rt::monotonicNow_ns()) ? std::min(report_ns, command_sent_ns_ + kCommandIntervalNs)
                                          : report_ns;
  }

  /// Of queued states only the newest is a current measurement; all are checked and counted.
  void receiveAll() {
    std::array<std::byte, kReceiveBytes> buffer;
    for (int i = 0; i < kMaxPacketsAtOnce; ++i) {
      const auto datagram = socket_.receive(buffer);
      if (!datagram) break;
      take(*datagram, rt::monotonicNow_ns());
    }
    if (newest_) publishNewest();
  }

  void take(const UdpSocket::Datagram& datagram, std::int64_t now_ns) {
    const auto& [bytes, from] = datagram;
    if (!comesFrom(from, settings_.peer)) {
      conversation_.countRejected();
      return noteRefusal(fmt::format("from {}, which is not udp_handle.peer", textOf(from)), now_ns);
    }
    const auto packet = decodeState(bytes, settings_.key);
    if (!packet) {
      conversation_.countRejected();
      return noteRefusal(std::string(textOf(packet.error())), now_ns);
    }
    switch (conversation_.hear(packet->header, now_ns)) {
      case Conversation::Verdict::fresh:
        return takeOver(*packet, from, now_ns);
      case Conversation::Verdict::unproven:
        noteRefusal("replayed or delayed, or our packets do not reach the peer within 100 ms", now_ns);
        return answerUnproven(packet->header, from, now_ns);
      case Conversation::Verdict::greeting:
        return answerUnproven(packet->header, from, now_ns);
      case Conversation::Verdict::duplicated:
      case Conversation::Verdict::reordered:
        return;
    }
  }

  void takeOver(const StatePacket& packet, const Ipv4Endpoint& from, std::int64_t now_ns) {
    constexpr std::int64_t kSmoothing = 16;  // number of states
    const bool is_new = conversation_.peerSession() != session_of_frame_ || presence_ == HandlePresence::lost;
    if (is_new && !session_began_ && !packet.fault) beginSession();
    if (isAlive(now_ns)) state_interval_ns_ += (now_ns - fresh_ns_ - state_interval_ns_) / kSmoothing;
    fresh_ns_ = now_ns;
    from_ = from;
    delay_.add(conversation_.loopNs());
    newest_ = {packet, peer_clock_.ourTimeNs(packet.header.time_ns, now_ns)};
  }

  void noteRefusal(std::string why, std::int64_t now_ns) {
    refusal_ = std::move(why);
    refused_ns_ = now_ns;
  }

  /// Lets the sender prove that it is active: its next packet echoes this one.
  void answerUnproven(const Header& heard, const Ipv4Endpoint& from, std::int64_t now_ns) {
    if (now_ns - answered_ns_ < kAnswerIntervalNs) return;
    answered_ns_ = now_ns;
    send({conversation_.answerTo(heard, now_ns), {}, false}, from);
  }

  void publishNewest() {
    const auto [packet, time_ns] = *std::exchange(newest_, std::nullopt);
    if (packet.fault) {
      become(HandlePresence::lost, fresh_ns_);
      return sendCommand(fresh_ns_);
    }
    HandleMeasurement measurement;
    measurement.position_m_in_handle = packet.position_m_in_handle;
    measurement.time_ns = time_ns;
    measurement.buttons = packet.buttons;
    measurement.calibrated = packet.calibrated;
    if (packet.velocity_valid) measurement.velocity_m_per_s_in_handle = packet.velocity_m_per_s_in_handle;
    // The force computed from a state is sent with the reply to the following one.
    measurement.delay_s = static_cast<double>(delay_.ninetyFifthPercentileNs() + state_interval_ns_ +
                                              packet.device_latency_ns) *
                          1e-9;
    measurement.command_latency_ns = gate_.latency_ns();
    measurement.damps = packet.damps;
    measurement.orientation_in_handle = packet.orientation_in_handle;
    measurement.gripper_rad = packet.gripper_rad;
    measurement.over_link = true;
    channels_->state.write(frame_.stateOf(measurement));
    ++measurements_;
    session_began_ = false;
    become(packet.calibrated ? HandlePresence::present : HandlePresence::calibrating, fresh_ns_);
    sendCommand(fresh_ns_);
  }

  void beginSession() {
    frame_.beginSession();
    peer_clock_.reset();
    delay_.reset();
    session_began_ = true;
    session_of_frame_ = conversation_.peerSession();
    refusal_.clear();  // it belongs to the time before the session
  }

  bool isAlive(std::int64_t now_ns) const {
    return conversation_.peerSession() != 0 && now_ns - fresh_ns_ <= kLostNs;
  }

  void sendCommand(std::int64_t now_ns) {
    channels_->command.refresh();
    const rt::HandleCommand& command = channels_->command.front();
    const auto force_n_in_world = gate_.pass(command, frame_.session(), now_ns);
    CommandPacket packet{conversation_.next(now_ns),
                         {},
                         force_n_in_world && presence_ == HandlePresence::present,
                         command.tick,
                         command.tick_ns,
                         true};
    if (packet.active) {
      packet.force_n_in_handle = frame_.forceInHandle(*force_n_in_world);
      packet.torque_n_m_in_handle = frame_.forceInHandle(command.torque_n_m_in_world);
      packet.gripper_force_n = command.gripper_force_n;
      packet.contact_damping_n_s_per_m =
          std::clamp(command.contact_damping_n_s_per_m, 0.0, kMaxDampingNSPerM);
    }
    command_sent_ns_ = now_ns;
    send(packet, from_);
    gate_.sent(rt::monotonicNow_ns());
  }

  void send(const CommandPacket& packet, const Ipv4Endpoint& to) {
    const PacketBytes bytes = encode(packet, settings_.key);
    send_failure_ = socket_.send(bytes.bytes(), to);
  }

  /// Sends several packets, because each may be lost, at intervals, because losses come in bursts.
  void sendGoodbye() {
    if (conversation_.peerSession() == 0) return;
    for (int i = 0; i < kGoodbyes; ++i) {
      const std::int64_t now_ns = rt::monotonicNow_ns();
      send({conversation_.next(now_ns), {}, false}, from_);
      timespec pause{0, kMs};
      ::nanosleep(&pause, nullptr);
    }
  }

  void become(HandlePresence presence, std::int64_t now_ns) {
    if (std::exchange(presence_, presence) != presence) report(now_ns);
  }

  void report(std::int64_t now_ns) {
    reported_ns_ = now_ns;
    if (now_ns - refused_ns_ > kRefusalConcernsNs) refusal_.clear();
    board_.update([this](HandleStatus& status) {
      status.state = presence_;
      status.detail = detail();
      status.advice = advice();
      status.measurements = measurements_;
      status.link = conversation_.link();
      status.rejected = status.link->rejected;
    });
  }

  std::string detail() const {
    if (!bind_failure_.empty()) return bind_failure_;
    const std::string peer = textOf(settings_.peer);
    std::string text;
    switch (presence_) {
      case HandlePresence::present:
        return text;
      case HandlePresence::calibrating:
        return fmt::format(
            "the device of {} does not know its position yet (calibrate it as the bridge requests)", peer);
      case HandlePresence::lost:
        text =
            isAlive(reported_ns_)
                ? fmt::format("the device of {} reports a fault (check it and the bridge)", peer)
                : fmt::format(
                      "no valid packet from {} for 100 ms (is the bridge running? is the network up?)", peer);
        break;
      case HandlePresence::absent:
        text = fmt::format(
            "no valid packet from {} yet (is the bridge running there and sending to {}? do the firewalls "
            "and "
            "IPAddressAllow= of the unit let packets pass?)",
            peer, textOf(settings_.local));
        break;
    }
    const std::string hint = advice();
    return hint.empty() ? text : text + "; " + hint;
  }

  std::string advice() const {
    if (send_failure_ != 0) {
      return fmt::format(
          "cannot send to the peer: {} (does IPAddressAllow= of the unit include it? is there a route?)",
          std::strerror(send_failure_));
    }
    return refusal_.empty() ? std::string()
                            : fmt::format("packets are rejected, most recently: {}", refusal_);
  }

  /// Exchanges packets until a stop is requested, then commands the peer to exert no force.
  base::Result<void> useDevice() override {
    if (!socket_.isOpen() && !openSocket()) return {};  // the status says why
    while (!stopsWithin(nextDueNs() - rt::monotonicNow_ns(), stop_event_.get(), socket_.descriptor())) {
      const std::int64_t rest_ns = budget_.restNs(rt::threadCpu_ns(), rt::monotonicNow_ns());
      if (rest_ns > 0 && stopsWithin(rest_ns, stop_event_.get(), -1)) break;
      receiveAll();
      const std::int64_t now_ns = rt::monotonicNow_ns();
      if (!isAlive(now_ns) && presence_ != HandlePresence::absent) become(HandlePresence::lost, now_ns);
      if (isAlive(now_ns) && now_ns - command_sent_ns_ >= kCommandIntervalNs) sendCommand(now_ns);
      if (now_ns - reported_ns_ >= kReportIntervalNs) report(now_ns);
    }
    sendGoodbye();
    socket_ = {};
    report(rt::monotonicNow_ns());
    return {};
  }

  const WorkerSettings settings_;
  HandleFrame frame_;
  const base::Descriptor stop_event_;
  HandleChannels* const channels_;
  CommandGate gate_;
  UdpSocket socket_;
  Conversation conversation_;

  HandlePresence presence_ = HandlePresence::absent;
  Ipv4Endpoint from_;                   // sender of the newest state
  std::uint64_t session_of_frame_ = 0;  // the peer's session that corresponds to the frame's session
  bool session_began_ = false;          // the frame's session has begun but nothing was published in it yet
  std::optional<Arrived> newest_;       // fresh, not published yet
  std::int64_t fresh_ns_ = 0;           // arrival of the newest fresh state
  std::int64_t state_interval_ns_ = 0;  // between states, smoothed
  CpuBudget budget_;
  PeerClock peer_clock_;
  DelayEstimate delay_;
  std::uint64_t measurements_ = 0;

  std::int64_t command_sent_ns_ = 0;
  std::int64_t answered_ns_ = 0;  // time of the last reply to an unproven packet
  std::string bind_failure_;
  int send_failure_ = 0;  // errno
  std::string refusal_;   // of the last rejected packet
  std::int64_t refused_ns_ = 0;
  std::int64_t reported_ns_ = 0;
};

base::Result<std::shared_ptr<HandleWorker>> made(const config::HandleSettings& settings,
                                                 const rt::HandleScaleParameters& scale,
                                                 HandleChannels* channels) {
  const auto worker_settings = workerSettingsFrom(settings);
  if (!worker_settings) return std::unexpected(worker_settings.error());
  base::Descriptor stop_event(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!stop_event) {
    return std::unexpected(base::Error{"udp handle", std::strerror(errno), "raise the limit of open files"});
  }
  auto worker = std::make_shared<UdpWorker>(*worker_settings, "udp " + settings.of<UdpHandleSettings>().peer,
                                            HandleFrame(settings, scale), std::move(stop_event), channels);
  if (channels != nullptr) worker->openSocket();  // if this fails, run() tries again
  return worker;
}

}  // namespace
}  // namespace hapticd::drivers::udp

namespace hapticd::drivers {

UdpHandle::UdpHandle(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
                     const HandleThreadPolicy& policy)
    : WorkerHandle(
          {.name = "udp handle",
           .identity = "udp " + settings.of<UdpHandleSettings>().peer,
           .make = [settings, scale](auto* channels) { return udp::made(settings, scale, channels); }},
          policy) {}

std::unique_ptr<Handle> makeUdpHandle(const config::HandleSettings& settings,
                                      const rt::HandleScaleParameters& scale,
                                      const HandleThreadPolicy& policy) {
  return std::make_unique<UdpHandle>(settings, scale, policy);
}

}  // namespace hapticd::drivers
