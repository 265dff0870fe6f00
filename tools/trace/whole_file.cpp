#include "tools/trace/whole_file.h"

#include <utility>

namespace hapticd::tools {

config::Result<WholeFile> WholeFile::create(const std::filesystem::path& file) {
  const std::filesystem::path part = drivers::partOf(file);
  std::error_code ignored;
  for (const std::filesystem::path& path : {file, part}) {
    if (!std::filesystem::exists(path, ignored)) continue;
    return std::unexpected(
        config::Error{path.string(), "is there already", "choose another name, or delete that file"});
  }
  return WholeFile(file);
}

WholeFile::WholeFile(WholeFile&& other) noexcept
    : file_(std::move(other.file_)),
      part_(std::move(other.part_)),
      stream_(std::move(other.stream_)),
      bytes_(other.bytes_),
      ours_(std::exchange(other.ours_, false)) {}

WholeFile::~WholeFile() {
  std::error_code ignored;
  if (ours_) std::filesystem::remove(part_, ignored);
}

config::Result<void> WholeFile::append(std::string_view bytes) {
  if (!stream_) {
    auto stream = drivers::TraceFile::create(part_);
    if (!stream) {
      ours_ = false;
      return std::unexpected(stream.error());
    }
    stream_.emplace(std::move(*stream));
  }
  auto written = stream_->writeAt(bytes_, bytes);
  bytes_ += bytes.size();
  return written;
}

config::Result<void> WholeFile::finish() {
  if (stream_) {
    if (auto written = stream_->synchronise(); !written) return written;
  }
  auto renamed = drivers::renameDurably(part_, file_);
  if (renamed) ours_ = false;
  return renamed;
}

}  // namespace hapticd::tools
