// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/hid_handle.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <utility>

#include "drivers/handle/hid/hid_controller.h"
#include "drivers/handle/hid/hid_spacemouse.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kRetryPeriod{500};
constexpr milliseconds kStopLimit{1000};
constexpr milliseconds kReadLimit{20};                    // longest delay before a stop is noticed
constexpr std::size_t kMaxReportsAtOnce = 64;             // the length of the kernel's queue
constexpr std::int64_t kReportPeriodNs = 250'000'000;     // interval of status updates
constexpr std::int64_t kWriteHangsAfterNs = 200'000'000;  // an output report normally takes a millisecond

constexpr milliseconds kSpaceMousePeriod{1};
constexpr const char* kSpaceMouseAdvice = "a SpaceMouse exerts no force: forces are discarded";

std::string joined(const std::string& first, const std::string& second) {
  return first.empty() || second.empty() ? first + second : first + "; " + second;
}

constexpr std::uint16_t kGenericDesktopPage = 0x01;
constexpr std::uint16_t kMultiAxisController = 0x08;

base::Result<HidSelection> selectionFrom(const config::HandleSettings& settings) {
  const auto id = hidIdFrom(settings.of<HidHandleSettings>().device);
  if (!id) return std::unexpected(base::Error{"hid_handle.device", id.error().what, id.error().remedy});
  if (settings.of<HidHandleSettings>().kind == HidKind::spacemouse) {
    return HidSelection{*id, kGenericDesktopPage, kMultiAxisController, settings.serial};
  }
  return HidSelection{*id, kControllerUsagePage, kControllerUsage, settings.serial};
}

/// Exchanges reports with a controller, or reads those of a SpaceMouse. A thread that a failing device blocks
/// loses access to the channels.
class HidWorker final : public HandleWorker {
 public:
  HidWorker(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
            HidSelection selection, HidOpener open, HandleChannels* channels)
      : HandleWorker("hid " + textOf(selection.id), "looking for the handle", kRetryPeriod),
        is_spacemouse_(settings.of<HidHandleSettings>().kind == HidKind::spacemouse),
        selection_(std::move(selection)),
        open_(std::move(open)),
        controller_(settings, scale),
        spacemouse_(settings, scale),
        channels_(channels) {}

  void requestStop() override {
    HandleWorker::requestStop();
    const std::lock_guard lock(mutex_);
    channels_ = nullptr;
  }

  HandleStatus status() const override {
    HandleStatus status = HandleWorker::status();
    status.last_hop = controller_.lastHop();
    const std::int64_t since_ns = writing_since_ns_;
    if (since_ns != 0 && rt::monotonicNow_ns() - since_ns > kWriteHangsAfterNs) {
      status.state = HandlePresence::lost;
      status.detail = "hidraw: the handle takes no output reports (unplug it and plug it in again)";
    }
    return status;
  }

 private:
  using Clock = std::chrono::steady_clock;

  base::Result<void> useDevice() override {
    auto opened = open_(selection_);
    if (!opened) return std::unexpected(opened.error());
    reported_ns_ = 0;
    board_.update([&](HandleStatus& status) {
      status.identity = "hid " + textOf(selection_.id) + (opened->serial.empty() ? "" : " " + opened->serial);
      status.advice = joined(is_spacemouse_ ? kSpaceMouseAdvice : "", opened->advice);
      status.exerts_force = !is_spacemouse_;
    });
    return is_spacemouse_ ? useSpaceMouse(*opened->port) : useController(*opened->port);
  }

  base::Result<void> useController(HidPort& port) {
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
  base::Result<bool> takeReports(HidPort& port) {
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

  base::Result<void> write(HidPort& port, const Report& report) {
    writing_since_ns_ = rt::monotonicNow_ns();
    auto written = port.write(report);
    writing_since_ns_ = 0;
    return written;
  }

  /// Its reports arrive only while the cap is deflected, so the device counts as present as long as it can be
  /// read.
  base::Result<void> useSpaceMouse(HidPort& port) {
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

  /// Returns false once the channels have been taken away.
  bool publish(const rt::HandleState& state) {
    const std::lock_guard lock(mutex_);
    if (channels_ != nullptr) channels_->state.write(state);
    return channels_ != nullptr;
  }

  rt::HandleCommand newestCommand() {
    const std::lock_guard lock(mutex_);
    if (channels_ == nullptr) return {};
    channels_->command.refresh();
    return channels_->command.front();
  }

  /// Updates the status at each change of state and otherwise a few times a second.
  template <typename Fill>
  void report(HandlePresence presence, Fill fill) {
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

  const bool is_spacemouse_;
  const HidSelection selection_;
  const HidOpener open_;
  std::atomic<std::int64_t> writing_since_ns_{0};  // 0: not writing

  // accessed by run() only
  HidController controller_;
  HidSpaceMouse spacemouse_;
  HandlePresence reported_ = HandlePresence::absent;
  std::int64_t reported_ns_ = 0;

  std::mutex mutex_;
  HandleChannels* channels_;  // null once taken away
};

}  // namespace

HidHandle::HidHandle(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
                     HidOpener open, const HandleThreadPolicy& policy)
    : WorkerHandle({.name = "hid handle",
                    .identity = "hid " + settings.of<HidHandleSettings>().device,
                    .stop_limit = kStopLimit,
                    .make = [=](HandleChannels* channels) -> base::Result<std::shared_ptr<HandleWorker>> {
                      const auto selection = selectionFrom(settings);
                      if (!selection) return std::unexpected(selection.error());
                      return std::make_shared<HidWorker>(settings, scale, *selection, open, channels);
                    }},
                   policy) {}

std::unique_ptr<Handle> makeHidHandle(const config::HandleSettings& settings,
                                      const rt::HandleScaleParameters& scale,
                                      const HandleThreadPolicy& policy) {
  return std::make_unique<HidHandle>(settings, scale, openThroughHidapi, policy);
}

}  // namespace hapticd::drivers
