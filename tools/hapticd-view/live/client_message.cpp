// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/client_message.h"

#include <string>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {

std::optional<ClientMessage> parseClientMessage(std::string_view text) {
  constexpr double kFastestDepthHz = 1000;
  // depth is bounded by the length of a message, which is bounded by Session::longestMessage()
  const Json message = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!message.is_object()) return std::nullopt;
  const auto type = message.find("type");
  if (type == message.end()) return std::nullopt;
  if (*type == "drawn") return Drawn{};
  const auto max_hz = message.find("maxHz");
  if (*type != "depth" || max_hz == message.end() || !max_hz->is_number()) return std::nullopt;
  const double hz = max_hz->get<double>();
  return hz >= 0 && hz <= kFastestDepthHz ? std::optional<ClientMessage>(DepthRate{hz}) : std::nullopt;
}

}  // namespace hapticd::tools::view
