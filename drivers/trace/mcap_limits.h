// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

/// What reading a file may take at most, whatever the file contains; every program that reads traces reads
/// them through these limits. Memory and time are limited per byte of the file, so that a small file can
/// neither fill nor stop a computer. Traces stay a tenth of that or less: a second of them takes 70 kB, and
/// 0.7 MB decompressed.
namespace hapticd::drivers::mcap {

// Larger ones are not written.
inline constexpr std::size_t kMaxMessageBytes = 4 << 20;
inline constexpr std::size_t kMaxAttachmentBytes = 32 << 20;
// Larger ones are rejected when read, before memory is allocated for them. Other programs write larger chunks
// and records than this one.
inline constexpr std::size_t kMaxChunkBytes = 64 << 20;    ///< uncompressed
inline constexpr std::size_t kMaxRecordBytes = 320 << 20;  ///< attachments of other programs may be large
/// Messages held because later ones in the file may be earlier in time.
inline constexpr std::size_t kMaxOverlapBytes = 512 << 20;

/// Held at a time, or kept of the file, for each byte of it.
inline constexpr std::uint64_t kMaxHeldRatio = 256;
/// Decompressed of the file altogether, for each byte of it. Equal label images in records of fixtures take
/// next to nothing.
inline constexpr std::uint64_t kMaxUnpackedRatio = 4096;
/// A chunk that would become shorter by more than that is written as it is.
inline constexpr std::size_t kMaxWrittenRatio = 2048;

/// The largest size of a chunk, and of the messages held because of their times, in a file of that size. A
/// chunk that hapticd writes has at most two messages of the largest size.
constexpr std::uint64_t mostHeld(std::uint64_t file_bytes, std::uint64_t most) {
  constexpr std::uint64_t kLeast = 16 << 20;
  return std::min(most, kLeast + kMaxHeldRatio * file_bytes);
}

/// What may be kept of the records of a file of that size altogether.
constexpr std::uint64_t mostKept(std::uint64_t file_bytes) {
  constexpr std::uint64_t kLeast = 1 << 20;
  return kLeast + kMaxHeldRatio * file_bytes;
}

/// What the chunks of one file may become when they are decompressed, in one pass.
/// Thread: one.
class Allowance {
 public:
  explicit Allowance(std::uint64_t file_bytes)
      : chunk_bytes_(mostHeld(file_bytes, kMaxChunkBytes)), left_(kLeast + kMaxUnpackedRatio * file_bytes) {}

  /// The largest chunk.
  std::uint64_t chunkBytes() const { return chunk_bytes_; }
  /// Whether a chunk of this content is allowed. `messages`: in it; each costs time, however short it is.
  bool take(std::uint64_t bytes, std::uint64_t messages) {
    const std::uint64_t cost = bytes + kPerMessage * messages;
    const bool allowed = cost <= left_;
    left_ -= allowed ? cost : left_;
    return allowed;
  }

 private:
  static constexpr std::uint64_t kLeast = 16 << 20;
  static constexpr std::uint64_t kPerMessage = 512;

  std::uint64_t chunk_bytes_;
  std::uint64_t left_;
};

}  // namespace hapticd::drivers::mcap
