// SPDX-License-Identifier: Apache-2.0
#include "daemon/indicators.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace hapticd::daemon {
namespace {

using drivers::CameraState;
using drivers::Led;
using rt::Mode;
using enum LedPattern;

constexpr std::int64_t kNsPerMs = 1'000'000;

LedPattern shown(Led led, const BoxCondition& condition) {
  return patternsOf(condition)[std::to_underlying(led)];
}

struct Case {
  BoxCondition condition;
  LedPattern expected;
};

void expectPatterns(Led led, const std::vector<Case>& cases) {
  for (std::size_t i = 0; i < cases.size(); ++i) {
    EXPECT_EQ(shown(led, cases[i].condition), cases[i].expected) << "row " << i;
  }
}

TEST(Indicators, PowerBlinksWhileStartingAndIsOnInEveryOtherMode) {
  expectPatterns(Led::power, {{{.mode = Mode::starting}, slow_blink},
                              {{.mode = Mode::idle}, on},
                              {{.mode = Mode::engaged}, on},
                              {{.mode = Mode::holding}, on},
                              {{.mode = Mode::faulted, .warned = true}, on}});
}

TEST(Indicators, CameraShowsItsStateAndDamagedFramesOnlyWhileItStreams) {
  expectPatterns(Led::camera, {{{.camera = CameraState::absent}, off},
                               {{.camera = CameraState::streaming}, on},
                               {{.camera = CameraState::lost}, fast_blink},
                               {{.camera = CameraState::absent, .frames_damaged = true}, off},
                               {{.camera = CameraState::streaming, .frames_damaged = true}, double_blink},
                               {{.camera = CameraState::lost, .frames_damaged = true}, fast_blink}});
}

TEST(Indicators, ContactShowsWhatCanBeFeltOnlyWhileEngaged) {
  expectPatterns(Led::contact, {{{.mode = Mode::engaged, .in_contact = true}, on},
                                {{.mode = Mode::engaged, .in_contact = false}, slow_blink},
                                {{.mode = Mode::engaged, .near_fixture = true}, double_blink},
                                {{.mode = Mode::engaged, .in_contact = true, .near_fixture = true}, on},
                                {{.mode = Mode::idle, .near_fixture = true}, off},
                                {{.mode = Mode::starting, .in_contact = true}, off},
                                {{.mode = Mode::idle, .in_contact = true}, off},
                                {{.mode = Mode::idle, .in_contact = false}, off},
                                {{.mode = Mode::holding, .in_contact = true}, off},
                                {{.mode = Mode::faulted, .in_contact = true}, off}});
}

TEST(Indicators, FaultShowsTheWorst) {
  expectPatterns(Led::fault, {{{.mode = Mode::idle}, off},
                              {{.mode = Mode::engaged}, off},
                              {{.mode = Mode::starting, .warned = true}, off},
                              {{.mode = Mode::engaged, .warned = true}, slow_blink},
                              {{.mode = Mode::holding}, double_blink},
                              {{.mode = Mode::holding, .warned = true}, double_blink},
                              {{.mode = Mode::faulted}, fast_blink},
                              {{.mode = Mode::faulted, .warned = true}, fast_blink}});
}

/// Milliseconds from the begin of the pattern, the end not included.
using Interval = std::pair<std::int64_t, std::int64_t>;

bool isInside(const std::vector<Interval>& intervals, std::int64_t time_ms) {
  for (const auto& [begin, end] : intervals) {
    if (time_ms >= begin && time_ms < end) return true;
  }
  return false;
}

/// `lit`: within 2 s, after which the pattern is to begin again, however long the clock runs.
void expectLit(LedPattern pattern, const std::vector<Interval>& lit) {
  constexpr std::int64_t kOneYear_ms = 365LL * 24 * 3600 * 1000;
  for (const std::int64_t begin_ms : {std::int64_t{0}, std::int64_t{2000}, kOneYear_ms}) {
    for (std::int64_t time_ms = 0; time_ms < 2000; ++time_ms) {
      const std::int64_t time_ns = (begin_ms + time_ms) * kNsPerMs;
      ASSERT_EQ(isLit(pattern, time_ns), isInside(lit, time_ms)) << time_ms << " ms after " << begin_ms;
      ASSERT_EQ(isLit(pattern, time_ns + kNsPerMs - 1), isInside(lit, time_ms)) << "end of " << time_ms;
    }
  }
}

TEST(LedPattern, IsLitAsItsNameSays) {
  expectLit(off, {});
  expectLit(on, {{0, 2000}});
  expectLit(slow_blink, {{0, 1000}});
  expectLit(double_blink, {{0, 100}, {200, 300}, {1000, 1100}, {1200, 1300}});
  std::vector<Interval> ten_a_second;
  for (std::int64_t begin_ms = 0; begin_ms < 2000; begin_ms += 200)
    ten_a_second.emplace_back(begin_ms, begin_ms + 100);
  expectLit(fast_blink, ten_a_second);
}

TEST(LitLeds, FollowEachItsOwnPattern) {
  LedPatterns patterns{};
  patterns[std::to_underlying(Led::power)] = on;
  patterns[std::to_underlying(Led::camera)] = fast_blink;
  patterns[std::to_underlying(Led::fault)] = slow_blink;
  const auto litAt = [&](std::int64_t time_ms) { return litLeds(patterns, time_ms * kNsPerMs).to_string(); };
  // the last digit is the first LED: fault, contact, camera, power
  EXPECT_EQ(litAt(0), "1011");
  EXPECT_EQ(litAt(150), "1001");
  EXPECT_EQ(litAt(1050), "0011");
  EXPECT_EQ(litAt(1150), "0001");
}

TEST(ConditionWatch, TakesOverModeCameraAndWarnings) {
  BoxStatus status;
  status.loop.state.tick.mode = Mode::holding;
  status.camera.state = CameraState::lost;
  ConditionWatch watch;
  EXPECT_EQ(watch.follow(status, 0).mode, Mode::holding);
  EXPECT_EQ(watch.follow(status, 0).camera, CameraState::lost);
  EXPECT_FALSE(watch.follow(status, 0).warned);
  status.warnings = {"something"};
  EXPECT_TRUE(watch.follow(status, 0).warned);
}

TEST(ConditionWatch, SeesContactOfAnyTickSinceTheLastLook) {
  BoxStatus status;
  ConditionWatch watch;
  EXPECT_FALSE(watch.follow(status, 0).in_contact);
  status.loop.state.counters.contact_ticks = 1;
  EXPECT_TRUE(watch.follow(status, 50 * kNsPerMs).in_contact);
  EXPECT_FALSE(watch.follow(status, 100 * kNsPerMs).in_contact);
}

TEST(ConditionWatch, RemembersADamagedFrameForASecond) {
  BoxStatus status;
  ConditionWatch watch;
  EXPECT_FALSE(watch.follow(status, 0).frames_damaged);
  status.camera.damaged_frames = 1;
  EXPECT_TRUE(watch.follow(status, 5000 * kNsPerMs).frames_damaged);
  EXPECT_TRUE(watch.follow(status, 5999 * kNsPerMs).frames_damaged);
  EXPECT_FALSE(watch.follow(status, 6000 * kNsPerMs).frames_damaged);
  status.camera.damaged_frames = 2;
  EXPECT_TRUE(watch.follow(status, 6050 * kNsPerMs).frames_damaged);
}

// A camera that is found again may count from 0.
TEST(ConditionWatch, SeesADamagedFrameAfterTheCountRestarted) {
  BoxStatus status;
  ConditionWatch watch;
  status.camera.damaged_frames = 7;
  watch.follow(status, 0);
  status.camera.damaged_frames = 0;
  EXPECT_FALSE(watch.follow(status, 2000 * kNsPerMs).frames_damaged);
  status.camera.damaged_frames = 1;
  EXPECT_TRUE(watch.follow(status, 2050 * kNsPerMs).frames_damaged);
}

}  // namespace
}  // namespace hapticd::daemon
