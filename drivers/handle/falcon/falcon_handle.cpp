// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/falcon/falcon_handle.h"

#include <fmt/format.h>

#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kRetryPeriod{1000};
constexpr milliseconds kReportPeriod{100};

constexpr const char* kHomingAdvice = "pull the grip fully out, then push it fully in";

/// Mean duration of an exchange over about the last kWeight ones.
class ExchangeTime {
 public:
  void add(std::int64_t duration_ns) {
    constexpr double kWeight = 64;
    const double duration_s = static_cast<double>(duration_ns) / static_cast<double>(rt::kNsPerSecond);
    mean_s_ += (duration_s - mean_s_) / (mean_s_ == 0 ? 1 : kWeight);
  }
  double mean_s() const { return mean_s_; }

 private:
  double mean_s_ = 0;
};

}  // namespace

/// State from the first exchange until the device is lost.
struct FalconHandle::Session {
  Session(FtdiPort& port, HandleChannels& channels, double force_share)
      : link(port), tracker(force_share), commands(channels.command), states(channels.state) {}

  const rt::HandleCommand& newestCommand() {
    commands.refresh();
    return commands.front();
  }

  FalconLink link;
  FalconTracker tracker;
  rt::HandleCommandChannel& commands;
  rt::HandleStateChannel& states;
  ExchangeTime exchange_time;
  std::string advice;              // findings from before the first exchange
  std::uint64_t damaged = 0;       // damaged replies of the link already counted
  std::uint64_t without_pose = 0;  // since the last report
  bool force_cut = false;          // since the last report
};

base::Result<void> FalconHandle::start(HandleChannels& channels) {
  if (thread_.joinable()) return std::unexpected(base::Error{"falcon", "is already running", ""});
  stop_signal_.reset();
  board_.reset(identityOf(settings_.serial));
  board_.set(HandlePresence::absent, "looking for the Falcon");
  frame_.emplace(settings_, scale_);
  seen_ = false;
  measurements_ = 0;
  rejected_ = 0;
  auto started = startHandleThread(policy_, [this, &channels] { run(channels); });
  if (!started) return std::unexpected(started.error());
  board_.update([&](HandleStatus& status) { status.scheduling = started->scheduling; });
  thread_ = std::move(started->thread);
  return {};
}

HandleStatus FalconHandle::status() const {
  HandleStatus status = board_.snapshot();
  status.last_hop = gate_.lastHop();
  return status;
}

void FalconHandle::stop() {
  if (!thread_.joinable()) return;
  stop_signal_.raise();
  thread_.join();
  board_.set(HandlePresence::absent, "stopped");
}

std::string FalconHandle::identityOf(const std::string& serial) const {
  return serial.empty() ? "falcon" : "falcon " + serial;
}

void FalconHandle::run(HandleChannels& channels) {
  Clock::time_point next_try = Clock::now();
  while (!stop_signal_.waitUntil(next_try)) {
    useDeviceOnce(channels);
    next_try = Clock::now() + kRetryPeriod;
  }
}

void FalconHandle::useDeviceOnce(HandleChannels& channels) {
  auto port = FtdiPort::open(settings_.serial);
  if (!port) return reportMissing(port.error());
  board_.update([&](HandleStatus& status) { status.identity = identityOf((*port)->serial()); });

  auto advice = ensureFirmware(**port);
  if (!advice) return reportMissing(advice.error());
  Session session(**port, channels, settings_.of<FalconHandleSettings>().force_share);
  session.advice = std::move(*advice);

  const base::Result<void> exchanged = exchange(session);
  session.link.send({});  // zero force; a device that is gone exerts none
  report(session);        // with the counts since the last report
  if (!exchanged) reportMissing(exchanged.error());
}

/// Loads the firmware if the device has none, as after a power loss; returns advice on its image. The file is
/// read after the device has been asked, because a disk may stall: asking releases the force that the device
/// may still hold from before it was lost.
base::Result<std::string> FalconHandle::ensureFirmware(FtdiPort& port) {
  auto answers = falconAnswers(port, stop_signal_);
  if (!answers) return std::unexpected(answers.error());
  const auto image = readFalconImage(settings_.of<FalconHandleSettings>().firmware);
  if (*answers) return image ? "" : "uses the firmware it already has, but " + image.error().text();
  if (!image) return std::unexpected(image.error());
  base::Error error{"falcon firmware", "stopped", ""};
  std::string failure;
  for (int load = 1; load <= kMaxLoads && !stop_signal_.raised(); ++load) {
    board_.set(HandlePresence::calibrating,
               fmt::format("loading the firmware, try {} of {}{}", load, kMaxLoads, failure));
    const base::Result<void> loaded = loadFalconImage(port, *image, stop_signal_);
    answers = loaded ? falconAnswers(port, stop_signal_) : std::unexpected(loaded.error());
    if (answers && *answers) return "";
    error = answers ? base::Error{"falcon firmware", "it was loaded but does not respond",
                                  "check that falcon_handle.firmware is an image for the Falcon"}
                    : answers.error();
    failure = "; previous try: " + error.text();
  }
  return std::unexpected(error);
}

