// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <variant>

namespace hapticd::tools::view {

/// The client wants at most that many depth frames a second; 0: none.
struct DepthRate {
  double max_hz = 30;
};

/// The client has drawn the newest depth frame that it got.
struct Drawn {};

/// What a client of `/live` may ask for.
using ClientMessage = std::variant<DepthRate, Drawn>;

/// Parses a text message from a client; nothing: it is none of these, or a number is out of range.
std::optional<ClientMessage> parseClientMessage(std::string_view text);

}  // namespace hapticd::tools::view
