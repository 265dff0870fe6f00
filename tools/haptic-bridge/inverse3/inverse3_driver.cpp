// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "config/base/value_text.h"
#include "drivers/handle/udp/conversation.h"
#include "rt/base/clock.h"
#include "tools/haptic-bridge/base/device_rows.h"
#include "tools/haptic-bridge/inverse3/service_link.h"
#include "tools/haptic-bridge/inverse3/service_messages.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools::inverse3 {
namespace {

constexpr const char* kUsualAddress = "127.0.0.1:10001";
/// From the port of the simulation channel, 10001, to that of the events, 10020.
constexpr int kEventPortStep = 19;
constexpr std::chrono::milliseconds kOpenPatience{2000};
constexpr std::chrono::milliseconds kEventPatience{500};

base::Error failure(const std::string& what, const std::string& remedy = "") {
  return {"Inverse3", what, remedy};
}

std::string numberOr(const std::optional<double>& number) {
  return number ? base::numberText(*number) : "not stated";
}

std::string textOr(const std::string& text) {
  return text.empty() ? "not stated" : base::printable(text);
}

/// What the person has to know about what the service does to forces and positions.
void sayFilters(DeviceSession& session, const ServiceFilters& filters) {
  const std::string gravity = !filters.gravity_compensation ? "not stated"
                              : *filters.gravity_compensation
                                  ? "on, scaled by " + numberOr(filters.gravity_scaling)
                                  : "off";
  session.say(fmt::format("filters of the service: force gate, gain {}; damping {}; gravity compensation {}",
                          numberOr(filters.force_gate_gain), numberOr(filters.damping_scalar), gravity));
  session.say(fmt::format("settings of the service: handedness {}, preset {}, basis {}{}",
                          textOr(filters.handedness), textOr(filters.preset), textOr(filters.basis),
                          filters.displaced ? "; a transform of the service moves or turns positions" : ""));
  if (const std::int64_t delay_ns = gateDelayEstimateNs(filters); delay_ns > 0) {
    session.say(
        fmt::format("the force gate counts as {:.1f} ms of delay: an estimate, nobody has measured it",
                    static_cast<double>(delay_ns) * 1e-6));
  }
}

base::Result<InventoryEntry> chosenFrom(const std::vector<InventoryEntry>& entries,
                                        const std::string& device_id) {
  if (entries.empty())
    return std::unexpected(failure("the service has no Inverse3", "connect it and switch it on"));
  if (device_id.empty()) return entries.front();
  const auto found = std::ranges::find(entries, device_id, &InventoryEntry::device_id);
  if (found != entries.end()) return *found;
  std::string others;
  for (const InventoryEntry& entry : entries)
    others += (others.empty() ? "" : ", ") + base::inQuotes(entry.device_id);
  return std::unexpected(
      failure(fmt::format("the service has no device {}, but {}", base::inQuotes(device_id), others),
              "--device names one of them"));
}

base::Result<InventoryEntry> inventoryOf(ServiceLink& link, const std::string& device_id,
                                         const GivesUp& gives_up) {
  const auto deadline = std::chrono::steady_clock::now() + kOpenPatience;
  while (!gives_up() && std::chrono::steady_clock::now() < deadline) {
    auto text = link.receive(std::chrono::milliseconds(20));
    if (!text) return std::unexpected(text.error());
    if (!*text) continue;
    auto entries = inventoryFrom(**text);
    if (!entries) return std::unexpected(entries.error());
    return chosenFrom(*entries, device_id);
  }
  return std::unexpected(failure("the service does not list its devices", ""));
}

std::optional<ServiceLink> eventChannelOf(const ServiceEndpoint& endpoint, DeviceSession& session,
                                          const GivesUp& gives_up) {
  const int port = endpoint.port + kEventPortStep;
  if (port > std::numeric_limits<std::uint16_t>::max()) return std::nullopt;
  auto events =
      ServiceLink::open({endpoint.address, static_cast<std::uint16_t>(port)}, kEventPatience, gives_up);
  if (events) return std::move(*events);
  session.say(fmt::format("no event channel at port {}: causes of faults are not named", port));
  return std::nullopt;
}

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

std::string vectorText(const rt::Vec3& vector) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", vector.x, vector.y, vector.z);
}

/// One device of the service, from the first frame with zero force to the last one. Thread: one.
class DrivenDevice {
 public:
  static constexpr std::int64_t kTickNs = 1'000'000;

  /// `events`: nothing: the service has no event channel. All references outlive this.
  DrivenDevice(DeviceSession& session, ServiceLink& link, std::optional<ServiceLink>& events,
               const InventoryEntry& entry, KeyForm form)
      : session_(session),
        link_(link),
        events_(events),
        entry_(entry),
        form_(form),
        writer_(entry.device_id, form),
        limit_n_(forceLimitOf(entry.type)),
        watch_(entry.device_id) {}

