// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "config/base/descriptor.h"
#include "config/base/error.h"
#include "rt/depth/depth_frame_header.h"

namespace hapticd::drivers {

/// The first bytes of memory through which one process shows depth frames to others; little-endian.
///
/// Behind it, from `first_slot` on, follow `slots` slots of `slot_bytes` each. A slot begins with a counter
/// of 64 bits, which is odd while the slot is being written, and a rt::DepthFrameHeader; the image begins at
/// `image_offset` of the slot. A reader takes the slot `newest`, notes its counter, copies header and image,
/// and reads the counter again: if it was odd or has changed, the copy is not one frame and is to be
/// repeated. Any change of the layout increments kVersion.
struct DepthRegionHead {
  static constexpr std::array<char, 8> kMagic{'H', 'D', 'R', 'E', 'G', 'I', 'O', 'N'};
  static constexpr std::uint32_t kVersion = 1;
  static constexpr std::uint32_t kNone = 0xffffffff;

  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kVersion;
  std::uint32_t slots = 0;
  std::uint64_t first_slot = 0;  ///< from the begin of the memory, bytes
  std::uint64_t slot_bytes = 0;
  std::uint64_t image_offset = 0;          ///< from the begin of a slot, bytes
  std::atomic<std::uint32_t> changes = 0;  ///< a futex: grows with each frame and when the region is closed
  std::atomic<std::uint32_t> newest = kNone;  ///< slot of the newest frame; kNone: there is none yet
  std::atomic<std::uint32_t> closed =
      0;  ///< 1: no frame follows, the owner is to be asked for another region
  std::uint32_t reserved = 0;
};
static_assert(sizeof(DepthRegionHead) == 56 && std::atomic<std::uint32_t>::is_always_lock_free);
static_assert(offsetof(DepthRegionHead, first_slot) == 16 && offsetof(DepthRegionHead, image_offset) == 32);
static_assert(offsetof(DepthRegionHead, changes) == 40 && offsetof(DepthRegionHead, closed) == 48);

/// Memory mapped into this process, given back when destroyed.
struct DepthRegionMapping {
  std::byte* begin = nullptr;
  std::size_t bytes = 0;

  DepthRegionMapping(std::byte* mapped, std::size_t size) noexcept : begin(mapped), bytes(size) {}
  ~DepthRegionMapping();
  DepthRegionMapping(const DepthRegionMapping&) = delete;
  DepthRegionMapping& operator=(const DepthRegionMapping&) = delete;
};

/// Shows depth frames to other processes through a sealed memory file, which these can only read.
/// It never waits for a reader. Thread: publish() from one thread; the rest from any, one at a time.
class DepthRegionWriter {
 public:
  /// A reader that is slower than this many frames has to copy again.
  static constexpr std::uint32_t kSlots = 4;

  /// Allocates the memory for frames of at most `image_bytes`.
  /// Errors: the system refuses a memory file, its seals or its mapping.
  static base::Result<std::unique_ptr<DepthRegionWriter>> create(std::size_t image_bytes);
  /// Closes the region for its readers.
  ~DepthRegionWriter();

  /// The memory file, to be handed to readers; valid as long as this object.
  int descriptor() const noexcept { return memory_.get(); }
  std::size_t bytes() const noexcept { return mapping_->bytes; }

  /// Copies a frame into the oldest slot and wakes the readers. A frame that is larger than create() was told
  /// is ignored. `image`: stride_bytes * height_px bytes.
  void publish(const rt::DepthFrameHeader& header, std::span<const std::byte> image) noexcept;

 private:
  DepthRegionWriter(base::Descriptor memory, std::unique_ptr<DepthRegionMapping> mapping)
      : memory_(std::move(memory)), mapping_(std::move(mapping)) {}
  DepthRegionHead& head() const noexcept;

  base::Descriptor memory_;
  std::unique_ptr<DepthRegionMapping> mapping_;
};

/// Reads the depth frames that a DepthRegionWriter of another process shows.
/// Thread: any, one at a time.
class DepthRegionReader {
 public:
  /// Maps `memory`, which it does not need any longer then.
  /// Errors: it is not a region of this version, its sizes contradict each other, or it could shrink.
  static base::Result<DepthRegionReader> open(const base::Descriptor& memory);

  /// A number that changes with each frame, and when the region is closed.
  std::uint32_t changes() const noexcept;
  /// Whether no frame follows; the owner is to be asked for another region.
  bool closed() const noexcept;
  /// Waits until changes() differs from `seen`, at most `limit`; false if it does not.
  bool wait(std::uint32_t seen, std::chrono::milliseconds limit) const;
  /// Copies the newest frame. False, with both arguments undefined, if there is none yet, or if the writer
  /// was faster four times in a row.
  bool read(rt::DepthFrameHeader& header, std::vector<std::byte>& image) const;

 private:
  explicit DepthRegionReader(std::unique_ptr<DepthRegionMapping> mapping) : mapping_(std::move(mapping)) {}
  const DepthRegionHead& head() const noexcept;
  bool readSlot(std::uint32_t slot, rt::DepthFrameHeader& header, std::vector<std::byte>& image) const;

  std::unique_ptr<DepthRegionMapping> mapping_;
  // of the head, which its writer cannot change once they are checked
  std::uint32_t slots_ = 0;
  std::uint64_t first_slot_ = 0;
  std::uint64_t slot_bytes_ = 0;
  std::uint64_t image_offset_ = 0;
};

}  // namespace hapticd::drivers
