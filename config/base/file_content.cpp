// SPDX-License-Identifier: Apache-2.0
#include "config/base/file_content.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <system_error>

namespace hapticd::base {
namespace {

int flagsOf(const FileRequest& request) {
  int flags = O_RDONLY | O_CLOEXEC | O_NOCTTY;
  // Opening a pipe would wait for its writer.
  if (request.kind == FileKind::regular) flags |= O_NONBLOCK;
  if (!request.follow_link) flags |= O_NOFOLLOW;
  return flags;
}

std::unexpected<FileFault> unreadable(int error_number) {
  return std::unexpected(FileFault{FileFault::Reason::unreadable, error_number, 0});
}

std::optional<FileFault> faultOfKind(int descriptor, std::size_t longest) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return FileFault{FileFault::Reason::unreadable, errno, 0};
  if (S_ISDIR(status.st_mode)) return FileFault{FileFault::Reason::unreadable, EISDIR, 0};
  if (!S_ISREG(status.st_mode)) return FileFault{FileFault::Reason::not_regular, 0, 0};
  // Before any of it is read. A file may still grow, and those of /proc state no size.
  if (static_cast<std::uintmax_t>(status.st_size) > longest)
    return FileFault{FileFault::Reason::too_long, 0, longest};
  return std::nullopt;
}

}  // namespace

std::string FileFault::text() const {
  switch (reason) {
    case Reason::not_regular:
      return "is not a regular file";
    case Reason::too_long:
      return fmt::format("is longer than {} bytes", longest);
    case Reason::unreadable:
      break;
  }
  return fmt::format("cannot be read: {}", std::generic_category().message(error_number));
}

std::expected<Descriptor, FileFault> openFile(const std::filesystem::path& file, const FileRequest& request) {
  Descriptor open_file(::open(file.c_str(), flagsOf(request)));
  if (!open_file) return unreadable(errno);
  if (request.kind == FileKind::regular) {
    if (const auto fault = faultOfKind(open_file.get(), request.longest)) return std::unexpected(*fault);
  }
  return open_file;
}

std::expected<std::string, FileFault> fileContent(const std::filesystem::path& file,
                                                  const FileRequest& request) {
  const auto open_file = openFile(file, request);
  if (!open_file) return std::unexpected(open_file.error());
  constexpr std::size_t kChunk = 64 * 1024;
  std::string content;
  std::size_t length = 0;
  while (length <= request.longest) {
    content.resize(std::min(length + kChunk, request.longest + 1));
    const ssize_t count = ::read(open_file->get(), content.data() + length, content.size() - length);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return unreadable(errno);
    if (count == 0) break;
    length += static_cast<std::size_t>(count);
  }
  if (length > request.longest) {
    return std::unexpected(FileFault{FileFault::Reason::too_long, 0, request.longest});
  }
  content.resize(length);
  return content;
}

}  // namespace hapticd::base
