// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/client_message.h"

#include <cmath>
#include <limits>
#include <string>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {
namespace {

/// A day: no recording is longer, and all times within it stay exact in nanoseconds.
constexpr double kLatestS = 86'400;
constexpr int kMostFrames = 1000;
constexpr double kFastestDepthHz = 1000;

/// The number of that name if it is there and within the range.
std::optional<double> numberIn(const Json& message, const char* name, double lowest, double highest) {
  const auto found = message.find(name);
  if (found == message.end() || !found->is_number()) return std::nullopt;
  const double number = found->get<double>();
  if (!(number >= lowest && number <= highest)) return std::nullopt;
  return number;
}

std::optional<ClientMessage> parseStep(const Json& message) {
  const auto frames = numberIn(message, "frames", -kMostFrames, kMostFrames);
  if (!frames || std::floor(*frames) != *frames) return std::nullopt;
  return PlaybackRequest(Step{static_cast<int>(*frames)});
}

}  // namespace

std::optional<ClientMessage> parseClientMessage(std::string_view text) {
  // depth is bounded by the length of a message, which is bounded by Session::longestMessage()
  const Json message = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!message.is_object()) return std::nullopt;
  const auto type = message.find("type");
  if (type == message.end() || !type->is_string()) return std::nullopt;
  const auto& name = type->get_ref<const std::string&>();
  if (name == "depth") {
    if (const auto hz = numberIn(message, "maxHz", 0, kFastestDepthHz)) return DepthRate{*hz};
  } else if (name == "drawn") {
    return Drawn{};
  } else if (name == "play") {
    return PlaybackRequest(Play{});
  } else if (name == "pause") {
    return PlaybackRequest(Pause{});
  } else if (name == "seek") {
    if (const auto s = numberIn(message, "s", 0, kLatestS)) return PlaybackRequest(Seek{*s});
  } else if (name == "step") {
    return parseStep(message);
  } else if (name == "factor") {
    if (const auto factor = numberIn(message, "factor", Speed::kSlowest, Speed::kFastest))
      return PlaybackRequest(Speed{*factor});
  }
  return std::nullopt;
}

}  // namespace hapticd::tools::view
