// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <expected>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace hapticd::tools {

/// Why a file says nothing.
struct Unread {
  int system_error = 0;  ///< errno

  bool absent() const;
  bool denied() const;
};

template <typename T>
using Reading = std::expected<T, Unread>;

using Names = std::vector<std::string>;

/// Who may use a file.
struct Access {
  mode_t mode = 0;  ///< permission bits only
  uid_t owner = 0;
  gid_t group = 0;
};

/// A line of /etc/passwd or /etc/group, as far as it matters here.
struct Account {
  std::string name;
  std::uint32_t id = 0;
};

/// What the kernel and the system's files tell about a machine: its files, below a folder that stands for
/// "/". All paths are given without the leading slash. Thread: any; each call reads anew.
class Machine {
 public:
  explicit Machine(std::filesystem::path root) : root_(std::move(root)) {}

  /// A file without the white space at its end, at most 1 MiB of it.
  Reading<std::string> read(const std::string& path) const;
  /// A file with a decimal integer; EINVAL for other content.
  Reading<std::int64_t> readNumber(const std::string& path) const;
  /// Names in a folder, shorter ones first, so that numbers stand in their order.
  Reading<Names> list(const std::string& path) const;
  Reading<Access> access(const std::string& path) const;
  /// That programs without privileges may use, on the disk that holds the path.
  Reading<std::uint64_t> freeBytes(const std::string& path) const;
  bool exists(const std::string& path) const;
  /// Last part of what a link points to; empty if it is none.
  std::string linkedName(const std::string& path) const;

  /// Of this machine only, not of a directory service; nothing if there is none of that name.
  Reading<std::optional<Account>> group(const std::string& name) const;
  Reading<std::optional<Account>> user(const std::string& name) const;

 private:
  Reading<std::optional<Account>> account(const std::string& path, const std::string& name) const;

  std::filesystem::path root_;
};

}  // namespace hapticd::tools
