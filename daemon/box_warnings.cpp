// SPDX-License-Identifier: Apache-2.0
#include "daemon/box_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "config/settings/cause_text.h"
#include "daemon/base/journal_entry.h"
#include "drivers/base/cpus.h"
#include "rt/laws/law_table.h"
#include "rt/safety/hidden_latency.h"
#include "rt/safety/stiffness_limit.h"

namespace hapticd::daemon {
namespace {

drivers::CpuSet isolatedCpus(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string list;
  std::getline(stream, list);
  return drivers::parseCpuList(list).value_or(drivers::CpuSet{});
}

}  // namespace

int lastIsolatedCpu(const std::filesystem::path& file) {
  const drivers::CpuSet cpus = isolatedCpus(file);
  return cpus.empty() ? -1 : *cpus.rbegin();
}

bool isIsolated(int cpu, const std::filesystem::path& file) {
  return isolatedCpus(file).contains(cpu);
}

std::optional<std::uint64_t> pageFaultsOf(pid_t thread_id) {
  std::ifstream file(fmt::format("/proc/self/task/{}/stat", thread_id));
  std::string line;
  if (!std::getline(file, line)) return std::nullopt;
  // The second field, the thread's name, is in parentheses and may contain any character.
  std::istringstream fields(line.substr(line.rfind(')') + 1));
  std::string skipped;
  for (int field = 3; field < 10; ++field) fields >> skipped;
  std::uint64_t minor = 0;
  std::uint64_t minor_of_children = 0;
  std::uint64_t major = 0;
  if (!(fields >> minor >> minor_of_children >> major)) return std::nullopt;
  return minor + major;
}

namespace {

constexpr std::int64_t kSamplePeriod_ns = 1'000'000'000;
constexpr std::int64_t kWindow_ns = 60 * kSamplePeriod_ns;

// One late tick in 10 000 is one every ten seconds at 1 kHz, which a hand hardly ever meets while in contact.
constexpr double kLateShare = 1e-4;
/// Up to this many late ticks do not count: they are from the start, when memory and caches are cold.
constexpr std::uint64_t kFewLateTicks = 3;
// Half a percent of a second without ticks, 5 of 1000, is no rounding.
constexpr double kSkippedShare = 0.005;

double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

void LatenessWatch::follow(const rt::LoopCounters& counters, std::int64_t time_ns) {
  if (!samples_.empty() && time_ns - samples_.back().time_ns < kSamplePeriod_ns) return;
  samples_.push_back({time_ns, counters.ticks, counters.overruns, counters.skipped_periods});
  while (samples_.size() > 2 && time_ns - samples_[1].time_ns >= kWindow_ns) samples_.pop_front();
  judge();
}

void LatenessWatch::judge() {
  const Sample& first = samples_.front();
  const Sample& last = samples_.back();
  lateness_ = {false, last.ticks - first.ticks, last.late_ticks - first.late_ticks,
               last.skipped_periods - first.skipped_periods};
  const auto skips = [](const Sample& before, const Sample& after) {
    const std::uint64_t skipped = after.skipped_periods - before.skipped_periods;
    return share(skipped, after.ticks - before.ticks + skipped) > kSkippedShare;
  };
  const bool ends_late =
      lateness_.late_ticks > kFewLateTicks && share(lateness_.late_ticks, lateness_.ticks) > kLateShare;
  lateness_.late = ends_late || std::ranges::adjacent_find(samples_, skips) != samples_.end();
}

namespace {

using Warnings = std::vector<std::string>;

void addFault(const rt::Tick& tick, Warnings& list) {
  if (tick.mode != rt::Mode::faulted) return;
  list.push_back(fmt::format("faulted: {} (correct the cause, then: hapticctl clear-fault)",
                             config::textOf(tick.cause)));
}

/// Adds a warning while springs wait for the hand to leave them (rt::LawEntry): of a law without a proxy the
/// state of contact, which says so of the others, is not known.
void addWaitingLaw(const rt::Tick& tick, Warnings& list) {
  const bool waits = tick.mode == rt::Mode::engaged && !rt::rowOf(tick.law).has_proxy &&
                     tick.points_used > 0 && tick.depth_share > 0 && norm(tick.law_force_n_in_world) == 0;
  if (!waits) return;
  list.push_back(
      fmt::format("the law {} exerts nothing, because the hand was inside the surface when a pause of the "
                  "force ended (move the hand out of it, or disengage and engage)",
                  rt::wordOf(tick.law)));
}

void addCamera(const drivers::CameraStatus& camera, Warnings& list) {
  const bool is_looking = camera.state == drivers::CameraState::absent && camera.detail.empty();
  if (camera.state != drivers::CameraState::streaming && !is_looking) {
    list.push_back(fmt::format("camera {}: {}", nameOf(camera.state), camera.detail));
  }
  if (!camera.advice.empty()) list.push_back("camera: " + camera.advice);
}

/// Adds a warning if the set stiffness is above the one that can be rendered stably.
void addStiffness(const rt::Tick& tick, const WarningSources& sources, Warnings& list) {
  const rt::LiveParameters& live = sources.live;
  const double stiffness = live.force.stiffness_n_per_m;
  if (live.safety.stiffness_limit == rt::StiffnessLimit::off) return;
  if (tick.stiffness_limit_n_per_m <= 0 || stiffness <= tick.stiffness_limit_n_per_m) return;
  const bool by_mass = tick.stiffness_rule == rt::StiffnessRule::mass;
  const bool reduced = live.safety.stiffness_limit == rt::StiffnessLimit::reduce;
  list.push_back(fmt::format(
      "force.stiffness_n_per_m is {:.0f}, and {} lets {:.0f} be stable{} (shorten the delay, {}lower the "
      "stiffness)",
      stiffness,
      by_mass ? fmt::format("the delay of the handle with a device of {:g} kg",
                            sources.settings.handle.effectiveDeviceMass_kg())
              : "the delay of the handle",
      tick.stiffness_limit_n_per_m, reduced ? ": the force is reduced to that" : "",
      by_mass ? "set handle.device_mass_kg if the device is heavier, or " : "or "));
}

/// Adds warnings about a device that does not do what it says.
void addClaims(const rt::LoopState& loop, const WarningSources& sources, Warnings& list) {
  const rt::Tick& tick = loop.tick;
  const rt::VelocityClaim claim = tick.handle.velocity_claim;
  if (claim == rt::VelocityClaim::distrusted || claim == rt::VelocityClaim::contradicted) {
    list.emplace_back(
        "the handle reports a velocity that its positions contradict (correct its unit, sign and timing, or "
        "let the device or its bridge claim none)");
  }
  constexpr double kNotable_s = 0.003;
  const bool unknown =
      tick.handle.probes && loop.latency.number >= rt::HiddenLatency::kMaxTries && !loop.latency.conclusive;
  if (unknown) {
    list.emplace_back(
        "the device did not move as hapticd knocked at it, so how late forces act is not known, and the "
        "stiffness is limited as if they acted 60 ms late (switch its motors on and hold it lightly: hapticd "
        "knocks again every 5 s while engaged; or set handle.device_latency_s and switch "
        "handle.measure_latency off)");
  } else if (tick.hidden_latency_s > kNotable_s) {
    list.push_back(
        fmt::format("forces act {:.0f} ms later than the handle's driver can tell, which lowers the largest "
                    "stiffness (shorten what delays them, or add this to handle.device_latency_s if it is "
                    "known and constant)",
                    tick.hidden_latency_s * 1e3));
  }
  const double mass_kg = sources.settings.handle.effectiveDeviceMass_kg();
  if (tick.handle.probes && rt::HiddenLatency::isLighter(loop.latency, mass_kg)) {
    list.push_back(
        fmt::format("the device moves like one of {:.0f} g and not of {:.0f} g, and the stiffness is limited "
                    "accordingly (set handle.device_mass_kg to its mass)",
                    loop.latency.mass_kg * 1e3, mass_kg * 1e3));
  }
}

void addHandle(const drivers::HandleStatus& handle, const rt::LoopState& loop, const WarningSources& sources,
               Warnings& list) {
  if (handle.state != drivers::HandlePresence::present && !handle.detail.empty()) {
    list.push_back(fmt::format("handle {}: {}", nameOf(handle.state), handle.detail));
  }
  addStiffness(loop.tick, sources, list);
  addClaims(loop, sources, list);
  if (!handle.advice.empty()) list.push_back("handle: " + handle.advice);
}

/// Why the poses of a frame are refused; `silent` if none come.
std::string whyOf(const FrameStatus& frame, const char* silent) {
  return frame.refusal ? fmt::format("; its poses are refused: {}", reasonOf(*frame.refusal)) : silent;
}

/// Adds warnings about frames that are not where they are and on which a fixture depends.
void addFrames(const std::vector<FrameStatus>& frames, Warnings& list) {
  for (const FrameStatus& frame : frames) {
    if (!frame.used) continue;
    const bool placed = frame.state == rt::FrameState::live || frame.state == rt::FrameState::held ||
                        frame.state == rt::FrameState::catching_up;
    if (!frame.tracks.empty() && !placed) {
      const bool looked = frame.tracking && *frame.tracking != rt::TrackingVerdict::tracked;
      list.push_back(
          looked ? fmt::format("frame {} is not followed: the depth camera says {} of the solid that it "
                               "tracks (hapticctl frame show {})",
                               frame.name, rt::wordOf(*frame.tracking), frame.name)
                 : fmt::format("frame {} is not followed: no depth frame has come in which the fixture {} "
                               "could be found (is the camera streaming?)",
                               frame.name, frame.tracks));
    } else if (frame.state == rt::FrameState::none) {
      list.push_back(fmt::format("frame {} has no place yet, and its fixtures exert nothing{}", frame.name,
                                 whyOf(frame, " (feed its poses)")));
    } else if (frame.state == rt::FrameState::lost) {
      list.push_back(fmt::format("frame {} is lost: no usable pose for {:.1f} s{}", frame.name, frame.age_s,
                                 whyOf(frame, " (is its source running, and what it tracks in view?)")));
    }
  }
}

void addLeds(const drivers::LedStatus& leds, Warnings& list) {
  const bool is_missing = leds.state == drivers::LedState::absent || leds.state == drivers::LedState::lost;
  if (is_missing && !leds.detail.empty()) {
    list.push_back(fmt::format("LEDs {}: {}", nameOf(leds.state), leds.detail));
  }
}

void addTrace(const TraceStatus& trace, Warnings& list) {
  if (trace.state == TraceState::waiting) list.push_back("trace waits: " + trace.detail);
  for (const std::string& problem : trace.problems) list.push_back("traces: " + problem);
}

/// Adds warnings about missing privileges and the latency that they may cause.
void addPrivileges(const drivers::HandleScheduling& handle, const WarningSources& sources, Warnings& list) {
  const rt::LoopPrivileges& privileges = sources.privileges;
  if (!privileges.realtime_scheduling) {
    list.push_back(
        "force thread without real-time scheduling: wake-ups may be late "
        "(LimitRTPRIO= in the unit, or an rtprio line in limits.conf)");
  }
  if (handle.requested_priority > 0 && handle.priority == 0) {
    list.push_back(
        fmt::format("handle thread without real-time scheduling: forces may reach the handle late "
                    "(LimitRTPRIO={} or more in "
                    "the unit, or an rtprio line in limits.conf)",
                    handle.requested_priority));
  }
  if (!privileges.memory_locked) {
    list.push_back(
        "memory not locked: page faults may delay the force thread "
        "(LimitMEMLOCK=infinity in the unit, or a memlock line in limits.conf)");
  }
  if (privileges.realtime_scheduling && sources.cpus_may_sleep) {
    list.push_back(
        "CPUs may sleep deeply between ticks: wake-ups may be late "
        "(write permission on /dev/cpu_dma_latency, which hapticd's udev rules give to its group)");
  }
  if (privileges.cpu < 0) {
    list.push_back(fmt::format("force thread not pinned: CPU {} is not available (loop.cpu)",
                               sources.settings.loop.cpu));
  }
}

std::string latenessRemedy(const WarningSources& sources) {
  const rt::LoopPrivileges& privileges = sources.privileges;
  if (sources.cpu_quota)
    return fmt::format("{}: {}", drivers::textOf(*sources.cpu_quota), drivers::kRaiseCpuQuota);
  if (!privileges.realtime_scheduling) {
    return "give it real-time scheduling: LimitRTPRIO= in the unit, or an rtprio line in limits.conf";
  }
  if (!sources.cpu_is_isolated) {
    return "give it a CPU of its own: sudo hapticd-realtime-setup apply, and reboot";
  }
  return fmt::format(
      "the firmware or the law delays it, since CPU {} runs nothing else: switch off power saving "
      "in the firmware's setup, or choose a cheaper force.law or a lower loop.rate_hz",
      privileges.cpu);
}

void addLateness(const WarningSources& sources, Warnings& list) {
  const Lateness& lateness = sources.lateness;
  if (!lateness.late) return;
  list.push_back(
      fmt::format("the force loop is late: {} of {} ticks, and {} periods without one, within the last "
                  "minute ({})",
                  lateness.late_ticks, lateness.ticks, lateness.skipped_periods, latenessRemedy(sources)));
}

}  // namespace

std::vector<std::string> warningsOf(const BoxStatus& status, const WarningSources& sources) {
  Warnings list;
  addFault(status.loop.state.tick, list);
  addWaitingLaw(status.loop.state.tick, list);
  addCamera(status.camera, list);
  addHandle(status.handle, status.loop.state, sources, list);
  addFrames(status.frames, list);
  addLateness(sources, list);
  addLeds(status.leds.panel, list);
  addTrace(status.trace, list);
  addPrivileges(status.handle.scheduling, sources, list);
  if (status.scene.points_over_capacity != 0) {
    list.push_back(fmt::format("{} points did not fit into the model (raise grid.point_capacity)",
                               status.scene.points_over_capacity));
  }
  return list;
}

}  // namespace hapticd::daemon
