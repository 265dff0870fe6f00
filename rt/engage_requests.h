// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/loop_state.h"

namespace hapticd::rt {

/// Brings what people ask for into the directive. To ask for force that has been asked for already changes
/// nothing, whether it is exerted, comes in or is held back: the force loop takes every new request for a new
/// decision, which would end a force that is felt. Thread: one, the writer of the directive.
class EngageRequests {
 public:
  /// `inside`: also where something is felt at once; `loop`: as it was last seen. True when `directive` was
  /// changed and is to be sent with the next generation.
  bool ask(bool engage, bool inside, const LoopState& loop, Directive& directive) noexcept {
    if (engage && isAskedFor(inside, loop, directive)) return false;
    directive.engage = engage;
    directive.engage_inside = inside;
    ++directive.engage_request;
    generation_ = directive.generation + 1;
    return true;
  }

 private:
  /// Not what was refused: that takes another request. The loop was seen before or after it has decided on
  /// the newest one; before, nobody knows of a refusal yet.
  bool isAskedFor(bool inside, const LoopState& loop, const Directive& directive) const noexcept {
    const bool refused = loop.directive_generation >= generation_ && loop.tick.mode == Mode::idle;
    return directive.engage && !refused && (directive.engage_inside || !inside);
  }

  std::uint64_t generation_ = 0;  // of the directive with the newest request
};

}  // namespace hapticd::rt
