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

struct Play {};
struct Pause {};
/// To that time of the recording, seconds from its begin; finite, not negative.
struct Seek {
  double s = 0;
};
/// By that many depth frames, or 1/30 s each where none are recorded; negative: back.
struct Step {
  int frames = 1;
};
/// Playback at that multiple of the recorded speed, kSlowest..kFastest.
struct Speed {
  static constexpr double kSlowest = 0.01;
  static constexpr double kFastest = 100;
  double factor = 1;
};
using PlaybackRequest = std::variant<Play, Pause, Seek, Step, Speed>;

/// What a client of `/live` may ask for.
using ClientMessage = std::variant<DepthRate, Drawn, PlaybackRequest>;

/// Parses a text message from a client; nothing: it is none of these, or a number is out of range.
std::optional<ClientMessage> parseClientMessage(std::string_view text);

}  // namespace hapticd::tools::view
