// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/control/varlink_message.h"

namespace hapticd::daemon {

/// org.varlink.service.InvalidParameter.
Reply invalidParameter(std::string_view field);
/// An error with a text for people in its field `reason`.
Reply failed(std::string_view error, std::string reason);

/// The field of the call's parameters; null when it is absent or null, which Varlink takes for the same.
const Json* field(const Call& call, const char* name);

/// A field that may be absent. Errors: InvalidParameter where it is of another type.
template <typename T>
using Field = std::expected<std::optional<T>, Reply>;
Field<std::string> textField(const Call& call, const char* name);
Field<bool> flagField(const Call& call, const char* name);
/// Errors: also more than `most` texts.
Field<std::vector<std::string>> textsField(const Call& call, const char* name, std::size_t most);
/// A field that has to be there. Errors: InvalidParameter also where it is not.
std::expected<std::string, Reply> requiredText(const Call& call, const char* name);

}  // namespace hapticd::daemon
