// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/token.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "config/base/descriptor.h"
#include "config/base/file_content.h"

namespace hapticd::tools::view {
namespace {

constexpr const char* kGroup = "haptic-view";
constexpr mode_t kMode = 0640;

using base::Error;

bool isHexadecimal(std::string_view text) {
  return std::ranges::all_of(
      text, [](char digit) { return (digit >= '0' && digit <= '9') || (digit >= 'a' && digit <= 'f'); });
}

std::unexpected<Error> systemError(const std::filesystem::path& file, const char* what) {
  const int error = errno;
  return std::unexpected(Error{file.string(), fmt::format("{}: {}", what, std::strerror(error)),
                               "name a file in a folder that hapticd-view may write with --token-file"});
}

/// Gives the file to the group, where there is one of that name and this process may.
void giveToGroup(int descriptor) {
  struct group entry {};
  struct group* found = nullptr;
  std::array<char, 4096> names;
  if (::getgrnam_r(kGroup, &entry, names.data(), names.size(), &found) != 0 || found == nullptr) return;
  // a person who runs hapticd-view without being a member keeps the token for himself
  [[maybe_unused]] const int ignored = ::fchown(descriptor, static_cast<uid_t>(-1), entry.gr_gid);
}

/// Writes a draft beside the file and gives it the file's name, so that no reader finds half a token.
base::Result<void> writeToken(const std::filesystem::path& file, const std::string& token) {
  std::string draft = file.string() + ".XXXXXX";
  const base::Descriptor descriptor(::mkostemp(draft.data(), O_CLOEXEC));  // of mode 0600
  if (!descriptor) return systemError(file, "cannot be made");
  const std::string line = token + "\n";
  giveToGroup(descriptor.get());
  bool good = ::write(descriptor.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size());
  good = good && ::fchmod(descriptor.get(), kMode) == 0;
  // link() refuses where another process has made the file meanwhile, and then that one's token holds
  good = good && (::link(draft.c_str(), file.c_str()) == 0 || errno == EEXIST);
  const auto failed = systemError(file, "cannot be written");
  ::unlink(draft.c_str());
  if (!good) return failed;
  return {};
}

base::Result<std::string> readToken(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) == 0 && (status.st_mode & S_IRWXO) != 0) {
    return std::unexpected(Error{file.string(), "others than owner and group may use this token",
                                 fmt::format("remove the file, so that a new one is made")});
  }
  const auto content = base::fileContent(file, {.longest = 1024});
  if (!content) return std::unexpected(Error{file.string(), content.error().text(), ""});
  const std::string token = content->substr(0, content->find('\n'));
  if (token.size() == kTokenDigits && isHexadecimal(token)) return token;
  return std::unexpected(Error{file.string(), fmt::format("is not {} hexadecimal digits", kTokenDigits),
                               "remove the file, so that a new one is made"});
}

}  // namespace

base::Result<std::string> newToken() {
  std::array<std::uint8_t, kTokenDigits / 2> bytes{};
  // never interrupted, and never less, for so few bytes: getrandom(2)
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    return std::unexpected(Error{"", "the kernel gives no random numbers", ""});
  std::string token;
  for (const std::uint8_t byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

base::Result<std::string> tokenOf(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    const auto token = newToken();
    if (!token) return token;
    if (auto written = writeToken(file, *token); !written) return std::unexpected(written.error());
  }
  return readToken(file);
}

bool isSameToken(std::string_view given, std::string_view expected) noexcept {
  if (given.size() != expected.size()) return false;
  // volatile: the compiler must not end the comparison at the first difference
  volatile unsigned char difference = 0;
  for (std::size_t i = 0; i < given.size(); ++i) {
    difference = static_cast<unsigned char>(
        difference | (static_cast<unsigned char>(given[i]) ^ static_cast<unsigned char>(expected[i])));
  }
  return difference == 0;
}

}  // namespace hapticd::tools::view
