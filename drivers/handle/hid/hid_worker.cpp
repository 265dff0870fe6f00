// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/hid_worker.h"

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/handle/hid/hid_settings.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kRetryPeriod{500};
constexpr milliseconds kReadLimit{20};                    // longest delay before a stop is noticed
constexpr std::size_t kMaxReportsAtOnce = 64;             // the length of the kernel's queue
constexpr std::int64_t kReportPeriodNs = 250'000'000;     // interval of status updates
constexpr std::int64_t kWriteHangsAfterNs = 200'000'000;  // an output report normally takes a millisecond

constexpr milliseconds kSpaceMousePeriod{1};
constexpr const char* kSpaceMouseAdvice = "a SpaceMouse exerts no force: forces are discarded";

std::string joined(const std::string& first, const std::string& second) {
  return first.empty() || second.empty() ? first + second : first + "; " + second;
}

}  // namespace

HidWorker::HidWorker(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
                     HidSelection selection, HidOpener open, HandleChannels& channels)
    : is_spacemouse_(settings.of<HidHandleSettings>().kind == HidKind::spacemouse),
      selection_(std::move(selection)),
      open_(std::move(open)),
      controller_(settings, scale),
      spacemouse_(settings, scale),
      channels_(&channels) {
  board_.reset("hid " + textOf(selection_.id));
  board_.set(HandlePresence::absent, "looking for the handle");
}

void HidWorker::run() {
  Clock::time_point next_try = Clock::now();
  while (!stop_signal_.waitUntil(next_try)) {
    useDeviceOnce();
    next_try = Clock::now() + kRetryPeriod;
  }
}

void HidWorker::requestStop() {
  stop_signal_.raise();
  const std::lock_guard lock(mutex_);
  channels_ = nullptr;
}

HandleStatus HidWorker::status() const {
  HandleStatus status = board_.snapshot();
  status.last_hop = controller_.lastHop();
  const std::int64_t since_ns = writing_since_ns_;
  if (since_ns != 0 && rt::monotonicNow_ns() - since_ns > kWriteHangsAfterNs) {
    status.state = HandlePresence::lost;
    status.detail = "hidraw: the handle takes no output reports (unplug it and plug it in again)";
  }
  return status;
}

void HidWorker::reportMissing(const base::Error& error) {
  reported_ = seen_ ? HandlePresence::lost : HandlePresence::absent;
  board_.set(reported_, error.text());
}

/// Updates the status at each change of state and otherwise a few times a second.
template <typename Fill>
void HidWorker::report(HandlePresence presence, Fill fill) {
  const std::int64_t now_ns = rt::monotonicNow_ns();
  if (presence == reported_ && now_ns - reported_ns_ < kReportPeriodNs) return;
  reported_ = presence;
  reported_ns_ = now_ns;
  seen_ = seen_ || presence != HandlePresence::absent;
  board_.update([&](HandleStatus& status) {
    status.state = presence;
    fill(status);
  });
}

void HidWorker::useDeviceOnce() {
  auto opened = open_(selection_);
  if (!opened) return reportMissing(opened.error());
  board_.update([&](HandleStatus& status) {
    status.identity = "hid " + textOf(selection_.id) + (opened->serial.empty() ? "" : " " + opened->serial);
    status.advice = joined(is_spacemouse_ ? kSpaceMouseAdvice : "", opened->advice);
    status.exerts_force = !is_spacemouse_;
  });
  const auto used = is_spacemouse_ ? useSpaceMouse(*opened->port) : useController(*opened->port);
  if (!used) reportMissing(used.error());
}

/// Returns false once the channels have been taken away.
bool HidWorker::publish(const rt::HandleState& state) {
  const std::lock_guard lock(mutex_);
  if (channels_ != nullptr) channels_->state.write(state);
  return channels_ != nullptr;
}

rt::HandleCommand HidWorker::newestCommand() {
  const std::lock_guard lock(mutex_);
  if (channels_ == nullptr) return {};
  channels_->command.refresh();
  return channels_->command.front();
}

// --- Controller

base::Result<void> HidWorker::useController(HidPort& port) {
  controller_.opened(rt::monotonicNow_ns());
  while (!stop_signal_.raised()) {
    const auto taken = takeReports(port);
    if (!taken) return std::unexpected(taken.error());
    if (*taken) {
      const Report report = controller_.answer(newestCommand(), rt::monotonicNow_ns());
      if (auto written = write(port, report); !written) return written;
      controller_.answered(rt::monotonicNow_ns());
    } else {
      controller_.idle(rt::monotonicNow_ns());
    }
    report(controller_.presence(), [this](HandleStatus& status) {
      status.detail = controller_.detail();
      status.measurements = controller_.measurements();
      status.rejected = controller_.rejected();
      status.link = controller_.link();
    });
  }
  return write(port, controller_.farewell(rt::monotonicNow_ns()));
}

/// Processes all reports that have arrived, after waiting for the first one; returns true if one was
/// published.
base::Result<bool> HidWorker::takeReports(HidPort& port) {
  std::array<std::uint8_t, kReportBytes + 1>
      buffer{};  // one byte more, so that a longer report is not mistaken for a valid one
  bool any = false;
  milliseconds wait = kReadLimit;
  for (std::size_t count = 0; count < kMaxReportsAtOnce; ++count) {
    const auto size = port.read(buffer, wait);
    if (!size) return std::unexpected(size.error());
    if (*size == 0) break;
    const auto state = controller_.take(ReportBytes(buffer).first(*size), rt::monotonicNow_ns());
    if (state) any = publish(*state);
    wait = milliseconds(0);
  }
  return any;
}

base::Result<void> HidWorker::write(HidPort& port, const Report& report) {
  writing_since_ns_ = rt::monotonicNow_ns();
  auto written = port.write(report);
  writing_since_ns_ = 0;
  return written;
}

// --- SpaceMouse

/// Its reports arrive only while the cap is deflected, so the device counts as present as long as it can be
/// read.
base::Result<void> HidWorker::useSpaceMouse(HidPort& port) {
  std::array<std::uint8_t, kReportBytes> buffer{};
  spacemouse_.opened(rt::monotonicNow_ns());
  for (Clock::time_point due = Clock::now(); !stop_signal_.waitUntil(due); due += kSpaceMousePeriod) {
    for (std::size_t count = 0; count < kMaxReportsAtOnce; ++count) {
      const auto size = port.read(buffer, milliseconds(0));
      if (!size) return std::unexpected(size.error());
      if (*size == 0) break;
      spacemouse_.take(ReportBytes(buffer).first(*size));
    }
    publish(spacemouse_.state(rt::monotonicNow_ns()));
    report(HandlePresence::present, [this](HandleStatus& status) {
      status.detail.clear();
      status.measurements = spacemouse_.measurements();
      status.rejected = spacemouse_.rejected();
    });
    due = std::max(due, Clock::now() - kSpaceMousePeriod);  // periods missed by a late wake-up are skipped
  }
  return {};
}

}  // namespace hapticd::drivers
