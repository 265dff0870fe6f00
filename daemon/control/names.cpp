// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/names.h"

#include "drivers/trace/names.h"

namespace hapticd::daemon {
namespace {

/// The name that traces use for the enumerator.
template <typename Enumeration>
const char* wordOf(Enumeration value) {
  return drivers::kNames<Enumeration>.at(static_cast<std::size_t>(value)).data();  // a string literal
}

}  // namespace

const char* nameOf(drivers::CameraState state) {
  switch (state) {
    case drivers::CameraState::absent:
      return "absent";
    case drivers::CameraState::streaming:
      return "streaming";
    case drivers::CameraState::lost:
      return "lost";
  }
  return "absent";
}

const char* nameOf(drivers::HandlePresence state) {
  switch (state) {
    case drivers::HandlePresence::absent:
      return "absent";
    case drivers::HandlePresence::calibrating:
      return "calibrating";
    case drivers::HandlePresence::present:
      return "present";
    case drivers::HandlePresence::lost:
      return "lost";
  }
  return "absent";
}

const char* nameOf(drivers::LedState state) {
  switch (state) {
    case drivers::LedState::none:
      return "none";
    case drivers::LedState::present:
      return "present";
    case drivers::LedState::absent:
      return "absent";
    case drivers::LedState::lost:
      return "lost";
  }
  return "none";
}

const char* nameOf(TraceState state) {
  switch (state) {
    case TraceState::off:
      return "off";
    case TraceState::writing:
      return "writing";
    case TraceState::waiting:
      return "waiting";
  }
  return "off";
}

const char* nameOf(LedPattern pattern) {
  switch (pattern) {
    case LedPattern::off:
      return "off";
    case LedPattern::on:
      return "on";
    case LedPattern::slow_blink:
      return "slow_blink";
    case LedPattern::fast_blink:
      return "fast_blink";
    case LedPattern::double_blink:
      return "double_blink";
  }
  return "off";
}

const char* nameOf(rt::ContactState state) {
  return wordOf(state);
}

const char* nameOf(rt::StiffnessRule rule) {
  return wordOf(rule);
}

const char* nameOf(rt::Mode mode) {
  return wordOf(mode);
}

const char* nameOf(rt::Cause cause) {
  return wordOf(cause);
}

}  // namespace hapticd::daemon
