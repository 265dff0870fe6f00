// SPDX-License-Identifier: Apache-2.0
#include "daemon/event_log.h"

#include <fmt/format.h>

#include <cctype>
#include <utility>

#include "config/base/counted.h"
#include "daemon/base/journal_entry.h"

namespace hapticd::daemon {
namespace {

using Priority = JournalEntry::Priority;
using config::EventKind;

constexpr int kModesPerSecond = 10;

Priority priorityOf(rt::Mode mode) {
  if (mode == rt::Mode::faulted) return Priority::error;
  return mode == rt::Mode::holding ? Priority::warning : Priority::notice;
}

std::string withoutNumbers(std::string text) {
  std::erase_if(text, [](unsigned char c) { return std::isdigit(c) != 0; });
  return text;
}

std::string withDetail(std::string text, const std::string& detail) {
  return detail.empty() ? text : text + ": " + detail;
}

}  // namespace

void EventLog::onTick(const rt::Tick& tick, Clock::time_point now) {
  if (tick.mode == mode_ && tick.cause == cause_) return;
  mode_ = tick.mode;
  cause_ = tick.cause;
  logMode(tick, now);
}

void EventLog::logMode(const rt::Tick& tick, Clock::time_point now) {
  if (now - second_ >= std::chrono::seconds(1)) {
    second_ = now;
    logged_ = 0;
    if (unlogged_ > 0) {
      write_({Priority::warning,
              fmt::format("{} changes of mode were not logged", std::exchange(unlogged_, 0))});
    }
  }
  if (++logged_ > kModesPerSecond) {
    ++unlogged_;
    return;
  }
  write_({priorityOf(tick.mode),
          fmt::format("{} ({})", nameOf(tick.mode), nameOf(tick.cause)),
          EventKind::mode,
          {{"MODE", nameOf(tick.mode)}, {"CAUSE", nameOf(tick.cause)}}});
}

void EventLog::onStatus(const BoxStatus& status) {
  if (const auto state = status.camera.state; state != camera_) {
    camera_ = state;
    write_({state == drivers::CameraState::streaming ? Priority::notice : Priority::warning,
            withDetail(fmt::format("camera {} ({})", nameOf(state), status.camera.identity),
                       status.camera.detail),
            EventKind::camera,
            {{"CAMERA", nameOf(state)}, {"DEVICE", status.camera.identity}}});
  }
  if (const auto state = status.handle.state; state != handle_) {
    handle_ = state;
    write_({state == drivers::HandlePresence::present ? Priority::notice : Priority::warning,
            withDetail(fmt::format("handle {} ({})", nameOf(state), status.handle.identity),
                       status.handle.detail),
            EventKind::handle,
            {{"HANDLE", nameOf(state)}, {"DEVICE", status.handle.identity}}});
  }
  logBreaches(status);
  logFrames(status.frames);
  logTrace(status.trace);
  logWarnings(status.warnings);
}

/// A breach is known by when it began, because a fixture that is removed and added again counts anew.
void EventLog::logBreaches(const BoxStatus& status) {
  for (const FixtureConduct& fixture : status.fixtures.each) {
    const rt::Breach& breach = fixture.breach;
    std::int64_t& logged_ns = breaches_[fixture.name];
    if (breach.number == 0 || breach.entered_ns <= logged_ns) continue;
    logged_ns = breach.entered_ns;
    const rt::Vec3& place = breach.entered_m_in_world;
    const double age_s = static_cast<double>(status.loop.state.tick.planned_ns - breach.entered_ns) * 1e-9;
    write_(
        {Priority::info,
         fmt::format(
             "the HIP was in the forbidden region of fixture {} for {:.2f} s, at most {:.1f} mm deep, with "
             "at most {:.3f} m/s and {:.2f} N; it entered {:.1f} s ago with {:.3f} m/s at ({:.4f}, {:.4f}, "
             "{:.4f}) m in the world",
             fixture.name, breach.duration_s, breach.depth_m * 1e3, breach.speed_m_per_s, breach.force_n,
             age_s, breach.entry_m_per_s, place.x, place.y, place.z),
         EventKind::breach,
         {{"FIXTURE", fixture.name},
          {"ENTERED_AGE_S", fmt::format("{:.3f}", age_s)},
          {"ENTERED_M", fmt::format("{:.5f} {:.5f} {:.5f}", place.x, place.y, place.z)},
          {"DURATION_S", fmt::format("{:.3f}", breach.duration_s)},
          {"DEPTH_M", fmt::format("{:.5f}", breach.depth_m)},
          {"ENTRY_SPEED_M_PER_S", fmt::format("{:.4f}", breach.entry_m_per_s)},
          {"SPEED_M_PER_S", fmt::format("{:.4f}", breach.speed_m_per_s)},
          {"FORCE_N", fmt::format("{:.3f}", breach.force_n)}}});
  }
}

/// A frame that was removed and added again counts anew.
void EventLog::logFrames(const std::vector<FrameStatus>& frames) {
  for (const FrameStatus& frame : frames) {
    SeenFrame& seen = frames_[frame.name];
    const auto log = [&](Priority priority, std::string text, const char* action) {
      write_({priority,
              std::move(text),
              EventKind::frame,
              {{"FRAME", frame.name}, {"ACTION", action}, {"STATE", nameOf(frame.state)}}});
    };
    if (frame.losses > seen.losses) {
      log(Priority::warning,
          fmt::format("frame {} is lost: its poses are {}", frame.name,
                      frame.refusal ? fmt::format("refused: {}", reasonOf(*frame.refusal)) : "missing"),
          "lost");
    }
    if (frame.relocations > seen.relocations) {
      log(Priority::notice,
          fmt::format("frame {} has jumped: three poses agree on its new place, and it goes there slowly",
                      frame.name),
          "relocated");
    }
    if (frame.returns > seen.returns) {
      log(Priority::notice,
          fmt::format("frame {} {}", frame.name, frame.returns == 1 ? "has its first place" : "is back"),
          "found");
    }
    seen = {frame.losses, frame.returns, frame.relocations};
  }
}

void EventLog::logWarnings(const std::vector<std::string>& warnings) {
  std::map<std::string, std::string> now;
  for (const std::string& warning : warnings) now.emplace(withoutNumbers(warning), warning);
  for (const auto& [key, text] : warnings_) {
    if (now.contains(key)) continue;
    write_({Priority::notice, "resolved: " + text, EventKind::warning, {{"STATE", "end"}}});
  }
  for (const auto& [key, text] : now) {
    if (warnings_.contains(key)) continue;
    write_({Priority::warning, text, EventKind::warning, {{"STATE", "begin"}}});
  }
  warnings_ = std::move(now);
}

void EventLog::logTrace(const TraceStatus& trace) {
  const auto log = [&](Priority priority, std::string text, const std::string& name) {
    write_({priority, std::move(text), EventKind::trace, {{"TRACE", name}}});
  };
  if (trace.state == TraceState::writing && trace.name != trace_.name) {
    log(Priority::notice, fmt::format("trace {} is written", trace.name), trace.name);
  } else if (trace.state == TraceState::waiting && trace_.state != TraceState::waiting) {
    log(Priority::error, "the trace waits: " + trace.detail, trace_.name);
  } else if (trace.state == TraceState::off && trace_.state != TraceState::off) {
    log(Priority::notice, fmt::format("trace {} has ended", trace_.name), trace_.name);
  }
  if (trace.last_dump != trace_.last_dump) {
    log(Priority::notice, fmt::format("flight recorder written to {}", trace.last_dump), trace.last_dump);
  }
  if (trace.recovered != trace_.recovered) {
    log(Priority::warning,
        fmt::format("finished after a crash: {}", base::counted(trace.recovered, "trace(s)")), "");
  }
  for (const TraceNews& news : trace.news) {
    if (news.number <= trace_news_) continue;
    trace_news_ = news.number;
    write_({news.warning ? Priority::warning : Priority::notice,
            news.text,
            EventKind::trace,
            {{"ACTION", news.action}, {"TRACE", news.trace}}});
  }
  trace_ = trace;
}

}  // namespace hapticd::daemon
