// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <expected>
#include <filesystem>
#include <string>

#include "config/base/descriptor.h"

namespace hapticd::base {

/// Kinds of files that may be read.
enum class FileKind {
  any,      ///< including pipes and devices, which may block the reader forever
  regular,  ///< regular files only, which never block
};

/// What to read, and its limits.
struct FileRequest {
  std::size_t longest = 0;  ///< largest number of bytes
  FileKind kind = FileKind::regular;
  bool follow_link = true;  ///< follow a symbolic link at the end of the path
};

/// Reason why a file was not read.
struct FileFault {
  enum class Reason { unreadable, not_regular, too_long };
  Reason reason = Reason::unreadable;
  int error_number = 0;     ///< errno if unreadable
  std::size_t longest = 0;  ///< the limit in bytes

  /// Returns a description, e.g. "is not a regular file".
  std::string text() const;
};

/// Opens a file for reading, if it is of that kind and, where it is regular, no longer.
/// Thread: any.  Progress: blocking; for a `regular` file only on the disk.
std::expected<Descriptor, FileFault> openFile(const std::filesystem::path& file, const FileRequest& request);

/// Reads a whole file.
/// Thread: any.  Progress: blocking; for a `regular` file only on the disk.
std::expected<std::string, FileFault> fileContent(const std::filesystem::path& file,
                                                  const FileRequest& request);

}  // namespace hapticd::base
