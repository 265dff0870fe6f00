// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"

/// Decides who may look: pure functions of a request's header, in the order in which refusalOf() applies
/// them; and the secret that a client shows, which members of the group haptic-view read from its file.
namespace hapticd::tools::view {

/// What the decision depends on.
struct RequestHead {
  std::string method = {};
  std::string target = {};                    ///< path and query, as sent
  std::vector<std::string> hosts = {};        ///< each field Host
  std::vector<std::string> origins = {};      ///< each field Origin
  std::vector<std::string> fetch_sites = {};  ///< each field Sec-Fetch-Site
  std::vector<std::string> cookies = {};      ///< each field Cookie
  bool has_body = false;
};

struct AccessRules {
  /// Numeric address at which the connection arrived, without brackets.
  std::string local_address = {};
  /// Accepted beside localhost and the local address: "name" with any port, or "name:port".
  std::vector<std::string> hosts = {};
  /// Accepted beside the page's own origin: "https://example.org", "file://".
  std::vector<std::string> origins = {};
  /// Empty: everybody may look.
  std::string token = {};
};

/// Why a request is refused.
struct Refusal {
  unsigned status = 403;    ///< of HTTP
  std::string reason = {};  ///< for the log; never holds a token
  bool by_token = false;    ///< everything else was right
};

/// The path of a target, without the query; what is not printable is replaced.
std::string pathOf(std::string_view target);
/// The value of `token=` in the query of a target; nothing: there is none.
std::optional<std::string> tokenInQuery(std::string_view target);
/// The token in the cookies; nothing: there is none.
std::optional<std::string> tokenInCookies(const std::vector<std::string>& cookies);

std::optional<Refusal> refusalByMethod(const RequestHead& head);
std::optional<Refusal> refusalByHost(const RequestHead& head, const AccessRules& rules);
std::optional<Refusal> refusalByOrigin(const RequestHead& head, const AccessRules& rules);
std::optional<Refusal> refusalByFetchSite(const RequestHead& head, const AccessRules& rules);
std::optional<Refusal> refusalByToken(const RequestHead& head, const AccessRules& rules);

/// The first refusal; nothing: the request may be answered.
std::optional<Refusal> refusalOf(const RequestHead& head, const AccessRules& rules);

/// The name of the cookie that holds the token.
inline constexpr std::string_view kTokenCookie = "hapticd-view";

inline constexpr std::size_t kTokenDigits = 32;  ///< hexadecimal: 128 bits

/// A new token from the kernel's random numbers.
base::Result<std::string> newToken();

/// Who may read a token.
enum class TokenReaders {
  owner_and_group,  ///< and with it look
  owner,            ///< this user alone, because the token is a right to change something
};

/// The token in that file. Where there is no file it is made, with a new token from the kernel's random
/// numbers, readable for its owner and, if it may be and exists, the group haptic-view.
/// Errors: others may read it, too.
base::Result<std::string> tokenOf(const std::filesystem::path& file,
                                  TokenReaders readers = TokenReaders::owner_and_group);

/// Whether both are equal. The time it takes depends on the lengths alone.
bool isSameToken(std::string_view given, std::string_view expected) noexcept;

}  // namespace hapticd::tools::view
