// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tools/hapticd-view/live/viewer.h"

namespace hapticd::tools::view {

/// Where pictures come from. Thread: the io_context's.
class Source {
 public:
  virtual ~Source() = default;

  /// The message `hello` of the protocol of `/live`.
  virtual Json hello() const = 0;

  /// Begins to deliver to a viewer, which must be removed before it dies. What is known already comes before
  /// add() returns. Neither may be called from within a viewer's functions, except from onText().
  virtual void add(Viewer& viewer) = 0;
  virtual void remove(Viewer& viewer) = 0;

  /// A viewer's wantsTicks() or wantsDepth() has changed.
  virtual void wantsChanged() = 0;
};

}  // namespace hapticd::tools::view
