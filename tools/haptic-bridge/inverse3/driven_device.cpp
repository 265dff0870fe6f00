// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/inverse3/driven_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "rt/base/clock.h"

namespace hapticd::tools::inverse3 {
namespace {

/// Answers in a row, without a usable state, after which the device counts as lost.
constexpr int kMaxUseless = 5;
constexpr std::uint64_t kMaxUnasked = 100;
constexpr std::int64_t kAnswerPatienceNs = 500'000'000;
constexpr std::chrono::milliseconds kLeavePatience{50};
/// A hand's fastest motions are below 10 m/s; the reach of the arm is below 1 m.
constexpr double kMaxReachM = 1;
/// Between two states. Those that are 10 ms apart or less are all that count.
constexpr double kMaxStepM = 0.1;
constexpr int kMaxTicksUntilQuiet = 5000;
/// Grips send 50 to 60 orientations a second, which never are the same twice in a hand.
constexpr std::int64_t kGripOldNs = 2'000'000'000;

base::Error failure(const std::string& what, const std::string& remedy = "") {
  return {"Inverse3", what, remedy};
}

std::string vectorText(const rt::Vec3& vector) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", vector.x, vector.y, vector.z);
}

}  // namespace

double forceLimitOf(const std::string& type) {
  constexpr double kInverse3N = 10;
  constexpr double kUnknownN = 2;  // at which other programs clip
  return type.empty() || type == "inverse3" || type == "inverse3x" ? kInverse3N : kUnknownN;
}

std::int64_t gateDelayEstimateNs(const ServiceFilters& filters) {
  const double gain = filters.force_gate_gain.value_or(1);
  constexpr double kLeastGain = 0.01;  // 100 ms
  if (!(gain < 1)) return 0;
  return static_cast<std::int64_t>((1 / std::max(gain, kLeastGain) - 1) *
                                   static_cast<double>(DrivenDevice::kTickNs));
}

DrivenDevice::DrivenDevice(DeviceSession& session, ServiceLink& link, std::optional<ServiceLink>& events,
                           const InventoryEntry& entry, KeyForm form)
    : session_(session),
      link_(link),
      events_(events),
      entry_(entry),
      form_(form),
      writer_(entry.device_id, form),
      limit_n_(forceLimitOf(entry.type)),
      watch_(entry.device_id) {}

DrivenDevice::~DrivenDevice() {
  leave();
  if (useless_ > 0) session_.say(fmt::format("{} states of the device could not be used", useless_));
}

base::Result<void> DrivenDevice::begin() {
  int ticks = 0;
  if (auto ok = tickUntil([&] { return check_.isQuiet() || ++ticks > kMaxTicksUntilQuiet; }); !ok) return ok;
  if (check_.isQuiet() || session_.ends()) return {};
  return std::unexpected(
      failure(fmt::format("current_cursor_force is {} N although zero is commanded", vectorText(echoed_n_)),
              "close other programs that drive the device"));
}

base::Result<void> DrivenDevice::run() {
  return tickUntil([] { return false; });
}

template <typename Done>
base::Result<void> DrivenDevice::tickUntil(Done done) {
  rt::PeriodicClock clock(kTickNs);
  clock.start(rt::monotonicNow_ns());
  while (!session_.ends() && !done()) {
    rt::sleepUntil(clock.planned_ns());
    if (auto ok = tick(rt::monotonicNow_ns()); !ok) return ok;
    clock.advance(rt::monotonicNow_ns());
  }
  return {};
}

base::Result<void> DrivenDevice::tick(std::int64_t now_ns) {
  if (auto ok = hearEvents(); !ok) return ok;
  // one frame at a time: the service answers each, and what is queued only becomes old
  if (sent_.empty()) {
    if (auto ok = send(forceAt(now_ns), now_ns); !ok) return ok;
  }
  return hearAnswer();
}

base::Result<void> DrivenDevice::hearEvents() {
  constexpr int kMaxEventsAtOnce = 8;
  for (int i = 0; events_ && i < kMaxEventsAtOnce; ++i) {
    auto text = events_->receive(std::chrono::nanoseconds(0));
    if (!text) {
      session_.say("the event channel is lost: " + text.error().text() + "; causes are named no longer");
      events_.reset();
      return {};
    }
    if (!*text) return {};
    const auto event = eventFrom(**text);
    if (!event) continue;
    if (auto ok = report(watch_.takeEvent(*event)); !ok) return ok;
  }
  if (watch_.takeGripLost()) grip_old_ = true;
  return {};
}

base::Result<void> DrivenDevice::report(const Finding& finding) {
  if (finding.ends) return std::unexpected(failure(finding.text));
  if (!finding.text.empty()) session_.say(finding.text);
  return {};
}

rt::Vec3 DrivenDevice::forceAt(std::int64_t now_ns) {
  const DeviceCommand command = session_.exchange().commandAt(now_ns);
  if (watch_.holds() || !watch_.calibrated() || useless_in_a_row_ > 0) return {};
  return boundedForce(command.force_n, check_.most_n(limit_n_));
}

base::Result<void> DrivenDevice::send(const rt::Vec3& force_n, std::int64_t now_ns) {
  sent_.push_back({now_ns, force_n});
  return link_.send(writer_.force(force_n));
}

