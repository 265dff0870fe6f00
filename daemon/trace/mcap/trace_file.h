// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "config/base/error.h"

namespace hapticd::trace {

/// An open file. A writer holds a lock on it (flock), which is released with the object or its process.
/// Thread: one.  RT: not safe.
class TraceFile {
 public:
  /// Creates a file and locks it.  Errors: it already exists, or a system error.
  static base::Result<TraceFile> create(const std::filesystem::path& path);
  /// Opens a file for reading.  Errors: system errors.
  static base::Result<TraceFile> openToRead(const std::filesystem::path& path);
  /// Opens a file for repair and locks it.  Errors: it is being written, or a system error.
  static base::Result<TraceFile> openToMend(const std::filesystem::path& path);
  TraceFile(TraceFile&& other) noexcept;
  TraceFile& operator=(TraceFile&&) = delete;
  ~TraceFile();

  const std::filesystem::path& path() const { return path_; }
  base::Result<std::uint64_t> size() const;
  /// Writes all of `bytes`, or returns an error.
  base::Result<void> writeAt(std::uint64_t offset, std::string_view bytes);
  /// Reads as many bytes as available, at most `length`, to `to`. Small pieces that follow each other are
  /// read from memory: there may be millions of them.
  base::Result<void> readAt(std::uint64_t offset, std::size_t length, std::string& to) const;
  base::Result<void> truncate(std::uint64_t size);
  /// Returns when the data is on disk.
  base::Result<void> synchronise();

 private:
  TraceFile(std::filesystem::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
  static base::Result<TraceFile> open(const std::filesystem::path& path, int flags);
  static base::Result<TraceFile> openLocked(const std::filesystem::path& path, int flags);
  std::unexpected<base::Error> failure(std::string_view doing) const;
  base::Result<void> readFromDisk(std::uint64_t offset, std::size_t length, std::string& to) const;

  std::filesystem::path path_;
  int descriptor_;
  mutable std::string window_;  ///< bytes of the file from window_at_ on
  mutable std::uint64_t window_at_ = 0;
};

/// Returns true if a TraceFile of some process may be writing this file.
bool isBeingWritten(const std::filesystem::path& file);

/// Returns the name of a trace while it is being written.
std::filesystem::path partOf(const std::filesystem::path& file);

/// Renames `part` to `file` such that the new name survives a crash.
/// Errors: `file` exists, or a system error.
base::Result<void> renameDurably(const std::filesystem::path& part, const std::filesystem::path& file);

/// Makes the names in a folder survive a crash.
base::Result<void> synchroniseFolder(const std::filesystem::path& folder);

}  // namespace hapticd::trace
