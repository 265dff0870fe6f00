// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/depth_stream.h"

#include <linux/usb/video.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "tests/vm/emulators/uvc/payload_header.h"
#include "tests/vm/emulators/uvc/uvc_descriptors.h"

namespace hapticd::test::uvc {
namespace {

constexpr std::size_t kHeaderFlagsAt = 1;

std::uint32_t microseconds(std::int64_t time_ns) {
  return static_cast<std::uint32_t>(time_ns / 1000 & 0xffffffff);
}

}  // namespace

void DepthStream::start(const StreamMode& stream, std::uint32_t unit_um) {
  stream_ = stream;
  begun_ns_.reset();
  in_progress_ = false;
  next_number_ = number_ = 0;
  sent_ = skipped_ = 0;
  scene_.emplace(mode().width_px, mode().height_px, intrinsicsOf(model_, mode().width_px, mode().height_px),
                 unit_um);
  payload_.assign(2 * (payloadHeaderBytes(model_) + frameBytes(mode())),
                  0);  // its pages are there from now on
}

std::optional<std::int64_t> DepthStream::due_ns() const {
  if (!stream_ || !begun_ns_) return std::nullopt;
  return *begun_ns_ + std::int64_t{next_number_} * stream_->interval_100ns * 100;
}

void DepthStream::work(std::int64_t now_ns, usbip::PendingUrbs& urbs) {
  if (!stream_) return;
  if (!begun_ns_) {
    if (!urbs.isPending(kStreamEndpoint)) return;
    begun_ns_ = now_ns;
  }
  send(urbs);
  while (*due_ns() <= now_ns) {
    if (in_progress_) {
      ++next_number_;
      ++skipped_;
    } else {
      beginFrame(now_ns);
      send(urbs);
    }
  }
}

void DepthStream::beginFrame(std::int64_t now_ns) {
  number_ = next_number_++;
  spoiling_ = std::exchange(once_, std::nullopt);
  if (spoiling_) ++spoilt_;
  if (hasFault(Fault::silent)) return;
  if (!hasFault(Fault::frame_id_stuck)) frame_id_ = !frame_id_;
  makePayload(now_ns);
  payload_sent_ = 0;
  in_progress_ = true;
}

void DepthStream::makePayload(std::int64_t now_ns) {
  const std::uint32_t interval_us = stream_->interval_100ns / 10;
  const FrameTimes times{.number = number_,
                         .exposure_start_us = microseconds(now_ns) - interval_us,
                         .exposure_us = interval_us / 4,
                         .sent_us = microseconds(now_ns),
                         .interval_us = interval_us};
  const Bytes header = payloadHeader(model_, mode(), times, frame_id_);
  const std::size_t bytes = frameBytes(mode());
  payload_.resize(header.size() + bytes);
  std::ranges::copy(header, payload_.begin());
  if (!hasFault(Fault::frame_repeated)) {
    // a payload header of an even number of bytes keeps the pixels aligned
    auto* const pixels = reinterpret_cast<std::uint16_t*>(payload_.data() + header.size());
    scene_->write(frozen_.value_or(number_), {pixels, bytes / 2});
  }
  spoilHeader(header.size());
  spoilSize(header.size());
}

void DepthStream::spoilHeader(std::size_t header_bytes) {
  if (hasFault(Fault::error_bit)) payload_[kHeaderFlagsAt] |= UVC_STREAM_ERR;
  if (hasFault(Fault::header_long)) payload_[0] = 0xff;
  if (hasFault(Fault::header_short)) payload_[0] = 1;
  if (hasFault(Fault::empty_payload)) payload_.resize(header_bytes);
}

void DepthStream::spoilSize(std::size_t header_bytes) {
  const std::size_t frame = payload_.size() - header_bytes;
  if (hasFault(Fault::frame_short)) payload_.resize(header_bytes + frame / 2);
  if (hasFault(Fault::frame_long)) payload_.resize(payload_.size() + 4096);
  if (hasFault(Fault::other_size)) payload_.resize(header_bytes + frame * 3 / 4);
}

/// A URB that is not full ends the payload; after one that is full an empty one does.
void DepthStream::send(usbip::PendingUrbs& urbs) {
  while (in_progress_ && urbs.isPending(kStreamEndpoint)) {
    const std::size_t room = urbs.pendingBytes(kStreamEndpoint);
    const std::size_t bytes = std::min(room, payload_.size() - payload_sent_);
    urbs.complete(kStreamEndpoint, std::span(payload_).subspan(payload_sent_, bytes));
    payload_sent_ += bytes;
    if (bytes < room) {
      in_progress_ = false;
      ++sent_;
    }
  }
}

}  // namespace hapticd::test::uvc
