#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "config/error.h"
#include "drivers/trace/trace_file.h"

namespace hapticd::tools {

/// A file that is there whole or not at all: it is written under another name beside it, which goes away
/// with the object unless finish() succeeded.
/// Thread: one.
class WholeFile {
 public:
  /// Errors: the file exists.
  static config::Result<WholeFile> create(const std::filesystem::path& file);
  WholeFile(WholeFile&& other) noexcept;
  WholeFile& operator=(WholeFile&&) = delete;
  ~WholeFile();

  /// Where to write meanwhile, for a library or program that opens the file itself.
  const std::filesystem::path& part() const { return part_; }
  config::Result<void> append(std::string_view bytes);
  /// Gives the file its name.  Errors: the disk's, somebody has made one of that name meanwhile.
  config::Result<void> finish();

 private:
  explicit WholeFile(const std::filesystem::path& file) : file_(file), part_(drivers::partOf(file)) {}

  std::filesystem::path file_;
  std::filesystem::path part_;
  std::optional<drivers::TraceFile> stream_;  ///< from the first append() on
  std::uint64_t bytes_ = 0;
  bool ours_ = true;
};

}  // namespace hapticd::tools
