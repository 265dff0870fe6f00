// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/machine.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <sstream>

#include "config/base/value_text.h"

namespace hapticd::tools {
namespace {

constexpr std::size_t kMaxBytes = 1U << 20U;

std::unexpected<Unread> unread(int system_error, const std::string& path) {
  return std::unexpected(Unread{system_error, path});
}

void dropWhiteSpaceAtTheEnd(std::string& text) {
  text.erase(text.find_last_not_of(" \t\n\r") + 1);
}

Reading<std::string> contentOf(int file, const std::string& path) {
  std::string content;
  std::array<char, 4096> part{};
  while (content.size() < kMaxBytes) {
    const ssize_t count = ::read(file, part.data(), part.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return unread(errno, path);
    if (count == 0) break;
    content.append(part.data(), static_cast<std::size_t>(count));
  }
  return content;
}

/// The groups that the access control list of a file lets read and write; none where it has no list.
/// The format is that of Linux's acl(5): a version and entries of tag, permissions and number, little-endian.
std::vector<gid_t> groupsInAclOf(const std::filesystem::path& file) {
  struct Entry {
    std::uint16_t tag;
    std::uint16_t permissions;
    std::uint32_t id;
  };
  constexpr std::size_t kHead = sizeof(std::uint32_t);
  constexpr std::uint16_t kGroup = 0x08, kMask = 0x10, kReadAndWrite = 6;
  std::array<char, 4096> bytes;
  const ssize_t size = ::getxattr(file.c_str(), "system.posix_acl_access", bytes.data(), bytes.size());
  std::vector<Entry> entries;
  for (std::size_t at = kHead; size > 0 && at + sizeof(Entry) <= static_cast<std::size_t>(size);
       at += sizeof(Entry))
    std::memcpy(&entries.emplace_back(), bytes.data() + at, sizeof(Entry));
  std::uint16_t mask = kReadAndWrite;
  for (const Entry& entry : entries) {
    if (entry.tag == kMask) mask = entry.permissions;
  }
  std::vector<gid_t> groups;
  for (const Entry& entry : entries) {
    if (entry.tag == kGroup && (entry.permissions & mask & kReadAndWrite) == kReadAndWrite)
      groups.push_back(entry.id);
  }
  return groups;
}

}  // namespace

bool Unread::absent() const {
  return system_error == ENOENT || system_error == ENOTDIR;
}

bool Unread::denied() const {
  return system_error == EACCES || system_error == EPERM;
}

Reading<std::string> Machine::read(const std::string& path) const {
  // so that opening a pipe that somebody put there does not wait for its other end
  const int file = ::open((root_ / path).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (file < 0) return unread(errno, path);
  Reading<std::string> content = contentOf(file, path);
  ::close(file);
  if (content) dropWhiteSpaceAtTheEnd(*content);
  return content;
}

Reading<std::int64_t> Machine::readNumber(const std::string& path) const {
  const Reading<std::string> text = read(path);
  if (!text) return std::unexpected(text.error());
  if (const auto number = base::numberFrom<std::int64_t>(*text)) return *number;
  return unread(EINVAL, path);
}

Reading<Names> Machine::list(const std::string& path) const {
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(::opendir((root_ / path).c_str()), ::closedir);
  if (!folder) return unread(errno, path);
  Names names;
  while (const dirent* entry = ::readdir(folder.get())) {
    if (entry->d_name[0] != '.') names.emplace_back(entry->d_name);
  }
  std::ranges::sort(names, [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  });
  return names;
}

Reading<Access> Machine::access(const std::string& path) const {
  struct stat status {};
  if (::stat((root_ / path).c_str(), &status) != 0) return unread(errno, path);
  return Access{status.st_mode & 07777U, status.st_uid, status.st_gid, groupsInAclOf(root_ / path)};
}

Reading<std::uint64_t> Machine::freeBytes(const std::string& path) const {
  struct statvfs disk {};
  if (::statvfs((root_ / path).c_str(), &disk) != 0) return unread(errno, path);
  return std::uint64_t{disk.f_bavail} * disk.f_frsize;
}

bool Machine::exists(const std::string& path) const {
  return access(path).has_value();
}

std::string Machine::linkedName(const std::string& path) const {
  std::error_code error;
  const std::filesystem::path target = std::filesystem::read_symlink(root_ / path, error);
  return error ? std::string() : target.filename().string();
}

std::string Machine::resolved(const std::string& path) const {
  std::error_code error;
  const std::filesystem::path root = std::filesystem::canonical(root_, error);
  const std::filesystem::path target = std::filesystem::weakly_canonical(root_ / path.substr(1), error);
  const std::string below = target.lexically_relative(root).string();
  return error || below.starts_with("..") ? path : "/" + below;
}

Reading<std::optional<Account>> Machine::group(const std::string& name) const {
  return account("etc/group", name);
}

Reading<std::optional<Account>> Machine::user(const std::string& name) const {
  return account("etc/passwd", name);
}

Reading<std::optional<Account>> Machine::account(const std::string& path, const std::string& name) const {
  const Reading<std::string> text = read(path);
  if (!text) return std::unexpected(text.error());
  std::istringstream lines(*text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(name + ":")) continue;
    const std::size_t begin = line.find(':', name.size() + 1);
    if (begin == std::string::npos) continue;
    Account found{name, 0};
    const auto [end, error] = std::from_chars(line.data() + begin + 1, line.data() + line.size(), found.id);
    if (error == std::errc()) return found;
  }
  return std::nullopt;
}

}  // namespace hapticd::tools
