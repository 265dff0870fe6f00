// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/loop/loop_state.h"

namespace hapticd::rt {

/// Turns requests to engage or disengage into changes of the directive. Requesting force that has already
/// been requested changes nothing, whether that force is active, ramping in or held: the force loop makes a
/// new decision for every new request, and that would interrupt an active force.
/// Thread: one, the writer of the directive.
class EngageRequests {
 public:
  /// Handles one request. `inside`: engage even inside a surface, where a force acts at once; `loop`: the
  /// newest known state. Returns true if `directive` was changed and must be sent with the next generation.
  bool ask(bool engage, bool inside, const LoopState& loop, Directive& directive) noexcept {
    if (engage && isAlreadyRequested(inside, loop, directive)) return false;
    directive.engage = engage;
    directive.engage_inside = inside;
    ++directive.engage_request;
    generation_ = directive.generation + 1;
    return true;
  }

 private:
  /// Returns whether the force has already been requested and not been refused; after a refusal a new request
  /// is needed. `loop` may be older than the loop's decision on the newest request; a refusal is then not
  /// known yet.
  bool isAlreadyRequested(bool inside, const LoopState& loop, const Directive& directive) const noexcept {
    const bool refused = loop.directive_generation >= generation_ && loop.tick.mode == Mode::idle;
    return directive.engage && !refused && (directive.engage_inside || !inside);
  }

  std::uint64_t generation_ = 0;  // of the directive with the newest request
};

}  // namespace hapticd::rt
