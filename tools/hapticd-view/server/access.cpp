// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/access.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "config/base/descriptor.h"
#include "config/base/file_content.h"
#include "config/base/value_text.h"

namespace hapticd::tools::view {
namespace {

constexpr std::size_t kMaxQuoteLength = 80;

/// Part of a request as the log shows it: printable and short.
std::string shortQuote(std::string_view text) {
  return base::inQuotes(base::printable(text.substr(0, kMaxQuoteLength)));
}

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(),
                         [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return result;
}

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ') || text.starts_with('\t')) text.remove_prefix(1);
  while (text.ends_with(' ') || text.ends_with('\t')) text.remove_suffix(1);
  return text;
}

bool isPort(std::string_view text) {
  return text.size() <= 5 &&
         std::ranges::all_of(text, [](char digit) { return digit >= '0' && digit <= '9'; });
}

/// A Host field without its port, lower case; nothing: it is not of the form name, name:port or [IPv6]:port.
std::optional<std::string> nameOf(std::string_view host) {
  std::size_t end = host.size();
  if (host.starts_with('[')) {
    end = host.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    ++end;
  } else if (const std::size_t colon = host.find(':'); colon != std::string_view::npos) {
    end = colon;
  }
  const std::string_view port = host.substr(end);
  if (end == 0 || (!port.empty() && (port.size() == 1 || !port.starts_with(':') || !isPort(port.substr(1)))))
    return std::nullopt;
  return lower(host.substr(0, end));
}

/// An address as it stands in a Host field.
std::string bracketed(const std::string& address) {
  return address.find(':') == std::string::npos ? address : "[" + address + "]";
}

bool contains(const std::vector<std::string>& list, const std::string& text) {
  return std::ranges::any_of(list, [&](const std::string& entry) { return lower(entry) == text; });
}

/// Whether the field Origin names a site that the configuration has let in.
bool isListedOrigin(const RequestHead& head, const AccessRules& rules) {
  return head.origins.size() == 1 && contains(rules.origins, lower(head.origins.front()));
}

Refusal refused(unsigned status, std::string reason) {
  return {.status = status, .reason = std::move(reason)};
}

}  // namespace

std::string pathOf(std::string_view target) {
  return base::printable(target.substr(0, std::min(target.find('?'), kMaxQuoteLength)));
}

std::optional<std::string> tokenInQuery(std::string_view target) {
  constexpr std::string_view kName = "token=";
  const std::size_t mark = target.find('?');
  if (mark == std::string_view::npos) return std::nullopt;
  std::string_view query = target.substr(mark + 1);
  while (!query.empty()) {
    const std::string_view pair = query.substr(0, query.find('&'));
    if (pair.starts_with(kName)) return std::string(pair.substr(kName.size()));
    query.remove_prefix(std::min(pair.size() + 1, query.size()));
  }
  return std::nullopt;
}

std::optional<std::string> tokenInCookies(const std::vector<std::string>& cookies) {
  for (const std::string& field : cookies) {
    std::string_view rest = field;
    while (!rest.empty()) {
      const std::string_view piece = rest.substr(0, rest.find(';'));
      rest.remove_prefix(std::min(piece.size() + 1, rest.size()));
      const std::string_view pair = trimmed(piece);
      if (pair.starts_with(kTokenCookie) && pair.substr(kTokenCookie.size()).starts_with('='))
        return std::string(pair.substr(kTokenCookie.size() + 1));
    }
  }
  return std::nullopt;
}

std::optional<Refusal> refusalByMethod(const RequestHead& head) {
  if (head.method != "GET")
    return refused(405, fmt::format("the method {} is not GET", shortQuote(head.method)));
  if (head.has_body) return refused(400, "a GET request with a body");
  return std::nullopt;
}

std::optional<Refusal> refusalByHost(const RequestHead& head, const AccessRules& rules) {
  if (head.hosts.size() != 1)
    return refused(400, fmt::format("{} fields Host instead of one", head.hosts.size()));
  const std::string host = lower(trimmed(head.hosts.front()));
  const auto name = nameOf(host);
  // Any port is right: `ssh -L` may forward another one, and a page from elsewhere cannot choose this name.
  const std::array own{std::string("localhost"), std::string("127.0.0.1"), std::string("[::1]"),
                       bracketed(rules.local_address)};
  if (name && (std::ranges::find(own, *name) != own.end() || contains(rules.hosts, *name) ||
               contains(rules.hosts, host))) {
    return std::nullopt;
  }
  return refused(403, fmt::format("the host {} is not in the list (--allow-host)", shortQuote(host)));
}

