// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include "config/base/error.h"

namespace hapticd::base {

enum class IfExists { refuse, replace };

/// A file that is written completely or not at all, also after a crash or on a full disk: it is written as a
/// draft of another name in the same folder, which goes away with the object unless finish() succeeded.
/// Thread: one.  RT: not safe.
class WholeFile {
 public:
  /// Errors: the file exists and is not to be replaced, the folder is missing or not writable.
  static Result<WholeFile> create(const std::filesystem::path& file, IfExists if_exists = IfExists::refuse);
  WholeFile(WholeFile&& other) noexcept;
  WholeFile& operator=(WholeFile&&) = delete;
  ~WholeFile();

  /// An empty file, for a library or program that opens by name what it writes.
  const std::filesystem::path& draft() const { return draft_; }
  /// Errors: the disk's.
  Result<void> append(std::string_view bytes);
  /// Gives the file its name.  Errors: the disk's, somebody has made one of that name meanwhile.
  Result<void> finish();

 private:
  WholeFile(std::filesystem::path file, std::filesystem::path draft, int descriptor, IfExists if_exists)
      : file_(std::move(file)), draft_(std::move(draft)), descriptor_(descriptor), if_exists_(if_exists) {}

  std::filesystem::path file_;
  std::filesystem::path draft_;
  int descriptor_;  ///< of the draft; -1 from finish() on
  IfExists if_exists_;
};

/// Writes `bytes` to a file as WholeFile does.
Result<void> writeWholeFile(const std::filesystem::path& file, std::string_view bytes, IfExists if_exists);

/// Checks in advance whether create() would succeed, for work that takes long.
/// Errors: a file exists and is not to be replaced; a device, pipe or folder has that name.
Result<void> mayWrite(const std::filesystem::path& file, IfExists if_exists);

/// Checks that the ending of a file's name stands for a format.  Errors: it is none of `endings` (".csv"), in
/// small letters or capitals.
Result<void> checkEnding(const std::filesystem::path& file, std::span<const std::string_view> endings);

}  // namespace hapticd::base
