// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "rt/force_loop.h"
#include "rt/handle_channel.h"
#include "rt/loop_state.h"
#include "rt/parameters.h"
#include "tests/rt/small_scene.h"

namespace hapticd::test {

/// A ForceLoop and all its channels; the test is camera, handle and control thread at once, in one thread.
/// Measurements do not grow stale unless a test wants it.
class LoopRig {
 public:
  explicit LoopRig(double rate_hz = 1000);

  SmallScene wall;
  std::unique_ptr<rt::ControlChannels> control = std::make_unique<rt::ControlChannels>();
  std::unique_ptr<rt::SceneChannel> scenes = std::make_unique<rt::SceneChannel>();
  rt::HandleStateChannel handle_state;
  rt::HandleCommandChannel handle_command;
  rt::TripleBuffer<rt::Vec3> focus;
  rt::ForceLoop loop;

  rt::Directive directive;  ///< what send() sends, with the next generation
  void send();
  void moveHandle(const rt::Vec3& position_m_in_world);
  rt::HandleState handle;  ///< what moveHandle() publishes, but for position, sequence number and time
  void publishScene(std::uint64_t model);

  /// Takes from the ring what is there; true once `count` ticks have been taken since the start.
  bool collected(std::size_t count);
  /// Polls the ring until then; false when it takes too long.
  bool collect(std::size_t count);
  std::vector<rt::Tick> ticks;

 private:
  std::uint64_t measurements_ = 0;
};

/// Lets the world of the loop change in every way for about `ticks` ticks: contact, free space, leaps out of
/// the model, positions that are no numbers, scenes, engaging and parameters. Returns false when the loop
/// stands still.
bool exercise(LoopRig& rig, std::size_t ticks);

}  // namespace hapticd::test
