// SPDX-License-Identifier: Apache-2.0
#include "config/settings/cause_text.h"

namespace hapticd::config {

const char* textOf(rt::Cause cause) {
  switch (cause) {
    case rt::Cause::none:
    case rt::Cause::requested:
      return "";
    case rt::Cause::no_scene:
      return "no depth frame has been modelled yet";
    case rt::Cause::depth_stale:
      return "the newest depth frame is too old";
    case rt::Cause::handle_stale:
      return "the handle has stopped measuring";
    case rt::Cause::handle_invalid:
      return "the handle's position is impossible";
    case rt::Cause::force_not_finite:
      return "the force law computed a number that is not finite";
    case rt::Cause::handle_too_fast:
      return "the hand seems to move faster than safety.max_handle_speed_m_per_s";
    case rt::Cause::handle_clutched:
      return "the clutch is held";
    case rt::Cause::handle_not_calibrated:
      return "the handle is not calibrated yet";
    case rt::Cause::handle_replaced:
      return "the handle was lost and reconnected; engage again when it is safe";
    case rt::Cause::outside_workspace:
      return "the handle is outside safety.workspace_radius_m";
    case rt::Cause::inside_surface:
      return "engaging was refused: the handle would be in contact at once";
    case rt::Cause::overrun_burst:
      return "too many ticks ended late";
    case rt::Cause::surface_too_near:
      return "the surface has come nearer than the camera can measure";
    case rt::Cause::handle_inconsistent:
      return "the device reports a velocity that its positions contradict";
    case rt::Cause::energy_debt:
      return "the hand got more energy from the box than it gave: the loop is unstable";
    case rt::Cause::frame_lost:
      return "a fixture needs a frame whose poses are missing";
  }
  return "";
}

const char* textOf(rt::Mode mode, rt::Cause cause) {
  if (mode == rt::Mode::engaged && cause == rt::Cause::depth_stale)
    return "the camera is lost: only the fixtures act that go on without depth";
  if (mode == rt::Mode::engaged && cause == rt::Cause::surface_too_near)
    return "the surface is too near for the camera: only the fixtures act that go on without depth";
  return textOf(cause);
}

}  // namespace hapticd::config
