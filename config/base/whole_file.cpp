// SPDX-License-Identifier: Apache-2.0
#include "config/base/whole_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

namespace hapticd::base {
namespace {

std::unexpected<Error> systemError(const std::filesystem::path& file, const char* what) {
  const int error = errno;
  return std::unexpected(Error{file.string(), fmt::format("{}: {}", what, std::strerror(error)),
                               error == ENOSPC || error == EFBIG || error == EDQUOT
                                   ? "free space or choose another disk"
                                   : "choose a folder you may write to"});
}

std::unexpected<Error> alreadyThere(const std::filesystem::path& file) {
  return std::unexpected(
      Error{file.string(), "exists already", "give another name, or --force to replace it"});
}

/// mkstemp() lets nobody else read; a file that a person asked for follows the umask like any other.
mode_t usualMode() {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666U & ~mask;
}

int renameTo(const std::filesystem::path& draft, const std::filesystem::path& file, IfExists if_exists) {
  if (if_exists == IfExists::replace) return ::rename(draft.c_str(), file.c_str());
  const int renamed =
      ::renameat2(AT_FDCWD, draft.c_str(), AT_FDCWD, file.c_str(), static_cast<unsigned>(RENAME_NOREPLACE));
  if (renamed == 0 || errno != EINVAL) return renamed;
  // A network file system does not know the flag; there the check of create() has to do.
  return ::rename(draft.c_str(), file.c_str());
}

}  // namespace

Result<void> mayWrite(const std::filesystem::path& file, IfExists if_exists) {
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  if (!std::filesystem::exists(status)) return {};
  if (!std::filesystem::is_regular_file(status)) {
    return std::unexpected(Error{file.string(), "is not a file that can be replaced", "give another name"});
  }
  if (if_exists == IfExists::refuse) return alreadyThere(file);
  return {};
}

Result<void> checkEnding(const std::filesystem::path& file, std::span<const std::string_view> endings) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (std::ranges::find(endings, ending) != endings.end()) return {};
  return std::unexpected(Error{file.string(),
                               ending.empty() ? "has no ending that states its format"
                                              : "has an ending of a format that is not written",
                               fmt::format("end the name in {}", fmt::join(endings, " or "))});
}

Result<WholeFile> WholeFile::create(const std::filesystem::path& file, IfExists if_exists) {
  if (auto good = mayWrite(file, if_exists); !good) return std::unexpected(good.error());
  std::string draft = file.string() + ".XXXXXX";
  const int descriptor = ::mkstemp(draft.data());
  if (descriptor < 0) return systemError(file, "cannot be created");
  WholeFile made(file, draft, descriptor, if_exists);
  if (::fchmod(descriptor, usualMode()) != 0) return systemError(file, "cannot be created");
  return made;
}

WholeFile::WholeFile(WholeFile&& other) noexcept
    : file_(std::move(other.file_)),
      draft_(std::move(other.draft_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      if_exists_(other.if_exists_) {}

WholeFile::~WholeFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(draft_.c_str());
}

Result<void> WholeFile::append(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return systemError(file_, "cannot be written");
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return {};
}

Result<void> WholeFile::finish() {
  if (::fsync(descriptor_) != 0) return systemError(file_, "cannot be written");
  if (renameTo(draft_, file_, if_exists_) != 0) {
    if (errno == EEXIST) return alreadyThere(file_);
    return systemError(file_, "cannot be created");
  }
  ::close(std::exchange(descriptor_, -1));
  return {};
}

Result<void> writeWholeFile(const std::filesystem::path& file, std::string_view bytes, IfExists if_exists) {
  auto whole = WholeFile::create(file, if_exists);
  if (!whole) return std::unexpected(whole.error());
  if (auto written = whole->append(bytes); !written) return written;
  return whole->finish();
}

}  // namespace hapticd::base
