// SPDX-License-Identifier: Apache-2.0
#include "daemon/indicators.h"

#include <utility>

namespace hapticd::daemon {
namespace {

using drivers::CameraState;
using drivers::Led;
using rt::Mode;

constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::int64_t kDamageShown_ns = 1000 * kNsPerMs;

/// The flashes at the start of each period; the pauses between them are as long as the flashes.
struct Timing {
  std::int64_t period_ms;
  int flashes;
  std::int64_t flash_ms;
};

// 2 s are a whole number of each period.
constexpr Timing kSlowBlink{2000, 1, 1000};
constexpr Timing kFastBlink{200, 1, 100};
constexpr Timing kDoubleBlink{1000, 2, 100};

bool isFlashing(const Timing& timing, std::int64_t time_ns) {
  const std::int64_t part = time_ns / kNsPerMs % timing.period_ms / timing.flash_ms;
  return part % 2 == 0 && part / 2 < timing.flashes;
}

LedPattern powerPattern(const BoxCondition& condition) {
  return condition.mode == Mode::starting ? LedPattern::slow_blink : LedPattern::on;
}

LedPattern cameraPattern(const BoxCondition& condition) {
  switch (condition.camera) {
    case CameraState::absent:
      return LedPattern::off;
    case CameraState::lost:
      return LedPattern::fast_blink;
    case CameraState::streaming:
      break;
  }
  return condition.frames_damaged ? LedPattern::double_blink : LedPattern::on;
}

LedPattern contactPattern(const BoxCondition& condition) {
  if (condition.mode != Mode::engaged) return LedPattern::off;
  if (condition.in_contact) return LedPattern::on;
  return condition.near_fixture ? LedPattern::double_blink : LedPattern::slow_blink;
}

LedPattern faultPattern(const BoxCondition& condition) {
  if (condition.mode == Mode::faulted) return LedPattern::fast_blink;
  if (condition.mode == Mode::holding) return LedPattern::double_blink;
  // a device that has not been found yet is no fault
  const bool judged = condition.mode != Mode::starting;
  return judged && condition.warned ? LedPattern::slow_blink : LedPattern::off;
}

}  // namespace

LedPatterns patternsOf(const BoxCondition& condition) {
  LedPatterns patterns{};
  patterns[std::to_underlying(Led::power)] = powerPattern(condition);
  patterns[std::to_underlying(Led::camera)] = cameraPattern(condition);
  patterns[std::to_underlying(Led::contact)] = contactPattern(condition);
  patterns[std::to_underlying(Led::fault)] = faultPattern(condition);
  return patterns;
}

bool isLit(LedPattern pattern, std::int64_t time_ns) {
  switch (pattern) {
    case LedPattern::off:
      return false;
    case LedPattern::on:
      return true;
    case LedPattern::slow_blink:
      return isFlashing(kSlowBlink, time_ns);
    case LedPattern::fast_blink:
      return isFlashing(kFastBlink, time_ns);
    case LedPattern::double_blink:
      return isFlashing(kDoubleBlink, time_ns);
  }
  return false;
}

drivers::LedSet litLeds(const LedPatterns& patterns, std::int64_t time_ns) {
  drivers::LedSet lit;
  for (std::size_t led = 0; led < patterns.size(); ++led) lit[led] = isLit(patterns[led], time_ns);
  return lit;
}

BoxCondition ConditionWatch::follow(const BoxStatus& status, std::int64_t time_ns) {
  const std::uint64_t contact_ticks = status.loop.state.counters.contact_ticks;
  if (status.camera.damaged_frames > damaged_frames_) last_damage_ns_ = time_ns;
  BoxCondition condition;
  condition.mode = status.loop.state.tick.mode;
  const FixtureStatus& fixtures = status.fixtures;
  condition.in_contact =
      contact_ticks > contact_ticks_ || (fixtures.force_n > 0 && !fixtures.in_contact.empty());
  condition.near_fixture = fixtures.warning;
  condition.camera = status.camera.state;
  condition.frames_damaged = last_damage_ns_ && time_ns - *last_damage_ns_ < kDamageShown_ns;
  condition.warned = !status.warnings.empty();
  contact_ticks_ = contact_ticks;
  damaged_frames_ = status.camera.damaged_frames;
  return condition;
}

}  // namespace hapticd::daemon
