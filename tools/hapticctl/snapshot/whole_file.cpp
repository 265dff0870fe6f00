#include "tools/hapticctl/snapshot/whole_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace hapticd::tools {
namespace {

using config::Error;
using config::Result;

Error systemError(const std::filesystem::path& file, const char* what) {
  const int error = errno;
  return {file.string(), fmt::format("{}: {}", what, std::strerror(error)),
          error == ENOSPC || error == EFBIG ? "free space or choose another disk"
                                            : "choose a folder you may write to"};
}

bool writeAll(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return ::fsync(descriptor) == 0;
}

/// mkstemp() lets nobody else read; a file that a person asked for follows the umask like any other.
mode_t usualMode() {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666U & ~mask;
}

Error alreadyThere(const std::filesystem::path& file) {
  return {file.string(), "exists already", "give another name, or --force to replace it"};
}

}  // namespace

Result<void> mayWrite(const std::filesystem::path& file, bool replace) {
  std::error_code ignored;
  if (!replace && std::filesystem::exists(file, ignored)) return std::unexpected(alreadyThere(file));
  return {};
}

Result<void> writeWholeFile(const std::filesystem::path& file, std::string_view bytes, bool replace) {
  std::string draft = file.string() + ".XXXXXX";
  const int descriptor = ::mkstemp(draft.data());
  if (descriptor < 0) return std::unexpected(systemError(file, "cannot be created"));
  const bool written = writeAll(descriptor, bytes) && ::fchmod(descriptor, usualMode()) == 0;
  Result<void> result;
  if (!written) result = std::unexpected(systemError(file, "cannot be written"));
  ::close(descriptor);
  const unsigned flags = replace ? 0U : static_cast<unsigned>(RENAME_NOREPLACE);
  if (written && ::renameat2(AT_FDCWD, draft.c_str(), AT_FDCWD, file.c_str(), flags) != 0) {
    result = std::unexpected(errno == EEXIST ? alreadyThere(file) : systemError(file, "cannot be created"));
  }
  if (!result) ::unlink(draft.c_str());
  return result;
}

}  // namespace hapticd::tools
