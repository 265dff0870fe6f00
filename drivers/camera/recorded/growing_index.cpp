// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/growing_index.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace hapticd::drivers {
namespace {

config::Error diskError(const std::filesystem::path& where) {
  return {where.string(), fmt::format("cannot be written: {}", std::strerror(errno)), "check the disk"};
}

}  // namespace

config::Result<GrowingIndex> GrowingIndex::create(const std::filesystem::path& folder,
                                                  std::string_view name) {
  std::error_code failure;
  if (!std::filesystem::create_directory(folder, failure)) {
    return std::unexpected(
        config::Error{folder.string(), failure ? "cannot be created: " + failure.message() : "already exists",
                      "name a new folder in a writable one"});
  }
  std::filesystem::path file = folder / name;
  config::Descriptor index(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666));
  if (!index) return std::unexpected(diskError(file));
  return GrowingIndex(std::move(file), std::move(index));
}

config::Result<void> GrowingIndex::append(std::string_view line) {
  if (::write(index_.get(), line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    auto error = diskError(file_);
    (void)::ftruncate(index_.get(), bytes_);  // a partial line would make the index unreadable
    return std::unexpected(std::move(error));
  }
  bytes_ += static_cast<std::int64_t>(line.size());
  return {};
}

}  // namespace hapticd::drivers
