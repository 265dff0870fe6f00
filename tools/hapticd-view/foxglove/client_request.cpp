// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/foxglove/client_request.h"

#include <algorithm>
#include <array>
#include <limits>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::view {
namespace {

using Outcome = std::expected<FoxgloveRequest, std::string>;

/// What changes the box or publishes to it; the others ask for information.
constexpr std::array<std::string_view, 2> kChanging{"setParameters", "advertise"};

std::optional<std::uint32_t> idIn(const Json* json) {
  if (json == nullptr || !json->is_number_unsigned()) return std::nullopt;
  const auto id = json->get<std::uint64_t>();
  if (id > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(id);
}

Outcome subscribe(const Json& message) {
  Subscribe request;
  for (const Json& item : listAt(message, "subscriptions")) {
    const auto subscription = idIn(fieldAt(item, "id"));
    const auto channel = idIn(fieldAt(item, "channelId"));
    if (!subscription || !channel)
      return std::unexpected("a subscription needs the numbers id and channelId");
    request.items.push_back({*subscription, *channel});
  }
  return request;
}

Outcome unsubscribe(const Json& message) {
  Unsubscribe request;
  for (const Json& item : listAt(message, "subscriptionIds")) {
    const auto subscription = idIn(&item);
    if (!subscription) return std::unexpected("subscriptionIds must be numbers");
    request.subscriptions.push_back(*subscription);
  }
  return request;
}

Outcome getParameters(const Json& message) {
  GetParameters request;
  for (const Json& name : listAt(message, "parameterNames")) {
    if (!name.is_string()) return std::unexpected("parameterNames must be texts");
    request.names.push_back(name.get<std::string>());
  }
  if (const Json* id = fieldAt(message, "id"); id != nullptr && id->is_string()) {
    request.id = id->get<std::string>();
  }
  return request;
}

}  // namespace

Outcome parseFoxgloveRequest(std::string_view text) {
  const Json message = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (message.is_discarded()) return std::unexpected("the message is not JSON");
  const Json* operation = message.is_object() ? fieldAt(message, "op") : nullptr;
  if (operation == nullptr || !operation->is_string()) {
    return std::unexpected("the message is not an object with the text op");
  }
  const auto op = operation->get<std::string>();
  if (op == "subscribe") return subscribe(message);
  if (op == "unsubscribe") return unsubscribe(message);
  if (op == "getParameters") return getParameters(message);
  if (std::ranges::find(kChanging, op) != kChanging.end()) return Refused{op};
  return Ignored{};
}

}  // namespace hapticd::tools::view
