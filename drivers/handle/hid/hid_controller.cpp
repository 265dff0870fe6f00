// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/hid_controller.h"

#include <fmt/format.h>

#include <algorithm>

#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

/// A sequence number farther ahead than this, or farther behind than the kernel's queue of 64 reports, starts
/// a new count.
constexpr std::int32_t kFarthestAhead = 1000;
constexpr std::int32_t kFarthestBehind = 64;

constexpr double kMaxDelayS = 0.1;
constexpr double kDelaySmoothing = 1.0 / 32;

constexpr const char* kWaiting = "opened, but it has not sent a valid report yet";

}  // namespace

void HidController::opened(std::int64_t now_ns) {
  in_session_ = false;
  last_valid_ns_ = now_ns;
  last_refusal_.reset();
  if (presence_ != HandlePresence::absent) presence_ = HandlePresence::lost;
  detail_ = kWaiting;
}

void HidController::lose(std::string detail) {
  in_session_ = false;
  if (presence_ != HandlePresence::absent) presence_ = HandlePresence::lost;
  detail_ = std::move(detail);
}

std::optional<rt::HandleState> HidController::take(ReportBytes report, std::int64_t arrival_ns) {
  const auto input = inputFrom(report);
  if (!input) {
    ++link_.rejected;
    last_refusal_ = input.error();
    idle(arrival_ns);
    return std::nullopt;
  }
  if (in_session_ && !isNext(input->sequence)) return std::nullopt;
  ++link_.received;
  last_valid_ns_ = arrival_ns;
  last_refusal_.reset();
  if (input->fault_code != 0) {
    presence_ = HandlePresence::lost;
    lose(fmt::format("it reports the fault {} (see its own manual)", input->fault_code));
    return std::nullopt;
  }
  if (!in_session_) beginSession(*input);
  measureRoundTrip(*input, arrival_ns);
  return publish(*input, arrival_ns);
}

void HidController::idle(std::int64_t now_ns) {
  if (now_ns - last_valid_ns_ <= kSilenceNs) return;
  if (last_refusal_) {
    lose(
        fmt::format("its reports are rejected: they are {} (load firmware that sends those of "
                    "hid-reports.md, /usr/share/doc/hapticd)",
                    textOf(*last_refusal_)));
  } else if (in_session_) {
    lose("it is connected but sends no reports (reset it, or unplug it and plug it in again)");
  }
}

/// Checks the sequence number of a report within a session; returns false if the report is to be ignored.
bool HidController::isNext(std::uint32_t sequence) {
  const auto step = static_cast<std::int32_t>(sequence - last_input_);
  if (step == 0) {
    ++link_.duplicated;
    return false;
  }
  if (step < 0 && step >= -kFarthestBehind) {
    ++link_.reordered;
    return false;
  }
  if (step < 0 || step > kFarthestAhead) {
    in_session_ = false;  // the device was reset
    return true;
  }
  link_.lost += static_cast<std::uint64_t>(step - 1);
  return true;
}

void HidController::beginSession(const InputReport& input) {
  in_session_ = true;
  frame_.beginSession();
  clock_.reset();
  last_echo_ = input.echo;
  delay_s_ = kUnmeasuredDelayS;
}

rt::HandleState HidController::publish(const InputReport& input, std::int64_t arrival_ns) {
  last_input_ = input.sequence;
  calibrated_ = input.calibrated && !input.homing;
  presence_ = calibrated_ ? HandlePresence::present : HandlePresence::calibrating;
  detail_ = calibrated_ ? ""
            : input.homing
                ? "it is homing (do not touch it until it has finished)"
                : "its position is not known yet (move it to its reference position, see its manual)";
  ++measurements_;
  HandleMeasurement measurement;
  measurement.position_m_in_handle = input.position_m;
  measurement.time_ns = clock_.timeOf(input.time_us, arrival_ns);
  measurement.buttons = input.buttons;
  measurement.calibrated = calibrated_;
  measurement.velocity_m_per_s_in_handle = input.velocity_m_per_s;
  measurement.delay_s = delay_s_;
  measurement.command_latency_ns = gate_.latency_ns();
  return frame_.stateOf(measurement);
}

/// Measures the time from writing an output to reading its echo, minus the time that it spent in the device.
/// This round trip is also the delay between a motion and the force that responds to it.
void HidController::measureRoundTrip(const InputReport& input, std::int64_t arrival_ns) {
  if (input.echo == last_echo_) return;
  last_echo_ = input.echo;
  const Sent& sent = sent_[input.echo % kRemembered];
  const std::int64_t round_trip_ns = arrival_ns - sent.time_ns - std::int64_t{1000} * input.echo_age_us;
  if (input.echo == 0 || sent.sequence != input.echo || round_trip_ns < 0) return;
  round_trips_.add(round_trip_ns);
  const double seconds = static_cast<double>(round_trip_ns) / static_cast<double>(rt::kNsPerSecond);
  delay_s_ += kDelaySmoothing * (std::min(seconds, kMaxDelayS) - delay_s_);
}

Report HidController::answer(const rt::HandleCommand& command, std::int64_t now_ns) {
  const auto force_n_in_world = gate_.pass(command, frame_.session(), now_ns);
  const bool exert = force_n_in_world && in_session_ && calibrated_;
  return output(exert, exert ? frame_.forceInHandle(*force_n_in_world) : rt::Vec3{}, now_ns);
}

Report HidController::farewell(std::int64_t now_ns) {
  return output(false, {}, now_ns);
}

Report HidController::output(bool exert, const rt::Vec3& force_n, std::int64_t now_ns) {
  if (++output_sequence_ == 0) ++output_sequence_;
  sent_[output_sequence_ % kRemembered] = {output_sequence_, now_ns};
  ++link_.sent;
  return encode(OutputReport{exert, output_sequence_, force_n});
}

LinkStatus HidController::link() const {
  LinkStatus link = link_;
  link.round_trip = rt::summaryOf(round_trips_);
  return link;
}

}  // namespace hapticd::drivers
