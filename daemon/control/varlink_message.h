// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <expected>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace hapticd::daemon {

/// What comes in: looked up by name.
using Json = nlohmann::json;
/// What goes out: keeps the order of the interface text, for people who read it raw.
using OrderedJson = nlohmann::ordered_json;

inline constexpr std::size_t kMaxCallBytes = 64 * 1024;  ///< without the NUL that ends it
inline constexpr std::size_t kMaxReplyBytes = 256 * 1024;
inline constexpr std::size_t kMaxCallDepth = 16;  ///< objects and arrays within each other

/// One method call. At most one of `oneway` and `more` is set.
struct Call {
  std::string method;  ///< full name
  Json parameters = Json::object();
  bool oneway = false;
  bool more = false;
  bool upgrade = false;
};

/// One reply to a call.
struct Reply {
  std::string error;  ///< full name; empty: success
  OrderedJson parameters = OrderedJson::object();
  bool continues = false;
};

/// The call that `message` (without the NUL) is.
/// Errors: why it is none; such a sender does not speak the protocol, is told so and closed. Beyond Varlink's
/// own rules a name that appears twice in any object is refused, because nobody can know which value was
/// meant.
std::expected<Call, std::string> parseCall(std::string_view message);

/// What the sender of something that is no call is told before its connection is closed. `reason`: may quote
/// what it sent; is cut and made printable.
Reply malformedCall(std::string_view reason);

/// The message, with the NUL that ends it. Numbers that are not finite become null, bytes that are not UTF-8
/// become U+FFFD.
std::string serialise(const Reply& reply);

}  // namespace hapticd::daemon
