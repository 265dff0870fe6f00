// SPDX-License-Identifier: Apache-2.0
// What the box says of itself: the one list of what is wrong, whose remedies lead somewhere, and the
// journal's entries about changes that nobody requested.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "daemon/box_warnings.h"
#include "daemon/journal.h"
#include "rt/base/words.h"
#include "tests/support/golden_file.h"

namespace hapticd::daemon {
namespace {

struct Case {
  BoxStatus status;
  config::Settings settings;
  rt::LoopPrivileges privileges{true, true, 3};
  Lateness lateness;
  std::optional<drivers::CpuQuota> cpu_quota;
  bool cpus_may_sleep = false;
  bool cpu_is_isolated = true;

  Case() {
    status.camera.state = drivers::CameraState::streaming;
    status.handle.state = drivers::HandlePresence::present;
    status.loop.state.tick.mode = rt::Mode::idle;
  }
  std::vector<std::string> warnings() const {
    return warningsOf(status, {.settings = settings,
                               .live = settings.live,
                               .privileges = privileges,
                               .cpus_may_sleep = cpus_may_sleep,
                               .cpu_is_isolated = cpu_is_isolated,
                               .lateness = lateness,
                               .cpu_quota = cpu_quota});
  }
};

rt::Tick& tickOf(Case& box) {
  return box.status.loop.state.tick;
}

/// Springs that exert nothing near a surface, because the hand was inside.
void letSpringsWait(Case& box) {
  tickOf(box).mode = rt::Mode::engaged;
  tickOf(box).law = rt::ForceLaw::nearest_springs;
  tickOf(box).points_used = 100;
}

void beLate(Case& box) {
  box.lateness = {true, 60'000, 70, 12};
}

void loseFrames(Case& box) {
  box.status.frames = {{.name = "tool", .state = rt::FrameState::lost, .used = false},
                       {.name = "phantom", .state = rt::FrameState::lost, .used = true, .age_s = 2.13},
                       {.name = "bone", .state = rt::FrameState::none, .used = true},
                       {.name = "head", .state = rt::FrameState::catching_up, .used = true},
                       {.name = "organ",
                        .state = rt::FrameState::lost,
                        .used = true,
                        .tracks = "liver",
                        .tracking = rt::TrackingVerdict::low_share},
                       {.name = "skull", .used = true, .tracks = "bone"},
                       {.name = "vessel",
                        .state = rt::FrameState::lost,
                        .used = true,
                        .tracks = "wall",
                        .tracking = rt::TrackingVerdict::tracked},
                       {.name = "arm",
                        .state = rt::FrameState::lost,
                        .used = true,
                        .refusal = rt::PoseFault::repeated,
                        .age_s = 1}};
}

/// After so many pushes to and fro, by which the device did not move.
void probe(Case& box, std::uint32_t pushes) {
  tickOf(box).handle.probes = true;
  box.status.loop.state.latency.number = pushes;
}

void findMass(Case& box, double mass_kg) {
  probe(box, 3);
  box.status.loop.state.latency.conclusive = true;
  box.status.loop.state.latency.mass_kg = mass_kg;
}

const std::map<std::string, std::function<void(Case&)>> kCases{
    {"all_is_well", [](Case&) {}},
    {"springs_wait", letSpringsWait},
    {"springs_act",
     [](Case& box) {
       letSpringsWait(box);
       tickOf(box).law_force_n_in_world = {0, 0, 1};
     }},
    {"springs_hold",
     [](Case& box) {
       letSpringsWait(box);
       tickOf(box).mode = rt::Mode::holding;
     }},
    {"proxy_waits",
     [](Case& box) {
       letSpringsWait(box);
       tickOf(box).law = rt::ForceLaw::proxy;
     }},
    {"frames_lost", loseFrames},
    {"faulted",
     [](Case& box) {
       tickOf(box).mode = rt::Mode::faulted;
       tickOf(box).cause = rt::Cause::force_not_finite;
     }},
    {"late", beLate},
    {"late_beside_others",
     [](Case& box) {
       beLate(box);
       box.cpu_is_isolated = false;
     }},
    {"late_without_priority",
     [](Case& box) {
       beLate(box);
       box.privileges.realtime_scheduling = false;
     }},
    {"late_with_a_quota",
     [](Case& box) {
       beLate(box);
       box.cpu_quota = drivers::CpuQuota{"/box", 0.15, 60, 59};
     }},
    {"velocity_of_none", [](Case& box) { tickOf(box).handle.velocity_claim = rt::VelocityClaim::none; }},
    {"velocity_contradicted",
     [](Case& box) { tickOf(box).handle.velocity_claim = rt::VelocityClaim::distrusted; }},
    {"forces_2_ms_later", [](Case& box) { tickOf(box).hidden_latency_s = 0.002; }},
    {"forces_12_ms_later", [](Case& box) { tickOf(box).hidden_latency_s = 0.0121; }},
    {"moved_not_the_second_time", [](Case& box) { probe(box, 2); }},
    {"moved_not_the_third_time", [](Case& box) { probe(box, 3); }},
    {"mass_40_g", [](Case& box) { findMass(box, 0.04); }},
    {"mass_10_g", [](Case& box) { findMass(box, 0.0102); }}};

TEST(BoxWarnings, AreThoseThatAreWritten) {
  hapticd::test::expectTranscript(HAPTICD_SOURCE_FOLDER "/tests/unit/daemon/warnings.golden",
                                  [](const std::string& name) {
                                    Case box;
                                    kCases.at(name)(box);
                                    std::string lines;
                                    for (const std::string& warning : box.warnings()) lines += warning + "\n";
                                    return lines;
                                  });
}

TEST(BoxWarnings, NeverSendAReaderInACircle) {
  std::vector<std::string> all;
  for (const bool realtime : {true, false}) {
    for (const bool isolated : {true, false}) {
      Case wrong;
      wrong.status.loop.state.tick.mode = rt::Mode::faulted;
      wrong.status.loop.state.tick.stiffness_limit_n_per_m = 1;
      wrong.status.camera.state = drivers::CameraState::lost;
      wrong.status.camera.detail = "gone (check the cable)";
      wrong.status.handle.state = drivers::HandlePresence::lost;
      wrong.status.handle.detail = "gone (check the cable)";
      wrong.status.scene.points_over_capacity = 1;
      wrong.status.handle.scheduling = {50, 0};
      wrong.privileges = {realtime, false, -1};
      wrong.cpus_may_sleep = true;
      wrong.cpu_is_isolated = isolated;
      wrong.lateness = {true, 60'000, 70, 12};
      for (std::string& text : wrong.warnings()) all.push_back(std::move(text));
    }
  }
  ASSERT_GT(all.size(), 30U);
  for (const std::string& text : all) {
    EXPECT_EQ(text.find("hapticctl doctor"), std::string::npos) << text;
    EXPECT_EQ(text.find("hapticctl status"), std::string::npos) << text;
    EXPECT_NE(text.find('('), std::string::npos) << "no remedy: " << text;
  }
}

// The journal's entries about changes that nobody requested.

/// The journal's entries about what a scenario shows to it.
struct Logged {
  void tick(rt::Mode mode, rt::Cause cause = rt::Cause::requested) {
    rt::Tick tick;
    tick.mode = mode;
    tick.cause = cause;
    log.onTick(tick, now);
  }
  /// Shows the status, twice, as the daemon does when nothing happens in between.
  void look() {
    for (int again = 0; again < 2; ++again) log.onStatus(status);
  }
  /// The status with these conducts of fixtures.
  void look(std::vector<FixtureConduct> each) {
    status.handle.state = drivers::HandlePresence::present;
    status.loop.state.tick.planned_ns = 1'000'000'000'000;
    status.fixtures.each = std::move(each);
    look();
  }
  std::string text() const {
    std::string lines;
    for (const JournalEntry& entry : entries) {
      lines += fmt::format("{} {}: {} |", static_cast<int>(entry.priority),
                           entry.event ? rt::wordOf(*entry.event) : "no event", entry.text);
      for (const auto& [field, value] : entry.fields) lines += fmt::format(" {}={}", field, value);
      lines += "\n";
    }
    return lines;
  }

  std::vector<JournalEntry> entries;
  EventLog log{[this](const JournalEntry& entry) { entries.push_back(entry); }};
  EventLog::Clock::time_point now{std::chrono::hours(1)};
  BoxStatus status;
};

// A breach of the forbidden region of a fixture.
FixtureConduct breached(const std::string& name, std::uint64_t number, double entered_s) {
  FixtureConduct conduct{.name = name};
  conduct.breach = {.number = number,
                    .entered_ns = static_cast<std::int64_t>(entered_s * 1e9),
                    .entered_m_in_world = {0.01, 0.02, -0.8},
                    .duration_s = 1.5,
                    .depth_m = 0.0034,
                    .entry_m_per_s = 0.12,
                    .speed_m_per_s = 0.34,
                    .force_n = 1.25};
  return conduct;
}

const std::map<std::string, std::function<void(Logged&)>> kScenarios{
    {"modes",
     [](Logged& logged) {
       logged.tick(rt::Mode::idle);
       logged.tick(rt::Mode::idle);
       logged.tick(rt::Mode::holding, rt::Cause::depth_stale);
       logged.tick(rt::Mode::faulted, rt::Cause::force_not_finite);
     }},
    {"thirty_five_modes_in_a_second",
     [](Logged& logged) {
       for (int change = 0; change < 35; ++change)
         logged.tick(change % 2 == 0 ? rt::Mode::holding : rt::Mode::engaged);
       logged.now += std::chrono::milliseconds(1001);
       logged.tick(rt::Mode::idle);
     }},
    {"devices",
     [](Logged& logged) {
       BoxStatus& status = logged.status;
       status.handle.identity = "simulated";
       status.camera.identity = "freenect A1";
       status.handle.state = drivers::HandlePresence::lost;
       logged.look();
       status.handle.state = drivers::HandlePresence::present;
       logged.look();
       status.camera.state = drivers::CameraState::streaming;
       logged.look();
       status.camera.state = drivers::CameraState::lost;
       status.camera.detail = "unplugged";
       logged.look();
     }},
    {"frames",
     [](Logged& logged) {
       logged.status.handle.state = drivers::HandlePresence::present;
       logged.look();
       for (const auto& [losses, returns, relocations] :
            {std::tuple(0U, 0U, 0U), {0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {1, 2, 1}}) {
         logged.status.frames = {
             {.name = "phantom", .losses = losses, .returns = returns, .relocations = relocations}};
         logged.look();
       }
     }},
    {"breaches",
     [](Logged& logged) {
       logged.look({breached("nerve", 0, 0), breached("vein", 0, 0)});
       logged.look({breached("nerve", 0, 0), breached("vein", 1, 990)});
       logged.look({breached("nerve", 1, 992), breached("vein", 2, 995)});
     }},
    // A changed set is no breach, and none is missed.
    {"breaches_of_a_changed_set",
     [](Logged& logged) {
       logged.look({breached("nerve", 1, 990), breached("vein", 4, 991)});
       logged.look({});  // until the loop has taken it over
       logged.look({breached("vein", 4, 991), breached("nerve", 1, 990)});  // in another order
       logged.look({breached("vein", 4, 991)});
       logged.look({breached("vein", 4, 991), breached("nerve", 0, 0)});    // added again: counts anew
       logged.look({breached("vein", 4, 991), breached("nerve", 1, 997)});  // the same number as before
     }},
    {"warnings",
     [](Logged& logged) {
       logged.status.handle.state = drivers::HandlePresence::present;
       for (const std::vector<std::string>& warnings :
            std::vector<std::vector<std::string>>{{"7 points did not fit"},
                                                  {"8 points did not fit", "camera: two found"},
                                                  {"camera: two found"},
                                                  {"9 points did not fit"}}) {
         logged.status.warnings = warnings;
         logged.look();
       }
     }},
    {"traces", [](Logged& logged) {
       logged.status.handle.state = drivers::HandlePresence::present;
       logged.look();
       logged.status.trace.news = {{1, false, "delete", "old", "trace old was deleted: why"}};
       logged.look();
       logged.status.trace.news.push_back({2, true, "lose", "short", "trace short was cut off"});
       logged.look();
     }}};

TEST(EventLog, HasTheEntriesThatAreWritten) {
  hapticd::test::expectTranscript(HAPTICD_SOURCE_FOLDER "/tests/unit/daemon/events.golden",
                                  [](const std::string& name) {
                                    Logged logged;
                                    kScenarios.at(name)(logged);
                                    return logged.text();
                                  });
}

}  // namespace
}  // namespace hapticd::daemon
