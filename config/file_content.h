// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <expected>
#include <filesystem>
#include <string>

namespace hapticd::config {

/// What may be read as a file.
enum class FileKind {
  any,      ///< pipes and devices too, which may make the reader wait for ever
  regular,  ///< only what answers by itself
};

struct FileRequest {
  std::size_t longest = 0;  ///< bytes
  FileKind kind = FileKind::regular;
  bool follow_link = true;  ///< at the end of the path
};

/// Why a file was not read.
struct FileFault {
  enum class Reason { unreadable, not_regular, too_long };
  Reason reason = Reason::unreadable;
  int error_number = 0;     ///< errno, of what is unreadable
  std::size_t longest = 0;  ///< that was allowed

  /// "is no regular file".
  std::string text() const;
};

/// All that a file holds.  Thread: any.  Progress: blocking, on the disk alone where the kind is `regular`.
std::expected<std::string, FileFault> fileContent(const std::filesystem::path& file,
                                                  const FileRequest& request);

}  // namespace hapticd::config
