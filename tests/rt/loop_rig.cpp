// SPDX-License-Identifier: Apache-2.0
#include "tests/rt/loop_rig.h"

#include <array>
#include <chrono>
#include <limits>

#include "tests/support/program.h"

namespace hapticd::test {
namespace {

constexpr double kNever_s = 1e6;

}  // namespace

LoopRig::LoopRig(double rate_hz, const rt::StartParameters& start)
    : loop({.rate_hz = rate_hz}, start, wall.pointCapacity(),
           {*scenes, handle_state, handle_command, focus, *control}) {
  directive.parameters.safety.depth_timeout_s = kNever_s;
  directive.parameters.safety.handle_timeout_s = kNever_s;
  directive.engage_inside = true;
  send();
  moveHandle(wall.inFrontOfWall(0.02));
  publishScene(1);
}

void LoopRig::send() {
  ++directive.generation;
  control->directive.write(directive);
}

void LoopRig::moveHandle(const rt::Vec3& position_m_in_world) {
  rt::HandleState state = handle;
  state.position_m_in_world = position_m_in_world;
  state.sequence = ++measurements_;
  state.time_ns = rt::monotonicNow_ns();
  handle_state.write(state);
}

void LoopRig::publishScene(std::uint64_t model) {
  rt::Scene scene = wall.scene;
  scene.model = model;
  scene.frame = model;
  scene.frame_time_ns = rt::monotonicNow_ns();
  scenes->write(scene);
}

bool LoopRig::collected(std::size_t count) {
  for (rt::Tick tick; control->ticks.pop(tick);) ticks.push_back(tick);
  return ticks.size() >= count;
}

bool LoopRig::collect(std::size_t count) {
  return becomesTrue([this, count] { return collected(count); }, std::chrono::milliseconds(1));
}

bool exercise(LoopRig& rig, std::size_t ticks) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const std::array positions{rig.wall.inFrontOfWall(0.02),   rig.wall.inFrontOfWall(0.021),
                             rig.wall.inFrontOfWall(0.001),  rig.wall.inFrontOfWall(-0.03),
                             rig.wall.inFrontOfWall(0.06),   rig.wall.inFrontOfWall(0.061),
                             rig.wall.inFrontOfWall(0.0399), rig.wall.besideModel(),
                             rt::Vec3{kNaN, 0, 0},           rt::Vec3{1e300, 0, 0}};
  constexpr std::size_t kTicksPerChange = 3;
  std::size_t change = 0;
  for (std::size_t until = rig.ticks.size() + kTicksPerChange; until < ticks; until += kTicksPerChange) {
    ++change;
    rig.moveHandle(positions[change % positions.size()]);
    if (change % 4 == 0) rig.publishScene(change);
    if (change % 5 == 0) {
      rig.directive.engage = change % 20 != 0;
      rig.directive.parameters.law = static_cast<rt::ForceLaw>(change / 5 % 4);
      rig.directive.parameters.contact.friction = change % 3 == 0 ? 0.5 : 0;
      rig.directive.parameters.contact.damping_n_s_per_m = change % 4 == 0 ? 2 : 0;
      rig.directive.parameters.force.stiffness_n_per_m = change % 3 == 0 ? 500 : 1500;
      rig.directive.parameters.force.max_points = change % 7 == 0 ? 10'000 : 100;
      rig.directive.parameters.force.radius_m = change % 2 == 0 ? 0.04 : 0.05;
      rig.directive.parameters.safety.handle_timeout_s = change % 11 == 0 ? 1e-4 : kNever_s;
      rig.send();
    }
    if (!rig.collect(until)) return false;
  }
  return true;
}

}  // namespace hapticd::test
