// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/bridge/bridge.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "rt/base/clock.h"
#include "tools/lib/bridge/device.h"

namespace hapticd::tools {
namespace udp = drivers::udp;

Bridge::Bridge(const BridgeOptions& options, udp::UdpSocket& socket, Device& device, DeviceLog* log)
    : options_(options),
      socket_(socket),
      device_(device),
      log_(log),
      conversation_(udp::randomSession(), options.protocol),
      out_(options.impairments, 0),
      in_(options.impairments, 1) {}

Bridge::~Bridge() {
  device_.exert({});
}

void Bridge::run(const std::function<bool(double)>& ends) {
  const std::int64_t began_ns = rt::monotonicNow_ns();
  ticked_ns_ = began_ns;
  rt::PeriodicClock clock(kTickNs);
  clock.start(began_ns);
  while (!ends(static_cast<double>(ticked_ns_ - began_ns) * 1e-9)) {
    receiveUntil(clock.planned_ns());
    rt::sleepUntil(clock.planned_ns());
    tick(rt::monotonicNow_ns());
    summary_.skipped_ticks += clock.advance(rt::monotonicNow_ns());
  }
  device_.exert({});
}

/// A packet that waited in the socket would count as one that the network held up.
void Bridge::receiveUntil(std::int64_t when_ns) {
  constexpr std::int64_t kRestNs = 100'000;  // is slept precisely
  for (std::int64_t now_ns = rt::monotonicNow_ns(); when_ns - now_ns > kRestNs;
       now_ns = rt::monotonicNow_ns()) {
    pollfd watched{socket_.descriptor(), POLLIN, 0};
    const timespec rest{0, static_cast<long>(std::min(when_ns - now_ns, kTickNs) - kRestNs)};
    if (::ppoll(&watched, 1, &rest, nullptr) > 0) receive(rt::monotonicNow_ns());
  }
}

void Bridge::tick(std::int64_t now_ns) {
  receive(now_ns);
  const DeviceReading reading = device_.read();
  const DeviceCommand exerted = exertedAt(now_ns, reading);
  device_.exert(exerted);
  sendState(reading, now_ns);
  account(reading, exerted.force_n, now_ns);
  ticked_ns_ = now_ns;
}

/// At most kMaxPacketsAtOnce, so that packets that come faster than they are checked do not hold up the
/// device.
void Bridge::receive(std::int64_t now_ns) {
  constexpr int kMaxPacketsAtOnce = 64;
  std::array<std::byte, 256> buffer;
  for (int i = 0; i < kMaxPacketsAtOnce; ++i) {
    const auto datagram = socket_.receive(buffer);
    if (!datagram) break;
    const bool from_peer = datagram->from == options_.peer;
    if (from_peer) in_.push(datagram->bytes, now_ns);
    if (from_peer) continue;
    conversation_.countRejected();
    summary_.last_refusal = fmt::format("from {}, which is not --peer", textOf(datagram->from));
  }
  while (const auto packet = in_.pop(now_ns)) take(*packet, now_ns);
}

void Bridge::take(std::span<const std::byte> bytes, std::int64_t now_ns) {
  const auto packet = udp::decodeCommand(bytes, options_.key);
  if (!packet) {
    conversation_.countRejected();
    summary_.last_refusal = textOf(packet.error());
    return;
  }
  // States are sent at each tick anyway, so what is not proven needs no answer of its own.
  if (conversation_.hear(packet->header, now_ns) != udp::Conversation::Verdict::fresh) return;
  command_ = *packet;
  command_ns_ = now_ns;
}

bool Bridge::damps(const DeviceReading& reading) const {
  return options_.damps && reading.velocity_valid && command_ && command_->may_damp;
}

DeviceCommand Bridge::exertedAt(std::int64_t now_ns, const DeviceReading& reading) {
  if (!command_ || !command_->active) return {};
  const double share = deadManShare(now_ns - command_ns_);
  if (share < 1) ++summary_.dead_man_ticks;
  const double damping =
      damps(reading) ? std::min(command_->contact_damping_n_s_per_m, options_.max_damping_n_s_per_m) : 0;
  const DeviceLimits limits = device_.limits();
  const rt::Vec3 force_n = dampedForce(command_->force_n_in_handle, reading.velocity_m_per_s, damping);
  return {.force_n = share * boundedForce(force_n, std::min(options_.max_force_n, limits.force_n)),
          .torque_n_m = share * boundedForce(command_->torque_n_m_in_handle, limits.torque_n_m),
          .gripper_force_n =
              share * std::clamp(command_->gripper_force_n, -limits.gripper_force_n, limits.gripper_force_n)};
}

void Bridge::sendState(const DeviceReading& reading, std::int64_t now_ns) {
  udp::StatePacket packet;
  packet.header = conversation_.next(now_ns);
  packet.position_m_in_handle = reading.position_m;
  packet.velocity_m_per_s_in_handle = reading.velocity_m_per_s;
  packet.velocity_valid = reading.velocity_valid;
  packet.calibrated = reading.calibrated;
  packet.fault = reading.fault;
  packet.damps = damps(reading);
  packet.buttons = reading.buttons;
  packet.orientation_in_handle = reading.orientation;
  packet.gripper_rad = reading.gripper_rad;
  packet.drives_torque = device_.limits().torque_n_m > 0;
  packet.drives_gripper = device_.limits().gripper_force_n > 0;
  packet.device_latency_ns = std::clamp(reading.latency_ns, std::int64_t{0}, udp::kMaxDeviceLatencyNs);
  out_.push(udp::encode(packet, options_.key).bytes(), now_ns);
  // A network that refuses packets for a while is the same as one that loses them.
  while (const auto bytes = out_.pop(now_ns)) socket_.send(*bytes, options_.peer);
}

void Bridge::account(const DeviceReading& reading, const rt::Vec3& exerted_n, std::int64_t now_ns) {
  const double force_n = norm(exerted_n);
  ++summary_.ticks;
  if (force_n > 0) ++summary_.active_ticks;
  summary_.most_force_n = std::max(summary_.most_force_n, force_n);
  summary_.energy_j +=
      dot(exerted_n, reading.velocity_m_per_s) * static_cast<double>(now_ns - ticked_ns_) * 1e-9;
  if (log_ == nullptr) return;
  DeviceTick row;
  row.time_ns = now_ns;
  row.command_age_ns = command_ ? now_ns - command_ns_ : -1;
  row.exerted_n = exerted_n;
  row.position_m = reading.position_m;
  if (command_) {
    row.command_sequence = command_->header.sequence;
    row.command_made_ns = command_->header.time_ns;
    row.force_tick = command_->tick;
    row.force_tick_ns = command_->tick_ns;
    row.active = command_->active;
    row.commanded_n = command_->force_n_in_handle;
  }
  log_->add(row);
}

BridgeSummary Bridge::summary() const {
  BridgeSummary summary = summary_;
  summary.link = conversation_.link();
  if (log_ != nullptr) summary.dropped_rows = log_->dropped();
  return summary;
}

std::string bridgeTable(const BridgeSummary& summary) {
  const drivers::LinkStatus& link = summary.link;
  const auto us = [](std::uint64_t ns) { return static_cast<double>(ns) * 1e-3; };
  std::string text = fmt::format(
      "ticks of the device      {:>10}   skipped {}\n"
      "states sent              {:>10}\n"
      "packets received         {:>10}   lost {}, duplicated {}, reordered {}, rejected {}\n"
      "round trip, us           {:>10.0f}   p99 {:.0f}, p99.9 {:.0f}, max {:.0f} (the first number: p50)\n"
      "ticks with a force       {:>10}   of these {} less than commanded: the command was old\n"
      "strongest force, N       {:>10.3f}\n"
      "energy to the hand, mJ   {:>10.3f}\n",
      summary.ticks, summary.skipped_ticks, link.sent, link.received, link.lost, link.duplicated,
      link.reordered, link.rejected, us(link.round_trip.p50_ns), us(link.round_trip.p99_ns),
      us(link.round_trip.p999_ns), us(link.round_trip.max_ns), summary.active_ticks, summary.dead_man_ticks,
      summary.most_force_n, summary.energy_j * 1e3);
  if (summary.dropped_rows > 0)
    text += fmt::format("rows missing in the log  {:>10}   (the disk was too slow)\n", summary.dropped_rows);
  if (!summary.last_refusal.empty())
    text += fmt::format("last packet rejected     {}\n", summary.last_refusal);
  return text;
}

}  // namespace hapticd::tools