  /// Sends zero force and a clear, and closes the link.
  ~DrivenDevice() {
    leave();
    if (useless_ > 0) session_.say(fmt::format("{} states of the device could not be used", useless_));
  }
  DrivenDevice(const DrivenDevice&) = delete;
  DrivenDevice& operator=(const DrivenDevice&) = delete;

  /// Commands zero until the service has shown that it exerts nothing.  Errors: it exerts something, or the
  /// device was lost.
  base::Result<void> begin() {
    int ticks = 0;
    if (auto ok = tickUntil([&] { return check_.isQuiet() || ++ticks > kMaxTicksUntilQuiet; }); !ok)
      return ok;
    if (check_.isQuiet() || session_.ends()) return {};
    return std::unexpected(
        failure(fmt::format("current_cursor_force is {} N although zero is commanded", vectorText(echoed_n_)),
                "close other programs that drive the device"));
  }

  /// Drives the device until the session ends.  Errors: why it cannot be used any longer.
  base::Result<void> run() {
    return tickUntil([] { return false; });
  }

  /// Whether the service has ignored all forces in this form.
  bool ignoresForces() const { return check_.verdict() == EchoCheck::Verdict::ignored && !was_proven_; }

 private:
  struct Sent {
    std::int64_t time_ns = 0;
    rt::Vec3 force_n;
  };

  template <typename Done>
  base::Result<void> tickUntil(Done done) {
    rt::PeriodicClock clock(kTickNs);
    clock.start(rt::monotonicNow_ns());
    while (!session_.ends() && !done()) {
      rt::sleepUntil(clock.planned_ns());
      if (auto ok = tick(rt::monotonicNow_ns()); !ok) return ok;
      clock.advance(rt::monotonicNow_ns());
    }
    return {};
  }

  base::Result<void> tick(std::int64_t now_ns) {
    if (auto ok = hearEvents(); !ok) return ok;
    // one frame at a time: the service answers each, and what is queued only becomes old
    if (sent_.empty()) {
      if (auto ok = send(forceAt(now_ns), now_ns); !ok) return ok;
    }
    return hearAnswer();
  }

