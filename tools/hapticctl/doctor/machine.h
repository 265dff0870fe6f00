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

/// Why a file could not be read.
struct Unread {
  int system_error = 0;   ///< errno
  std::string path = {};  ///< without the leading slash

  bool absent() const;
  bool denied() const;
};

template <typename T>
using Reading = std::expected<T, Unread>;

using Names = std::vector<std::string>;

/// Owner and permissions of a file.
struct Access {
  mode_t mode = 0;  ///< permission bits only
  uid_t owner = 0;
  gid_t group = 0;
  std::vector<gid_t> more_groups = {};  ///< that an access control list lets read and write too
};

/// A line of /etc/passwd or /etc/group, with the fields that matter here.
struct Account {
  std::string name;
  std::uint32_t id = 0;
};

/// A machine as its kernel and its files describe it. The files are read below a folder that stands for "/";
/// all paths are given without the leading slash. Thread: any; each call reads the file again.
class Machine {
 public:
  explicit Machine(std::filesystem::path root) : root_(std::move(root)) {}

  const std::filesystem::path& root() const { return root_; }

  /// The content of a file, at most 1 MiB, without white space at its end.
  Reading<std::string> read(const std::string& path) const;
  /// The decimal integer in a file; EINVAL for other content.
  Reading<std::int64_t> readNumber(const std::string& path) const;
  /// The names in a folder, shorter ones first, so that numbers are in order.
  Reading<Names> list(const std::string& path) const;
  Reading<Access> access(const std::string& path) const;
  /// The bytes that programs without privileges may still use on the disk that holds the path.
  Reading<std::uint64_t> freeBytes(const std::string& path) const;
  bool exists(const std::string& path) const;
  /// The path, which begins with a slash, with its links followed; as it is where it does not exist.
  std::string resolved(const std::string& path) const;
  /// The last part of the target of a link; empty if it is not a link.
  std::string linkedName(const std::string& path) const;

  /// An entry of this machine, not of a directory service; nothing if there is none of that name.
  Reading<std::optional<Account>> group(const std::string& name) const;
  Reading<std::optional<Account>> user(const std::string& name) const;

 private:
  Reading<std::optional<Account>> account(const std::string& path, const std::string& name) const;

  std::filesystem::path root_;
};

}  // namespace hapticd::tools
