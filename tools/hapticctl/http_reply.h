// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace hapticd::tools {

/// Most bytes of a request's head that are read.
inline constexpr std::size_t kMaxRequestBytes = 8192;

/// Whether `received` holds a whole head of a request.
bool isWholeRequest(std::string_view received);

/// The reply to one HTTP/1 request of which `received` is the head: GET or HEAD of /metrics get what
/// `metrics` makes, all else gets the fitting error. The connection is closed behind it.
std::string httpReply(std::string_view received, const std::function<std::string()>& metrics);

}  // namespace hapticd::tools