  base::Result<void> hearEvents() {
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

  rt::Vec3 forceAt(std::int64_t now_ns) {
    const DeviceCommand command = session_.exchange().commandAt(now_ns);
    if (watch_.holds() || !watch_.calibrated() || useless_in_a_row_ > 0) return {};
    return boundedForce(command.force_n, check_.most_n(limit_n_));
  }

  base::Result<void> send(const rt::Vec3& force_n, std::int64_t now_ns) {
    sent_.push_back({now_ns, force_n});
    return link_.send(writer_.force(force_n));
  }

  /// Waits for one answer. When none comes for the time of the dead man, the service gets a zero force,
  /// because nobody knows how long it keeps the last one. What has arrived meanwhile is taken before that, or
  /// a computer that is late at each tick would command zero for ever.
  base::Result<void> hearAnswer() {
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

  base::Result<void> take(const std::string& text) {
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

  base::Result<void> takeUseless(StateFault fault) {
    ++useless_;
    if (++useless_in_a_row_ < kMaxUseless) return {};
    if (fault == StateFault::absent)
      return std::unexpected(failure("the service has the device no longer", "check its cable and power"));
    return std::unexpected(failure(
        fmt::format("{} states in a row could not be used: members are missing, are no finite numbers, "
                    "or jump farther than a hand moves",
                    useless_in_a_row_)));
  }

  bool isPossible(const DeviceState& state) const {
    if (norm(state.position_m) > kMaxReachM) return false;
    return !place_m_ || norm(state.position_m - *place_m_) <= kMaxStepM;
  }

  base::Result<void> judgeEcho() const {
    if (check_.verdict() == EchoCheck::Verdict::ignored) {
      return std::unexpected(failure(
          fmt::format("current_cursor_force is {} N and does not follow the forces that are written as "
                      "set_cursor_force.{}: no force",
                      vectorText(echoed_n_), nameOf(form_))));
    }
    if (check_.verdict() == EchoCheck::Verdict::pushes) {
      return std::unexpected(failure(
          fmt::format("current_cursor_force is {} N although zero is commanded", vectorText(echoed_n_)),
          "close other programs that drive the device"));
    }
    return {};
  }

  void publish(const DeviceState& state, std::int64_t measured_ns) {
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

  void rememberGrip(const DeviceState& state, std::int64_t now_ns) {
    if (state.orientation != orientation_ || state.buttons != buttons_) {
      // the first orientation of all may be old already
      grip_old_ = !orientation_ || !state.orientation;
      orientation_ = state.orientation;
      buttons_ = state.buttons;
      grip_changed_ns_ = now_ns;
    }
    if (now_ns - grip_changed_ns_ > kGripOldNs) grip_old_ = true;
  }

  base::Result<void> report(const Finding& finding) {
    if (finding.ends) return std::unexpected(failure(finding.text));
    if (!finding.text.empty()) session_.say(finding.text);
    return {};
  }

  void leave() {
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

  DeviceSession& session_;
  ServiceLink& link_;
  std::optional<ServiceLink>& events_;
  InventoryEntry entry_;
  KeyForm form_;
  FrameWriter writer_;
  double limit_n_;
  SafetyWatch watch_;
  EchoCheck check_;
  bool was_proven_ = false;
  drivers::udp::DelayEstimate round_trip_;
  std::deque<Sent> sent_;  // without an answer yet
  rt::Vec3 echoed_n_;
  bool said_slow_ = false;
  int useless_in_a_row_ = 0;
  std::uint64_t useless_ = 0;
  std::uint64_t unasked_ = 0;
  std::optional<rt::Vec3> place_m_;  // of the last state
  std::optional<rt::Quaternion> orientation_;
  std::uint32_t buttons_ = 0;
  std::int64_t grip_changed_ns_ = 0;
  bool grip_old_ = true;
};

/// Haply's Inverse3 behind the Inverse Service of its vendor. The form in which a force is written follows
/// from the service's version; where the service ignores it, the other one is tried once, and none after
/// that.
class Inverse3Driver final : public DeviceDriver {
 public:
  /// `options.address`: empty: 127.0.0.1:10001. `options.device`: a device_id.
  explicit Inverse3Driver(const VendorOptions& options) : options_(options) {}

  base::Result<void> drive(DeviceSession& session) override {
    auto driven = driveOnce(session);
    if (session.ends()) return {};  // what was given up for it is no fault
    return driven;
  }

 private:
  base::Result<void> driveOnce(DeviceSession& session) {
    const GivesUp gives_up = [&session] { return session.ends(); };
    const auto endpoint = serviceEndpointFrom(options_.address.empty() ? kUsualAddress : options_.address);
    if (!endpoint) return std::unexpected(endpoint.error());
    const auto body = httpGet(*endpoint, "/version", kOpenPatience, gives_up);
    if (!body) return std::unexpected(body.error());
    const auto version = versionFrom(*body);
    if (!version) return std::unexpected(version.error());
    if (std::exchange(version_, version->text) != version->text) {
      ignored_.reset();
      both_ignored_ = false;
    }
    const auto form = formToUse(*version);
    if (!form) return std::unexpected(form.error());

    auto link = ServiceLink::open(*endpoint, kOpenPatience, gives_up);
    if (!link) return std::unexpected(link.error());
    const auto entry = inventoryOf(*link, options_.device, gives_up);
    if (!entry) return std::unexpected(entry.error());
    if (entry->filters.scaled) {
      return std::unexpected(failure("a transform of the service scales positions: forces would not fit them",
                                     "set the scale of transform and mount to 1"));
    }
    auto events = eventChannelOf(*endpoint, session, gives_up);

    session.say(fmt::format("Inverse Service {}, forces written as `{}`", base::inQuotes(version->text),
                            nameOf(*form)));
    sayFilters(session, entry->filters);
    DrivenDevice device(session, *link, events, *entry, *form);
    if (auto ok = device.begin(); !ok) return ok;
    if (session.ends()) return {};
    session.opened({.model = entry->type.empty() ? "inverse3" : base::printable(entry->type),
                    .serial = base::printable(entry->device_id),
                    .limits = {.force_n = forceLimitOf(entry->type)}});
    auto driven = device.run();
    if (device.ignoresForces()) {
      both_ignored_ = ignored_.has_value();
      ignored_ = *form;
    }
    return driven;
  }

  base::Result<KeyForm> formToUse(const ServiceVersion& version) const {
    if (both_ignored_) {
      return std::unexpected(
          failure(fmt::format("the service, version {}, ignores forces written as `vector` and as `values`",
                              base::inQuotes(version.text)),
                  "report this version; hapticd exerts nothing that it cannot check"));
    }
    auto form = keyFormOf(version);
    if (!form || !ignored_) return form;
    return otherThan(*ignored_);
  }

  VendorOptions options_;
  std::string version_;             ///< of the service for which these hold
  std::optional<KeyForm> ignored_;  ///< by the service
  bool both_ignored_ = false;
};

}  // namespace

std::unique_ptr<DeviceDriver> makeInverse3Driver(const VendorOptions& options) {
  return std::make_unique<Inverse3Driver>(options);
}

}  // namespace hapticd::tools::inverse3
