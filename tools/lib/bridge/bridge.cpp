// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/bridge/bridge.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <system_error>
#include <utility>

#include "config/base/whole_file.h"
#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"
#include "tools/lib/bridge/device.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kHeldUpNs = 3'000'000;  // two or three packets pass at 1 kHz

}  // namespace

void ImpairedLink::push(std::span<const std::byte> bytes, std::int64_t now_ns) {
  if (happens(impairments_.loss)) return;
  Packet packet(bytes.begin(), bytes.end());
  if (!packet.empty() && happens(impairments_.corrupt)) {
    const std::size_t bit = random_() % (packet.size() * 8);
    packet[bit / 8] ^= std::byte{1} << (bit % 8);
  }
  std::int64_t arrives_ns = now_ns + std::llround(impairments_.delay_ms * 1e6);
  if (happens(impairments_.reorder)) arrives_ns += kHeldUpNs;
  if (happens(impairments_.duplicate)) under_way_.emplace(arrives_ns, packet);
  under_way_.emplace(arrives_ns, std::move(packet));
}

std::optional<ImpairedLink::Packet> ImpairedLink::pop(std::int64_t now_ns) {
  if (under_way_.empty() || under_way_.begin()->first > now_ns) return std::nullopt;
  return std::move(under_way_.extract(under_way_.begin()).mapped());
}

namespace {

constexpr std::chrono::milliseconds kInterval{20};
constexpr std::size_t kWrittenAtOnce = 64 * 1024;  // bytes

void appendRow(fmt::memory_buffer& text, const DeviceTick& tick) {
  const rt::Vec3& f = tick.commanded_n;
  const rt::Vec3& e = tick.exerted_n;
  const rt::Vec3& p = tick.position_m;
  fmt::format_to(std::back_inserter(text),
                 "{},{},{},{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.9g},{:.9g},{:.9g}\n",
                 tick.time_ns, tick.command_sequence, tick.command_made_ns, tick.command_age_ns,
                 tick.force_tick, tick.force_tick_ns, tick.active ? "active" : "zero", f.x, f.y, f.z, e.x,
                 e.y, e.z, p.x, p.y, p.z);
}

}  // namespace

base::Result<std::unique_ptr<DeviceLog>> DeviceLog::at(const std::string& path) {
  if (auto good = base::mayWrite(path, base::IfExists::replace); !good) return std::unexpected(good.error());
  std::FILE* const file = std::fopen(path.c_str(), "we");
  if (file == nullptr) return std::unexpected(base::Error{path, std::strerror(errno), "check --log"});
  return into(file, path);
}

base::Result<std::unique_ptr<DeviceLog>> DeviceLog::into(std::FILE* stream, const std::string& path) {
  std::unique_ptr<DeviceLog> log(new DeviceLog(stream, path));
  auto thread = drivers::startThread("device-log", [log = log.get()] { log->writeRows(); });
  if (!thread) return std::unexpected(thread.error());
  log->thread_ = std::move(*thread);
  return log;
}

DeviceLog::~DeviceLog() {
  endThread();
}

void DeviceLog::writeRows() {
  write(
      "t_ns,command_sequence,command_made_ns,command_age_ns,force_tick,force_tick_ns,mode,fx_n,fy_n,fz_n,"
      "exerted_x_n,exerted_y_n,exerted_z_n,x_m,y_m,z_m\n");
  while (!ends_.waitUntil(std::chrono::steady_clock::now() + kInterval)) writeWaiting();
  writeWaiting();
}

void DeviceLog::writeWaiting() {
  fmt::memory_buffer text;
  DeviceTick tick;
  while (waiting_.pop(tick)) {
    appendRow(text, tick);
    if (text.size() < kWrittenAtOnce) continue;
    write(fmt::to_string(text));
    text.clear();
  }
  write(fmt::to_string(text));
}

void DeviceLog::write(const std::string& text) {
  if (error_ != 0) return;
  if (std::fputs(text.c_str(), file_.get()) < 0 || std::fflush(file_.get()) != 0) error_ = errno;
}

void DeviceLog::endThread() {
  if (!thread_.joinable()) return;
  ends_.raise();
  thread_.join();
}

base::Result<void> DeviceLog::finish() {
  endThread();
  if (std::fclose(file_.release()) != 0 && error_ == 0) error_ = errno;
  if (error_ == 0) return {};
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  return std::unexpected(base::Error{path_, fmt::format("cannot be written: {}", std::strerror(error_)),
                                     "free space or give another --log"});
}

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
