// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "drivers/depth_region/depth_region.h"
#include "tools/hapticd-view/live/depth_picture.h"

namespace hapticd::tools::view {

/// Waits in a thread of its own for frames in the memory that the daemon shares, and hands each to the thread
/// of the io_context; where that is late only the newest.  Thread of all functions: the io_context's.
class DepthFrames {
 public:
  using Take = std::function<void(std::shared_ptr<const DepthPicture>)>;

  /// Both are called by the io_context, until the object dies. `closed`: no frame follows in this memory.
  DepthFrames(boost::asio::io_context& context, drivers::DepthRegionReader region, Take take,
              std::function<void()> closed);
  /// Waits at most kLongestWait for the thread.
  ~DepthFrames();

 private:
  /// Shared with the thread and with what it has posted.
  struct Shared {
    std::mutex mutex;
    std::shared_ptr<const DepthPicture> newest;  // guarded by mutex; null: taken
    std::atomic<bool> stopped = false;
    Take take;
    std::function<void()> closed;
  };

  static bool readNewest(const drivers::DepthRegionReader& region, const std::shared_ptr<Shared>& shared);
  static void run(boost::asio::io_context& context, const drivers::DepthRegionReader& region,
                  const std::shared_ptr<Shared>& shared);

  std::shared_ptr<Shared> shared_;
  drivers::DepthRegionReader region_;
  std::thread thread_;
};

}  // namespace hapticd::tools::view