base::Result<void> FalconHandle::exchange(Session& session) {
  if (auto begun = session.link.begin(); !begun) return begun;
  frame_->beginSession();
  seen_ = true;
  report(session);
  Clock::time_point last_reply = Clock::now();
  Clock::time_point last_report = last_reply;
  while (!stop_signal_.raised()) {
    const std::int64_t begin_ns = rt::monotonicNow_ns();
    auto force_n = gate_.pass(session.newestCommand(), frame_->session(), begin_ns);
    if (force_n) force_n = frame_->forceInHandle(*force_n);
    if (auto sent = session.link.send(session.tracker.orderFor(force_n)); !sent) return sent;
    gate_.sent(rt::monotonicNow_ns());
    const auto reply = session.link.receive();
    if (!reply) return std::unexpected(reply.error());
    const Clock::time_point now = Clock::now();
    if (*reply) {
      last_reply = now;
      session.exchange_time.add(rt::monotonicNow_ns() - begin_ns);
      take(session, **reply);
    } else if (now - last_reply > kSilenceLimit) {
      return std::unexpected(
          base::Error{"falcon", "it has stopped responding", "check its USB cable and its power supply"});
    }
    if (now - last_report < kReportPeriod) continue;
    last_report = now;
    report(session);
  }
  return {};
}

/// Processes a reply. It reports the position at the begin of the exchange; the command that responds to it
/// is sent at the begin of the next exchange and takes effect when it has arrived, so the delay is at most
/// two exchanges.
void FalconHandle::take(Session& session, const FalconReply& reply) {
  FalconTracker& tracker = session.tracker;
  const bool was_homed = tracker.homed();
  tracker.take(reply);
  session.force_cut |= tracker.forceCut();
  if (tracker.homed() != was_homed) {
    frame_->beginSession();  // positions from before the session are unrelated to new ones
    report(session);
  }
  HandleMeasurement measurement;
  measurement.time_ns = rt::monotonicNow_ns();
  measurement.buttons = reply.buttons;
  measurement.calibrated = tracker.homed();
  measurement.delay_s = 2 * session.exchange_time.mean_s();
  measurement.command_latency_ns = gate_.latency_ns();
  measurement.over_link = true;
  if (tracker.homed()) {
    if (!tracker.pose()) {
      ++session.without_pose;
      ++rejected_;
      return;
    }
    measurement.position_m_in_handle = tracker.pose()->position_m - kFalconCentre_m;
  }
  session.states.write(frame_->stateOf(measurement));
  ++measurements_;
}

void FalconHandle::report(Session& session) {
  rejected_ += session.link.damaged() - session.damaged;
  session.damaged = session.link.damaged();
  const bool homed = session.tracker.homed();
  std::string advice = session.advice;
  if (session.without_pose > 0) {
    advice = fmt::format("its encoders report a position out of its reach (switch it off and on, then {})",
                         kHomingAdvice);
  } else if (session.force_cut) {
    advice = "its motors are at their limit, forces are weaker than commanded";
  }
  board_.update([&](HandleStatus& status) {
    status.state = homed ? HandlePresence::present : HandlePresence::calibrating;
    status.detail = homed ? "" : kHomingAdvice;
    status.measurements = measurements_;
    status.rejected = rejected_;
    status.advice = std::move(advice);
  });
  session.without_pose = 0;
  session.force_cut = false;
}

void FalconHandle::reportMissing(const base::Error& error) {
  board_.update([&](HandleStatus& status) {
    status.state = seen_ ? HandlePresence::lost : HandlePresence::absent;
    status.detail = error.text();
    status.measurements = measurements_;
    status.rejected = rejected_;
    status.advice.clear();
  });
}

std::unique_ptr<Handle> makeFalconHandle(const config::HandleSettings& settings,
                                         const rt::HandleScaleParameters& scale,
                                         const HandleThreadPolicy& policy) {
  return std::make_unique<FalconHandle>(settings, scale, policy);
}

}  // namespace hapticd::drivers
