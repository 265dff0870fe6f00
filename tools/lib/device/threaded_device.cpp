// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/device/threaded_device.h"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kNotBegun = std::numeric_limits<std::int64_t>::max();

}  // namespace

struct Place {
  std::atomic<const char*> name{nullptr};  // null: free
  std::atomic<std::int64_t> since_ns{kNotBegun};
};

namespace {

/// A driver's thread and those of its library.
std::array<Place, 4> places;  // NOLINT: calls are watched from elsewhere

}  // namespace

OutsideCall::OutsideCall(const char* name) noexcept {
  for (Place& place : places) {
    const char* free = nullptr;
    if (!place.name.compare_exchange_strong(free, name)) continue;
    place.since_ns = rt::monotonicNow_ns();
    place_ = &place;
    return;
  }
}

OutsideCall::~OutsideCall() {
  if (place_ == nullptr) return;
  place_->since_ns = kNotBegun;
  place_->name = nullptr;
}

std::optional<OutsideCall::Lasting> OutsideCall::hanging() noexcept {
  std::optional<Lasting> longest;
  const std::int64_t before_ns = rt::monotonicNow_ns() - kPatienceNs;
  for (Place& place : places) {
    const std::int64_t since_ns = place.since_ns;
    const char* const name = place.name;
    const bool same = name != nullptr && place.since_ns == since_ns;  // not that of the next call
    if (same && since_ns < before_ns && (!longest || since_ns < longest->since_ns))
      longest = Lasting{name, since_ns};
  }
  return longest;
}

namespace {

bool isUnit(const rt::Quaternion& q) {
  constexpr double kRounding = 1e-3;           // of a matrix of a vendor, in float
  return std::abs(dot(q, q) - 1) < kRounding;  // false for what is no number
}

}  // namespace

DeviceReading DeviceExchange::newest(std::int64_t now_ns) {
  const std::uint64_t opening = open_.load(std::memory_order_acquire);
  const bool fresh = readings_.refresh();
  const Reading& newest = readings_.front();
  DeviceReading reading = newest.reading;
  const std::int64_t age_ns = std::max(now_ns - newest.measured_ns, std::int64_t{0});
  const bool lost = opening == 0 || newest.opening == 0 || age_ns > kDeadManNs;
  if (lost || newest.opening != opening) {
    // between two openings of a device that was there all the time, hapticd is to wait, not to lose it
    if (lost) reading.fault = true;
    reading.calibrated = false;
    delay_.reset();
    answered_ = 0;
    return reading;
  }
  answered_ = reading.fault || !reading.calibrated ? 0 : opening;
  if (fresh) delay_.add(age_ns + command_wait_ns_.load(std::memory_order_relaxed));
  reading.latency_ns += delay_.ninetyFifthPercentileNs();
  return reading;
}

void DeviceExchange::command(const DeviceCommand& command, std::int64_t now_ns) {
  commands_.write({command, now_ns, answered_});
}

DeviceLimits DeviceExchange::limits() const {
  if (open_.load(std::memory_order_acquire) == 0) return {};
  return {.force_n = force_n_.load(std::memory_order_relaxed),
          .torque_n_m = torque_n_m_.load(std::memory_order_relaxed),
          .gripper_force_n = gripper_force_n_.load(std::memory_order_relaxed)};
}

void DeviceExchange::open(const DeviceLimits& limits) {
  force_n_.store(limits.force_n, std::memory_order_relaxed);
  torque_n_m_.store(limits.torque_n_m, std::memory_order_relaxed);
  gripper_force_n_.store(limits.gripper_force_n, std::memory_order_relaxed);
  open_.store(++openings_, std::memory_order_release);
}

ReadingVerdict DeviceExchange::judge(const DeviceReading& reading, std::int64_t measured_ns) const {
  if (!isFinite(reading.position_m)) return ReadingVerdict::not_finite;
  const std::int64_t since_ns = measured_ns - last_sound_.measured_ns;
  const bool follows = last_sound_.opening != 0 && since_ns < kDeadManNs &&
                       last_sound_.opening == open_.load(std::memory_order_relaxed);
  if (!follows || !reading.calibrated) return ReadingVerdict::taken_over;
  const double moved_m = norm(reading.position_m - last_sound_.reading.position_m);
  const double most_m = kJumpM + kFastestHandMPerS * static_cast<double>(since_ns) * 1e-9;
  return moved_m > most_m ? ReadingVerdict::jumped : ReadingVerdict::taken_over;
}

