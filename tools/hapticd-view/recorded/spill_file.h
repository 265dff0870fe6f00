// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "config/descriptor.h"
#include "config/error.h"

namespace hapticd::tools::view {

/// A temporary file without a name, for more data than belongs in memory: written once from begin to end,
/// then mapped and read in any order. It is gone with its process.  Thread: one at a time.
class SpillFile {
 public:
  /// Errors: no folder for temporary files (TMPDIR, else /var/tmp) takes it.
  static config::Result<SpillFile> create();
  SpillFile(SpillFile&& other) noexcept;
  SpillFile& operator=(SpillFile&&) = delete;
  ~SpillFile();

  /// The number of bytes appended so far, which is where the next ones will be.
  std::uint64_t size() const noexcept { return written_ + buffer_.size(); }
  /// Errors: the disk is full.
  config::Result<void> append(std::span<const std::byte> bytes);
  /// Maps what has been appended; append() cannot be called any more. Errors: the disk is full.
  config::Result<void> map();
  /// Everything, once it is mapped. Aligned to a page.
  std::span<const std::byte> bytes() const noexcept { return {mapped_, mapped_bytes_}; }

 private:
  explicit SpillFile(config::Descriptor file) : file_(std::move(file)) {}
  config::Result<void> flush();

  config::Descriptor file_;
  std::string buffer_;
  std::uint64_t written_ = 0;
  std::byte* mapped_ = nullptr;
  std::size_t mapped_bytes_ = 0;
};

}  // namespace hapticd::tools::view
