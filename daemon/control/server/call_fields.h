// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <expected>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/control/server/listening_socket.h"
#include "daemon/control/server/varlink_message.h"
#include "daemon/control/server/varlink_server.h"

namespace hapticd::daemon {

/// A method of an interface, and the function that answers it.
struct Method {
  std::string_view name;  ///< with the interface, "io.hapticd.Status.GetStatus"
  Access access = Access::read;
  bool streams = false;                           ///< whether it must be called with the flag "more"
  bool shows_depth = false;                       ///< whether it needs Caller::sees_depth
  std::vector<std::string_view> parameters = {};  ///< names of the parameters that it knows
  std::function<void(const Call&, const Caller&, Replies&)> answer;
};

/// The error org.varlink.service.InvalidParameter for that field.
Reply invalidParameter(std::string_view field);
/// An error whose field `reason` holds a text for people.
Reply failed(std::string_view error, std::string reason);

/// A field of the call's parameters; a null pointer if it is absent or null, which Varlink treats alike.
const Json* field(const Call& call, const char* name);

/// A field that may be absent. Errors: InvalidParameter if it has another type.
template <typename T>
using Field = std::expected<std::optional<T>, Reply>;
Field<std::string> textField(const Call& call, const char* name);
Field<bool> flagField(const Call& call, const char* name);
/// A list of texts. Errors: InvalidParameter, also for more than `most` texts.
Field<std::vector<std::string>> textsField(const Call& call, const char* name, std::size_t most);
/// A required field. Errors: InvalidParameter, also if it is absent.
std::expected<std::string, Reply> requiredText(const Call& call, const char* name);

}  // namespace hapticd::daemon
