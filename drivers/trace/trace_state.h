// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/words.h"

namespace hapticd::drivers {

/// What the daemon does with the ticks of its force loop.
enum class TraceState {
  off,      ///< no trace was requested
  writing,  ///< ticks go into a file
  waiting,  ///< a trace was requested, but cannot be written now; it goes on by itself, in another file
};
constexpr auto wordsOf(TraceState) {
  return rt::words<TraceState>("off", "writing", "waiting");
}

}  // namespace hapticd::drivers
