#include "daemon/control/names.h"

namespace hapticd::daemon {

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
  switch (state) {
    case rt::ContactState::free:
      return "free";
    case rt::ContactState::contact:
      return "contact";
    case rt::ContactState::entrenched:
      return "entrenched";
  }
  return "free";
}

const char* nameOf(rt::Mode mode) {
  switch (mode) {
    case rt::Mode::starting:
      return "starting";
    case rt::Mode::idle:
      return "idle";
    case rt::Mode::engaged:
      return "engaged";
    case rt::Mode::holding:
      return "holding";
    case rt::Mode::faulted:
      return "faulted";
  }
  return "faulted";
}

const char* nameOf(rt::Cause cause) {
  switch (cause) {
    case rt::Cause::none:
      return "none";
    case rt::Cause::requested:
      return "requested";
    case rt::Cause::no_scene:
      return "no_scene";
    case rt::Cause::depth_stale:
      return "depth_stale";
    case rt::Cause::handle_stale:
      return "handle_stale";
    case rt::Cause::handle_invalid:
      return "handle_invalid";
    case rt::Cause::force_not_finite:
      return "force_not_finite";
    case rt::Cause::handle_too_fast:
      return "handle_too_fast";
    case rt::Cause::handle_clutched:
      return "handle_clutched";
    case rt::Cause::handle_not_calibrated:
      return "handle_not_calibrated";
    case rt::Cause::handle_replaced:
      return "handle_replaced";
    case rt::Cause::outside_workspace:
      return "outside_workspace";
    case rt::Cause::inside_surface:
      return "inside_surface";
    case rt::Cause::overrun_burst:
      return "overrun_burst";
  }
  return "none";
}

}  // namespace hapticd::daemon
