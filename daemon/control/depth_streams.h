// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "daemon/base/box.h"
#include "daemon/control/method.h"

namespace hapticd::daemon {

/// The streams of ShareDepth, each of which hands over the descriptor of the memory with the depth frames.
/// The box writes there as long as one of them is open. Thread: control thread only.
class DepthStreams {
 public:
  static constexpr std::size_t kMostStreams = 8;

  explicit DepthStreams(Box& box) : box_(box) {}
  std::vector<Method> methods();

  void feed(Replies& replies);
  void closed(ConnectionId connection);

 private:
  struct Stream {
    ConnectionId connection = 0;
    bool handed_over = false;
  };

  void shareDepth(const Call&, const Caller&, Replies&);

  Box& box_;
  SharedDepth shared_;  ///< valid while there are streams
  std::vector<Stream> streams_;
};

}  // namespace hapticd::daemon
