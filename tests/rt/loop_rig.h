// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "rt/base/parameters.h"
#include "rt/channels/handle_channel.h"
#include "rt/loop/force_loop.h"
#include "rt/loop/loop_state.h"
#include "tests/rt/small_scene.h"

namespace hapticd::test {

/// A ForceLoop with all its channels; the test acts as camera, handle and control thread, all in one thread.
/// Measurements do not become stale unless a test requests it.
class LoopRig {
 public:
  explicit LoopRig(double rate_hz = 1000, const rt::StartParameters& start = {});

  SmallScene wall;
  std::unique_ptr<rt::ControlChannels> control = std::make_unique<rt::ControlChannels>();
  std::unique_ptr<rt::SceneChannel> scenes = std::make_unique<rt::SceneChannel>();
  rt::HandleStateChannel handle_state;
  rt::HandleCommandChannel handle_command;
  rt::TripleBuffer<rt::Vec3> focus;
  rt::ForceLoop loop;

  rt::Directive directive;  ///< sent by send() with the next generation
  void send();
  void moveHandle(const rt::Vec3& position_m_in_world);
  rt::HandleState handle;  ///< published by moveHandle(), except position, sequence number and time
  void publishScene(std::uint64_t model);

  /// Takes all available ticks from the ring; returns true once `count` ticks have been taken since the
  /// start.
  bool collected(std::size_t count);
  /// Polls the ring until `count` ticks have been taken; returns false on timeout.
  bool collect(std::size_t count);
  std::vector<rt::Tick> ticks;

 private:
  std::uint64_t measurements_ = 0;
};

/// Changes all inputs of the loop for about `ticks` ticks: contact, free space, jumps out of the model,
/// invalid positions, scenes, engaging and parameters. Returns false if the loop has stalled.
bool exercise(LoopRig& rig, std::size_t ticks);

}  // namespace hapticd::test