std::optional<Refusal> refusalByOrigin(const RequestHead& head, const AccessRules& rules) {
  if (head.origins.empty()) return std::nullopt;
  if (head.origins.size() > 1) return refused(400, "several fields Origin");
  const std::string origin = lower(trimmed(head.origins.front()));
  const std::string host = head.hosts.empty() ? "" : lower(trimmed(head.hosts.front()));
  // https: behind a proxy that encrypts
  if (origin == "http://" + host || origin == "https://" + host || isListedOrigin(head, rules))
    return std::nullopt;
  return refused(403, fmt::format("the origin {} is not in the list (--allow-origin)", shortQuote(origin)));
}

std::optional<Refusal> refusalByFetchSite(const RequestHead& head, const AccessRules& rules) {
  for (const std::string& site : head.fetch_sites) {
    if (lower(trimmed(site)) == "cross-site" && !isListedOrigin(head, rules))
      return refused(403, "a request from the page of another site (Sec-Fetch-Site)");
  }
  return std::nullopt;
}

std::optional<Refusal> refusalByToken(const RequestHead& head, const AccessRules& rules) {
  if (rules.token.empty()) return std::nullopt;
  const auto in_query = tokenInQuery(head.target);
  const auto given = in_query ? in_query : tokenInCookies(head.cookies);
  if (given && isSameToken(*given, rules.token)) return std::nullopt;
  return Refusal{.status = 401, .reason = given ? "a wrong token" : "no token", .by_token = true};
}

std::optional<Refusal> refusalOf(const RequestHead& head, const AccessRules& rules) {
  if (auto refusal = refusalByMethod(head)) return refusal;
  if (auto refusal = refusalByHost(head, rules)) return refusal;
  if (auto refusal = refusalByOrigin(head, rules)) return refusal;
  if (auto refusal = refusalByFetchSite(head, rules)) return refusal;
  return refusalByToken(head, rules);
}

namespace {

constexpr const char* kGroup = "haptic-view";
constexpr mode_t kGroupMode = 0640;

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
base::Result<void> writeToken(const std::filesystem::path& file, const std::string& token,
                              TokenReaders readers) {
  std::string draft = file.string() + ".XXXXXX";
  const base::Descriptor descriptor(::mkostemp(draft.data(), O_CLOEXEC));  // of mode 0600
  if (!descriptor) return systemError(file, "cannot be made");
  const std::string line = token + "\n";
  const bool for_group = readers == TokenReaders::owner_and_group;
  if (for_group) giveToGroup(descriptor.get());
  bool good = ::write(descriptor.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size());
  good = good && (!for_group || ::fchmod(descriptor.get(), kGroupMode) == 0);
  // link() refuses where another process has made the file meanwhile, and then that one's token holds
  good = good && (::link(draft.c_str(), file.c_str()) == 0 || errno == EEXIST);
  const auto failed = systemError(file, "cannot be written");
  ::unlink(draft.c_str());
  if (!good) return failed;
  return {};
}

base::Result<std::string> readToken(const std::filesystem::path& file, TokenReaders readers) {
  struct stat status {};
  const bool known = ::stat(file.c_str(), &status) == 0;
  if (known && readers == TokenReaders::owner &&
      ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0 || status.st_uid != ::geteuid())) {
    return std::unexpected(Error{file.string(),
                                 "others than this user may use this token, which lets a page add fixtures",
                                 "name another file with --token-file; it is made"});
  }
  if (known && (status.st_mode & S_IRWXO) != 0) {
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

base::Result<std::string> tokenOf(const std::filesystem::path& file, TokenReaders readers) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    const auto token = newToken();
    if (!token) return token;
    if (auto written = writeToken(file, *token, readers); !written) return std::unexpected(written.error());
  }
  return readToken(file, readers);
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
