// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/depth_frames.h"

#include <boost/asio/post.hpp>
#include <chrono>
#include <utility>

namespace hapticd::tools::view {
namespace {

/// So long the end of the thread may take, in which other clients wait.
constexpr std::chrono::milliseconds kLongestWait{50};

}  // namespace

DepthFrames::DepthFrames(boost::asio::io_context& context, drivers::DepthRegionReader region, Take take,
                         std::function<void()> closed)
    : shared_(std::make_shared<Shared>()), region_(std::move(region)) {
  shared_->take = std::move(take);
  shared_->closed = std::move(closed);
  thread_ = std::thread([this, &context] { run(context, region_, shared_); });
}

DepthFrames::~DepthFrames() {
  shared_->stopped = true;
  thread_.join();
}

/// Whether there is a new frame that the other thread does not know of yet.
bool DepthFrames::readNewest(const drivers::DepthRegionReader& region,
                             const std::shared_ptr<Shared>& shared) {
  auto picture = std::make_shared<DepthPicture>();
  if (!region.read(picture->header, picture->image)) return false;
  // the memory is written by another process
  const bool good = rt::faultOf(picture->header) == rt::DepthHeaderFault::none &&
                    picture->image.size() == picture->header.imageBytes();
  if (!good) return false;
  const std::lock_guard lock(shared->mutex);
  return std::exchange(shared->newest, std::move(picture)) == nullptr;
}

void DepthFrames::run(boost::asio::io_context& context, const drivers::DepthRegionReader& region,
                      const std::shared_ptr<Shared>& shared) {
  // a frame that was published before is shown at once
  std::uint32_t seen = region.changes() - 1;
  while (!shared->stopped && !region.closed()) {
    if (!region.wait(seen, kLongestWait)) continue;
    seen = region.changes();
    if (!readNewest(region, shared)) continue;
    boost::asio::post(context, [shared] {
      std::shared_ptr<const DepthPicture> newest;
      {
        const std::lock_guard lock(shared->mutex);
        newest = std::exchange(shared->newest, nullptr);
      }
      if (!shared->stopped && newest) shared->take(std::move(newest));
    });
  }
  if (shared->stopped) return;
  boost::asio::post(context, [shared] {
    if (!shared->stopped) shared->closed();
  });
}

}  // namespace hapticd::tools::view
