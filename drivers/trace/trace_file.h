// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "config/error.h"

namespace hapticd::drivers {

/// An open file. Whoever writes it holds a lock on it (flock), which ends with the object or its process.
/// Thread: one.  RT: not safe.
class TraceFile {
 public:
  /// Errors: it exists already, or what the system says.
  static config::Result<TraceFile> create(const std::filesystem::path& path);
  static config::Result<TraceFile> openToRead(const std::filesystem::path& path);
  /// Errors: it is being written, or what the system says.
  static config::Result<TraceFile> openToMend(const std::filesystem::path& path);
  TraceFile(TraceFile&& other) noexcept;
  TraceFile& operator=(TraceFile&&) = delete;
  ~TraceFile();

  const std::filesystem::path& path() const { return path_; }
  config::Result<std::uint64_t> size() const;
  /// All of `bytes`, or an error.
  config::Result<void> writeAt(std::uint64_t offset, std::string_view bytes);
  /// Into `to`, as many bytes as are there, at most `length`.
  config::Result<void> readAt(std::uint64_t offset, std::size_t length, std::string& to) const;
  config::Result<void> truncate(std::uint64_t size);
  /// Returns when the data are on the disk.
  config::Result<void> synchronise();

 private:
  TraceFile(std::filesystem::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
  static config::Result<TraceFile> open(const std::filesystem::path& path, int flags);
  static config::Result<TraceFile> openLocked(const std::filesystem::path& path, int flags);
  std::unexpected<config::Error> failure(std::string_view doing) const;

  std::filesystem::path path_;
  int descriptor_;
};

/// True if a TraceFile of some process may write this file.
bool isBeingWritten(const std::filesystem::path& file);

/// The name of a trace while it is written.
std::filesystem::path partOf(const std::filesystem::path& file);

/// Gives `part` the name `file`, so that it keeps it after a crash too.
/// Errors: `file` exists, or what the system says.
config::Result<void> renameDurably(const std::filesystem::path& part, const std::filesystem::path& file);

/// Makes the names in a folder survive a crash.
config::Result<void> synchroniseFolder(const std::filesystem::path& folder);

}  // namespace hapticd::drivers
