// SPDX-License-Identifier: Apache-2.0
#include "config/base/held_bytes.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <string>

namespace hapticd::base {
namespace {

constexpr int kSeals = F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW;

struct Copy {
  std::string text;
  std::string_view bytes;
};

/// A memory file in one piece of addresses, which is filled in parts.
class Mapping {
 public:
  Mapping(const Descriptor& memory, std::size_t size) {
    const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    const std::size_t whole_pages = (size + page - 1) / page * page;
    reserved_ = whole_pages + page;  // one behind the bytes, which may end with their page
    begin_ = ::mmap(nullptr, reserved_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (begin_ == MAP_FAILED) return;
    for (std::size_t at = 0; at < whole_pages; at += kBytesAtOnce) {
      const std::size_t part = std::min(kBytesAtOnce, whole_pages - at);
      if (!map(at, part, MAP_PRIVATE, memory.get())) return;
    }
    if (!map(whole_pages, page, MAP_PRIVATE | MAP_ANONYMOUS, -1)) return;
    bytes_ = {static_cast<const char*>(begin_), size};
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping() {
    if (begin_ == MAP_FAILED) return;
    for (std::size_t at = 0; at < reserved_; at += kBytesAtOnce)
      ::munmap(static_cast<char*>(begin_) + at, std::min(kBytesAtOnce, reserved_ - at));
  }

  /// Empty: it could not be mapped.
  const std::string_view& bytes() const { return bytes_; }

 private:
  bool map(std::size_t at, std::size_t size, int flags, int memory) {
    return ::mmap(static_cast<char*>(begin_) + at, size, PROT_READ, flags | MAP_FIXED, memory,
                  memory < 0 ? 0 : static_cast<off_t>(at)) != MAP_FAILED;
  }

  std::size_t reserved_ = 0;
  void* begin_ = MAP_FAILED;
  std::string_view bytes_;
};

std::unexpected<FileFault> unreadable(int error_number) {
  return std::unexpected(FileFault{FileFault::Reason::unreadable, error_number, 0});
}

}  // namespace

HeldBytes heldCopy(std::string_view bytes) {
  const auto copy = std::make_shared<Copy>();
  copy->text.reserve(bytes.size() + kReadableBehind);
  copy->text += bytes;
  copy->text.append(kReadableBehind, '\0');
  copy->bytes = std::string_view(copy->text).substr(0, bytes.size());
  return {copy, &copy->bytes};
}

HeldBytes mappedMemory(const Descriptor& memory, std::size_t longest) {
  struct stat status {};
  const int seals = ::fcntl(memory.get(), F_GET_SEALS);
  if (seals < 0 || (seals & kSeals) != kSeals || ::fstat(memory.get(), &status) != 0 || status.st_size <= 0 ||
      static_cast<std::uintmax_t>(status.st_size) > longest)
    return nullptr;
  const auto mapping = std::make_shared<const Mapping>(memory, static_cast<std::size_t>(status.st_size));
  return mapping->bytes().empty() ? nullptr : HeldBytes(mapping, &mapping->bytes());
}

std::expected<HeldBytes, FileFault> mappedCopy(const std::filesystem::path& file,
                                               const FileRequest& request) {
  const auto from = openFile(file, request);
  if (!from) return std::unexpected(from.error());
  const Descriptor memory(::memfd_create("hapticd-file", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!memory) return unreadable(errno);
  std::size_t length = 0;
  for (ssize_t count = 1; count != 0 && length <= request.longest;) {
    count = ::sendfile(memory.get(), from->get(), nullptr, kBytesAtOnce);
    if (count < 0 && errno != EINTR) return unreadable(errno);
    length += static_cast<std::size_t>(std::max(count, ssize_t{0}));
  }
  if (length > request.longest)
    return std::unexpected(FileFault{FileFault::Reason::too_long, 0, request.longest});
  if (length == 0) return heldCopy("");
  if (::fcntl(memory.get(), F_ADD_SEALS, kSeals) != 0) return unreadable(errno);
  HeldBytes bytes = mappedMemory(memory, length);
  return bytes ? std::expected<HeldBytes, FileFault>(std::move(bytes)) : unreadable(ENOMEM);
}

}  // namespace hapticd::base
