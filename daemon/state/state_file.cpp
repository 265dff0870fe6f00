// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/state_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>

#include "config/descriptor.h"
#include "config/file_content.h"

namespace hapticd::daemon {
namespace {

namespace fs = std::filesystem;

// A profile with 16 paths of 256 points has about 250 kB.
constexpr std::size_t kLongestFile = std::size_t{1} << 20;

std::string remedyFor(int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return "create the folder, or name another one in state.folder";
    case EACCES:
    case EPERM:
    case EROFS:
      return "give the user of hapticd the right to write there, or name another folder in state.folder";
    case ENOSPC:
    case EDQUOT:
      return "make space on the disk";
    default:
      return "check the disk of state.folder";
  }
}

std::unexpected<config::Error> failure(const fs::path& file, const char* what, int error) {
  return std::unexpected(config::Error{
      file.string(), fmt::format("{}: {}", what, std::generic_category().message(error)), remedyFor(error)});
}

bool writeAll(int descriptor, std::string_view content) {
  while (!content.empty()) {
    const ssize_t count = ::write(descriptor, content.data(), content.size());
    if (count < 0 && errno != EINTR) return false;
    if (count > 0) content.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

bool synchronise(const fs::path& folder) {
  const config::Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return descriptor && ::fsync(descriptor.get()) == 0;
}

}  // namespace

config::Result<void> replaceFile(const fs::path& file, std::string_view content) {
  std::error_code ignored;  // writing fails then too, and reports the reason
  fs::create_directories(file.parent_path(), ignored);
  const fs::path temporary = file.string() + ".new";
  ::unlink(temporary.c_str());  // left behind by a process that crashed
  config::Descriptor descriptor(
      ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644));
  if (!descriptor) return failure(file, "cannot be written", errno);
  if (!writeAll(descriptor.get(), content) || ::fsync(descriptor.get()) != 0 ||
      std::rename(temporary.c_str(), file.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary.c_str());
    return failure(file, "cannot be written", error);
  }
  if (!synchronise(file.parent_path())) return failure(file, "may not survive a loss of power", errno);
  return {};
}

config::Result<void> removeFile(const fs::path& file) {
  if (::unlink(file.c_str()) != 0) {
    if (errno == ENOENT) return {};
    return failure(file, "cannot be removed", errno);
  }
  if (!synchronise(file.parent_path())) return failure(file, "may come back after a loss of power", errno);
  return {};
}

config::Result<std::optional<std::string>> readStateFile(const fs::path& file) {
  auto content = config::fileContent(file, {.longest = kLongestFile, .follow_link = false});
  if (content) return std::move(*content);
  using Reason = config::FileFault::Reason;
  const config::FileFault& fault = content.error();
  if (fault.reason == Reason::unreadable && (fault.error_number == ENOENT || fault.error_number == ENOTDIR)) {
    return std::nullopt;
  }
  if (fault.reason == Reason::unreadable) return failure(file, "cannot be read", fault.error_number);
  return std::unexpected(config::Error{file.string(), fault.text(), "remove it, and save it again"});
}

}  // namespace hapticd::daemon
