// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/server/call_fields.h"

#include <algorithm>

namespace hapticd::daemon {

Reply invalidParameter(std::string_view field) {
  return {"org.varlink.service.InvalidParameter", {{"parameter", field}}};
}

Reply failed(std::string_view error, std::string reason) {
  return {std::string(error), {{"reason", std::move(reason)}}};
}

const Json* field(const Call& call, const char* name) {
  const auto found = call.parameters.find(name);
  return found == call.parameters.end() || found->is_null() ? nullptr : &*found;
}

Field<std::string> textField(const Call& call, const char* name) {
  const Json* const json = field(call, name);
  if (!json) return std::nullopt;
  if (!json->is_string()) return std::unexpected(invalidParameter(name));
  return json->get<std::string>();
}

Field<bool> flagField(const Call& call, const char* name) {
  const Json* const json = field(call, name);
  if (!json) return std::nullopt;
  if (!json->is_boolean()) return std::unexpected(invalidParameter(name));
  return json->get<bool>();
}

Field<std::vector<std::string>> textsField(const Call& call, const char* name, std::size_t most) {
  const Json* const json = field(call, name);
  if (!json) return std::nullopt;
  const bool texts = json->is_array() && json->size() <= most &&
                     std::ranges::all_of(*json, [](const Json& item) { return item.is_string(); });
  if (!texts) return std::unexpected(invalidParameter(name));
  return json->get<std::vector<std::string>>();
}

std::expected<std::string, Reply> requiredText(const Call& call, const char* name) {
  auto text = textField(call, name);
  if (!text) return std::unexpected(text.error());
  if (!*text) return std::unexpected(invalidParameter(name));
  return std::move(**text);
}

}  // namespace hapticd::daemon