/// Waits for one answer. When none comes for the time of the dead man, the service gets a zero force, because
/// nobody knows how long it keeps the last one. What has arrived meanwhile is taken before that, or a
/// computer that is late at each tick would command zero for ever.
base::Result<void> DrivenDevice::hearAnswer() {
  const std::int64_t asked_ns = sent_.front().time_ns;
  while (!session_.ends()) {
    const std::int64_t waited_ns = rt::monotonicNow_ns() - asked_ns;
    const bool late = waited_ns >= kDeadManNs;
    const bool owes_zero = late && sent_.size() == 1;
    const std::int64_t rest_ns =
        owes_zero ? 0 : std::min((late ? kAnswerPatienceNs : kDeadManNs) - waited_ns, kDeadManNs);
    auto text = link_.receive(std::chrono::nanoseconds(rest_ns));
    if (!text) return std::unexpected(text.error());
    if (*text) {
      if (late && !std::exchange(said_slow_, true)) {
        session_.say(
            fmt::format("the service answered after {} ms; after {} ms without an answer the force is zero",
                        waited_ns / 1'000'000, kDeadManNs / 1'000'000));
      }
      return take(**text);
    }
    if (waited_ns >= kAnswerPatienceNs)
      return std::unexpected(failure("the service does not answer any more"));
    if (!owes_zero) continue;
    if (auto ok = send({}, rt::monotonicNow_ns()); !ok) return ok;
  }
  return {};
}

base::Result<void> DrivenDevice::take(const std::string& text) {
  const Sent sent = sent_.front();
  sent_.pop_front();
  round_trip_.add(rt::monotonicNow_ns() - sent.time_ns);
  while (sent_.empty()) {
    auto unasked = link_.receive(std::chrono::nanoseconds(0));
    if (!unasked) return std::unexpected(unasked.error());
    if (!*unasked) break;
    // else an old state would pass for the answer to a new command
    if (++unasked_ > kMaxUnasked)
      return std::unexpected(failure("the service sends states that nobody asked for",
                                     "is --address that of its simulation channel?"));
  }
  const auto state = stateFrom(text, entry_.device_id);
  if (!state) return takeUseless(state.error());
  if (!isPossible(*state)) return takeUseless(StateFault::malformed);
  useless_in_a_row_ = 0;
  place_m_ = state->position_m;
  if (auto ok = report(watch_.takeState(*state)); !ok) return ok;
  const double speed = state->velocity_m_per_s ? norm(*state->velocity_m_per_s) : 0;
  echoed_n_ = state->echoed_force_n;
  check_.add(sent.force_n, echoed_n_, std::abs(entry_.filters.damping_scalar.value_or(0)) * speed);
  was_proven_ |= check_.verdict() == EchoCheck::Verdict::proven;
  rememberGrip(*state, sent.time_ns);
  publish(*state, sent.time_ns);
  return judgeEcho();
}

base::Result<void> DrivenDevice::takeUseless(StateFault fault) {
  ++useless_;
  if (++useless_in_a_row_ < kMaxUseless) return {};
  if (fault == StateFault::absent)
    return std::unexpected(failure("the service has the device no longer", "check its cable and power"));
  return std::unexpected(
      failure(fmt::format("{} states in a row could not be used: members are missing, are no finite numbers, "
                          "or jump farther than a hand moves",
                          useless_in_a_row_)));
}

bool DrivenDevice::isPossible(const DeviceState& state) const {
  if (norm(state.position_m) > kMaxReachM) return false;
  return !place_m_ || norm(state.position_m - *place_m_) <= kMaxStepM;
}

base::Result<void> DrivenDevice::judgeEcho() const {
  if (check_.verdict() == EchoCheck::Verdict::ignored) {
    return std::unexpected(
        failure(fmt::format("current_cursor_force is {} N and does not follow the forces that are written as "
                            "set_cursor_force.{}: no force",
                            vectorText(echoed_n_), nameOf(form_))));
  }
  if (check_.verdict() == EchoCheck::Verdict::pushes) {
    return std::unexpected(
        failure(fmt::format("current_cursor_force is {} N although zero is commanded", vectorText(echoed_n_)),
                "close other programs that drive the device"));
  }
  return {};
}

void DrivenDevice::rememberGrip(const DeviceState& state, std::int64_t now_ns) {
  if (state.orientation != orientation_ || state.buttons != buttons_) {
    // the first orientation of all may be old already
    grip_old_ = !orientation_ || !state.orientation;
    orientation_ = state.orientation;
    buttons_ = state.buttons;
    grip_changed_ns_ = now_ns;
  }
  if (now_ns - grip_changed_ns_ > kGripOldNs) grip_old_ = true;
}

void DrivenDevice::publish(const DeviceState& state, std::int64_t measured_ns) {
  DeviceReading reading;
  reading.position_m = state.position_m;
  reading.calibrated = watch_.calibrated();
  reading.fault = watch_.holds();
  if (!grip_old_) {
    reading.orientation = orientation_;
    reading.buttons = buttons_;
  }
  // the state is at most as old as its frame, and the next one takes effect within the round trip
  reading.latency_ns = round_trip_.ninetyFifthPercentileNs() + gateDelayEstimateNs(entry_.filters);
  session_.exchange().publish(reading, measured_ns);
}

void DrivenDevice::leave() {
  session_.exchange().close();  // at once, whatever the service does with the rest
  const auto sendAndWait = [this](const std::string& text) {
    if (!link_.send(text)) return;
    // answers to earlier frames come first
    for (std::size_t i = 0; i <= sent_.size(); ++i) {
      const auto answer = link_.receive(kLeavePatience);
      if (!answer || !*answer) return;
    }
    sent_.clear();
  };
  sendAndWait(writer_.force({}));
  sendAndWait(writer_.clear());
  link_.close();
}

}  // namespace hapticd::tools::inverse3
