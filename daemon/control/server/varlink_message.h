// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <expected>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "config/base/descriptor.h"

namespace hapticd::daemon {

/// JSON of calls, whose fields are looked up by name.
using Json = nlohmann::json;
/// JSON of replies: it keeps the order of the interface text, for people who read it raw.
using OrderedJson = nlohmann::ordered_json;

inline constexpr std::size_t kMaxCallBytes = 64 * 1024;  ///< without the NUL that ends it
/// On connections that may control: a set of fixtures with long paths is changed in one call.
inline constexpr std::size_t kMaxControlCallBytes = 512 * 1024;
inline constexpr std::size_t kMaxReplyBytes = 512 * 1024;
inline constexpr std::size_t kMaxCallDepth = 16;  ///< objects and arrays within each other

/// A method call. At most one of `oneway` and `more` is set.
struct Call {
  std::string method;  ///< full name
  Json parameters = Json::object();
  bool oneway = false;
  bool more = false;
  bool upgrade = false;
  /// A file that the client passed along (SCM_RIGHTS), which the method may take; null: none.
  std::shared_ptr<base::Descriptor> descriptor = nullptr;
};

/// A reply to a call.
struct Reply {
  std::string error;  ///< full name; empty: success
  OrderedJson parameters = OrderedJson::object();
  bool continues = false;
  int descriptor = -1;  ///< a file to pass along, which stays the caller's; -1: none
};

/// Parses a message (without the NUL) as a call.
/// Errors: the reason why it is not a call; the sender does not speak the protocol, gets MalformedCall and is
/// disconnected. Beyond Varlink's own rules a name that appears twice in an object is refused, because nobody
/// can know which value was meant.
std::expected<Call, std::string> parseCall(std::string_view message);

/// The reply to something that is not a call, before its connection is closed. `reason` may quote the
/// message; it is cut and made printable.
Reply malformedCall(std::string_view reason);

/// The reply as a message, with the NUL that ends it. Numbers that are not finite become null, bytes that are
/// not UTF-8 become U+FFFD.
std::string serialise(const Reply& reply);

}  // namespace hapticd::daemon
