// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <future>
#include <optional>
#include <vector>

#include "daemon/base/box.h"
#include "daemon/control/base/method_context.h"

namespace hapticd::daemon {

/// The streams of GetSnapshot, each of which sends a depth frame a few rows at a time.
/// Thread: control thread only.
class SnapshotStreams {
 public:
  explicit SnapshotStreams(Box& box) : box_(box) {}
  std::vector<Method> methods();

  void feed(Replies& replies);
  void closed(ConnectionId connection);

 private:
  using Taken = base::Result<SceneSnapshot>;

  struct Stream {
    ConnectionId connection = 0;
    std::future<Taken> taking;
    std::optional<SceneSnapshot> snapshot;  ///< the frame, once it is taken
    int next_row = 0;
  };

  void getSnapshot(const Call&, const Caller&, Replies&);
  /// Sends as much as the connection takes; true when the stream has ended.
  static bool feed(Stream& stream, Replies& replies);

  Box& box_;
  std::vector<Stream> streams_;
};

/// The streams of ShareDepth, each of which hands over the descriptor of the memory with the depth frames.
/// The box writes there as long as one of them is open. Thread: control thread only.
class DepthStreams {
 public:
  static constexpr std::size_t kMaxStreams = 8;

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
