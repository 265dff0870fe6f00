// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/udp/key_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "config/base/descriptor.h"

namespace hapticd::drivers::udp {
namespace {

std::unexpected<base::Error> refused(const std::string& path, std::string what, const char* remedy) {
  return std::unexpected(base::Error{fmt::format("key file {}", path), std::move(what), remedy});
}

}  // namespace

base::Result<std::vector<std::byte>> keyFrom(const std::string& path) {
  std::vector<std::byte> key;
  if (path.empty()) return key;
  const base::Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (!file || ::fstat(file.get(), &status) != 0) {
    return refused(path, std::strerror(errno),
                   "let the program's user or group read it, or correct its path");
  }
  if (!S_ISREG(status.st_mode)) return refused(path, "not a regular file", "correct its path");
  if ((status.st_mode & S_IRWXO) != 0) {
    return refused(path, "others may read or write it",
                   "run chmod o= on it, and make a new key if others had access");
  }
  key.resize(kMaxKeyBytes + 1);
  const ssize_t size = ::read(file.get(), key.data(), key.size());
  if (size < 0) return refused(path, std::strerror(errno), "");
  key.resize(static_cast<std::size_t>(size));
  if (key.size() < kMinKeyBytes || key.size() > kMaxKeyBytes) {
    return refused(path,
                   fmt::format("has {} bytes, allowed: {} to {}", status.st_size, kMinKeyBytes, kMaxKeyBytes),
                   "make one with: openssl rand 32");
  }
  return key;
}

}  // namespace hapticd::drivers::udp
