// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/ros_bridge.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "rt/base/clock.h"
#include "tools/hapticd-ros/box/box_view.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/client/tick_batch.h"

namespace hapticd::tools::ros {
namespace {

constexpr std::int64_t kReportPeriod_ns = rt::kNsPerSecond;
/// What is older when it comes, after a standstill of this program or of hapticd, is of no use to anybody who
/// follows the box live.
constexpr std::int64_t kOldestTick_ns = 200'000'000;
constexpr int kPauseMs = 1000;

void say(const std::string& text) {
  fmt::print(stderr, "hapticd-ros: {}\n", text);
}

std::string textOf(const ClientError& error) {
  return error.remedy.empty() ? error.what : fmt::format("{} ({})", error.what, error.remedy);
}

}  // namespace

RosBridge::RosBridge(Publications& publications, BridgeOptions options, BoxState& box, StatusFile& status,
                     int interrupt)
    : publications_(publications),
      options_(std::move(options)),
      box_(box),
      status_(status),
      interrupt_(interrupt),
      world_frame_(framePrefix() + "world"),
      choice_(options_.rate_hz) {}

void RosBridge::run() {
  publishState(kBoxAbsent, rt::realtimeNow_ns());
  for (;;) {
    const auto failure = follow();
    if (!failure) return;
    beAbsent(*failure);
    if (!pause()) return;
  }
}

std::optional<ClientError> RosBridge::follow() {
  auto link = BoxLink::open(options_.socket, options_.rate_hz, interrupt_);
  if (!link) return link.error();
  messages_.restart();
  frames_.clear();
  next_report_ns_ = 0;
  const auto failure = followTicks(*link);
  ticks_lost_before_ += std::exchange(ticks_lost_now_, 0);
  if (failure && failure->kind == ClientError::Kind::interrupted) return std::nullopt;
  return failure;
}

std::optional<ClientError> RosBridge::followTicks(BoxLink& link) {
  for (;;) {
    const auto reply = link.nextTicks();
    if (!reply) return reply.error();
    box_.answers = true;
    if (std::exchange(box_was_said_absent_, false)) say("hapticd answers");
    takeBatch(*reply);
    if (const auto problem = publications_.takeProblem();
        problem && !std::exchange(write_problem_was_said_, true))
      say(problem->text());
    if (rt::monotonicNow_ns() < next_report_ns_) continue;
    next_report_ns_ = rt::monotonicNow_ns() + kReportPeriod_ns;
    if (auto failure = reportOncePerSecond(link)) return failure;
  }
}

void RosBridge::takeBatch(const Json& reply) {
  const double lost = numberAt(reply, "lostCount");
  if (lost >= 0 && lost < 1e18) ticks_lost_now_ = static_cast<std::uint64_t>(lost);
  utc_.measure();
  forEachTick(reply, [this](const rt::Tick& tick) { takeTick(tick); });
}

void RosBridge::takeTick(const rt::Tick& tick) {
  const OperatingState state = stateAt(tick);
  if (state != state_) publishState(state, utc_.utc_ns(tick.planned_ns));
  // not only in chosen ticks: a button may be held for less than a period of them
  if (const auto buttons = messages_.newButtons(tick)) {
    publications_.publish(Topic::buttons, [&](std::string& to) {
      encodeButtons(at(utc_.utc_ns(buttons->time_ns)), *buttons, to);
    });
  }
  if (!choice_.takes(tick.planned_ns)) return;
  if (rt::monotonicNow_ns() - tick.planned_ns > kOldestTick_ns) {
    ++counters_.ticks_late;
    return;
  }
  publishMotion(tick);
}

OperatingState RosBridge::stateAt(const rt::Tick& tick) {
  box_.mode = tick.mode;
  OperatingState state = operatingStateOf(tick);
  std::int64_t since_ns = box_.paused_since_ns;
  if (since_ns == 0) return state;
  if (tick.mode == rt::Mode::idle) {
    state.state = kPaused;
  } else if (tick.planned_ns >= since_ns) {
    box_.paused_since_ns.compare_exchange_strong(since_ns, 0);
  }
  return state;
}

void RosBridge::publishMotion(const rt::Tick& tick) {
  if (const auto force_n = commandedForce(tick)) {
    publications_.publish(Topic::setpoint_cf, [&](std::string& to) {
      encodeWrench(at(utc_.utc_ns(tick.planned_ns)), *force_n, {}, to);
    });
  }
  const auto measurement = messages_.newMeasurement(tick);
  if (!measurement) return;
  const trace::ros::Header header = at(utc_.utc_ns(measurement->time_ns));
  publications_.publish(Topic::measured_cp,
                        [&](std::string& to) { encodePose(header, measurement->T_world_tool, to); });
  publications_.publish(Topic::measured_cv, [&](std::string& to) {
    encodeVelocity(header, measurement->velocity_m_per_s_in_world, to);
  });
}

void RosBridge::publishState(const OperatingState& state, std::int64_t utc_ns) {
  state_ = state;
  publications_.publish(Topic::operating_state, [&](std::string& to) { encodeState(at(utc_ns), state, to); });
}

std::optional<ClientError> RosBridge::reportOncePerSecond(BoxLink& link) {
  const auto status = link.call("GetStatus");
  if (!status) return status.error();
  const Json* const content = fieldAt(*status, "status");
  publishDiagnostics(content != nullptr ? *content : Json::object(), "");
  const auto calibration = link.call("GetCalibration");
  if (!calibration) return calibration.error();
  const auto parameters = link.call("GetParameters", handleFrameParameters());
  if (!parameters) return parameters.error();
  publishFrames(*calibration, *parameters);
  status_.write();
  return std::nullopt;
}

void RosBridge::publishDiagnostics(const Json& status, const std::string& problem) {
  counters_.messages = publications_.written();
  counters_.messages_failed = publications_.failed();
  counters_.ticks_lost = ticks_lost_before_ + ticks_lost_now_;
  const auto parts = diagnosticsOf(status, problem, counters_, options_.name_space);
  publications_.publish(Topic::diagnostics, [&](std::string& to) {
    encodeDiagnostics({rt::realtimeNow_ns(), ""}, parts, to);
  });
}

void RosBridge::publishFrames(const Json& calibration, const Json& parameters) {
  std::vector<trace::ros::FixedFrame> frames = fixedFrames(calibration, parameters, framePrefix());
  if (frames.empty() || frames == frames_) return;
  frames_ = std::move(frames);
  publications_.publish(Topic::tf_static,
                        [&](std::string& to) { encodeFrames(rt::realtimeNow_ns(), frames_, to); });
}

void RosBridge::beAbsent(const ClientError& reason) {
  box_.answers = false;
  box_.mode = rt::Mode::starting;
  box_.paused_since_ns = 0;
  if (state_ != kBoxAbsent) publishState(kBoxAbsent, rt::realtimeNow_ns());
  publishDiagnostics(Json(), reason.what);
  status_.write();
  if (std::exchange(box_was_said_absent_, true)) return;
  say(fmt::format("waiting for hapticd: {}", textOf(reason)));
}

bool RosBridge::pause() const {
  pollfd interrupt{interrupt_, POLLIN, 0};
  return ::poll(&interrupt, 1, kPauseMs) <= 0;
}

}  // namespace hapticd::tools::ros