ReadingVerdict DeviceExchange::publish(const DeviceReading& reading, std::int64_t measured_ns) {
  const ReadingVerdict verdict = judge(reading, measured_ns);
  Reading published{reading, measured_ns, open_.load(std::memory_order_relaxed)};
  DeviceReading& passed = published.reading;
  if (verdict != ReadingVerdict::taken_over) {
    passed.position_m = last_sound_.reading.position_m;
    passed.fault = true;
  }
  passed.velocity_valid = passed.velocity_valid && isFinite(passed.velocity_m_per_s);
  if (!passed.velocity_valid) passed.velocity_m_per_s = {};
  if (passed.orientation && !isUnit(*passed.orientation)) passed.orientation.reset();
  if (passed.gripper_rad && !std::isfinite(*passed.gripper_rad)) passed.gripper_rad.reset();
  sound_ = !passed.fault && passed.calibrated;
  if (sound_) last_sound_ = published;
  readings_.write(published);
  return verdict;
}

DeviceCommand DeviceExchange::commandAt(std::int64_t now_ns) {
  const std::uint64_t opening = open_.load(std::memory_order_acquire);
  commands_.refresh();
  const Command& newest = commands_.front();
  const std::int64_t age_ns = now_ns - newest.written_ns;
  if (newest.written_ns != taken_ns_) {
    taken_ns_ = newest.written_ns;
    command_wait_ns_.store(std::max(age_ns, std::int64_t{0}), std::memory_order_relaxed);
  }
  const bool answers = opening != 0 && newest.opening == opening && sound_;
  if (!answers || age_ns >= kDeadManNs) return {};
  const double gripper_limit_n = gripper_force_n_.load(std::memory_order_relaxed);
  const double gripper_n = newest.command.gripper_force_n;
  return {.force_n = boundedForce(newest.command.force_n, force_n_.load(std::memory_order_relaxed)),
          .torque_n_m = boundedForce(newest.command.torque_n_m, torque_n_m_.load(std::memory_order_relaxed)),
          .gripper_force_n =
              std::isfinite(gripper_n) ? std::clamp(gripper_n, -gripper_limit_n, gripper_limit_n) : 0};
}

void DeviceSession::say(const std::string& text) {
  fmt::print(stderr, "{}: {}\n", name_, text);
}

void DeviceSession::opened(const DeviceAbout& about) {
  say(fmt::format("{} ready{}", about.model.empty() ? "device" : about.model,
                  about.serial.empty() ? "" : fmt::format(" (serial number {})", about.serial)));
  on_open_(about);
  exchange_.open(about.limits);
  was_opened_ = true;
}

void Complaint::update(DeviceSession& session, int state, const std::string& text) {
  if (state != 0 && state != state_) {
    ++times_;
    session.say(times_ == 1 ? text : fmt::format("{} ({} times so far)", text, times_));
  }
  state_ = state;
}

ThreadedDevice::~ThreadedDevice() {
  exchange_.command({}, rt::monotonicNow_ns());
  stop_.raise();
  if (thread_.joinable()) thread_.join();
  watch_ends_.raise();
  if (watch_thread_.joinable()) watch_thread_.join();
}

base::Result<void> ThreadedDevice::start() {
  auto thread = drivers::startThread("device", [this] { run(); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  auto watching = drivers::startThread("device-watch", [this] { watch(); });
  if (!watching) return std::unexpected(watching.error());
  watch_thread_ = std::move(*watching);
  return {};
}

DeviceReading ThreadedDevice::read() {
  return exchange_.newest(rt::monotonicNow_ns());
}

void ThreadedDevice::exert(const DeviceCommand& command) {
  exchange_.command(command, rt::monotonicNow_ns());
}

DeviceAbout ThreadedDevice::about() const {
  const std::lock_guard lock(about_mutex_);
  return about_;
}

void ThreadedDevice::run() {
  std::string said;
  while (!stop_.raised()) {
    DeviceSession session(exchange_, stop_, name_, [this](const DeviceAbout& about) {
      const std::lock_guard lock(about_mutex_);
      about_ = about;
    });
    const auto driven = driver_->drive(session);
    exchange_.close();
    // the same complaint each second would hide all others
    if (session.wasOpened()) said.clear();
    if (!driven && driven.error().text() != said) session.say(said = driven.error().text());
    if (session.pause(kRetry)) return;
  }
}

void ThreadedDevice::watch() {
  constexpr std::chrono::milliseconds kLook{250};
  std::optional<OutsideCall::Lasting> said;
  while (!watch_ends_.waitUntil(std::chrono::steady_clock::now() + kLook)) {
    const auto hangs = OutsideCall::hanging();
    const bool same = hangs && said && hangs->since_ns == said->since_ns;
    if (same) continue;
    const auto say = [&](const OutsideCall::Lasting& call, const char* what) {
      const std::string text = fmt::format("{} {} {:.1f} s", call.name, what,
                                           static_cast<double>(rt::monotonicNow_ns() - call.since_ns) * 1e-9);
      fmt::print(stderr, "{}: {}\n", name_, text);
      ::sd_notify(0, ("STATUS=" + text).c_str());
    };
    if (said) say(*said, "has returned after about");
    if (hangs) say(*hangs, "hangs: the device gets no new force until it returns; it has lasted for");
    said = hangs;
  }
}

}  // namespace hapticd::tools
