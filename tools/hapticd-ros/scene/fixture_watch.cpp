// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/scene/fixture_watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <utility>

#include "tools/hapticd-ros/box/box_frames.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::ros {
namespace {

/// The numbers of an array of `Count`; nothing where it is not that.
template <std::size_t Count>
std::optional<std::array<double, Count>> numbersOf(const Json& entry, const char* name) {
  const Json& list = listAt(entry, name);
  std::array<double, Count> numbers{};
  if (list.size() != Count) return std::nullopt;
  for (std::size_t i = 0; i < Count; ++i) {
    if (!list[i].is_number()) return std::nullopt;
    numbers[i] = list[i].template get<double>();
    if (!std::isfinite(numbers[i])) return std::nullopt;
  }
  return numbers;
}

std::optional<rt::RigidPose> poseOf(const Json& frame) {
  const auto position = numbersOf<3>(frame, "positionM");
  const auto turn = numbersOf<4>(frame, "orientationXyzw");
  if (!position || !turn) return std::nullopt;
  const rt::Quaternion q{(*turn)[0], (*turn)[1], (*turn)[2], (*turn)[3]};
  if (!(rt::dot(q, q) > 0)) return std::nullopt;
  return rt::RigidPose{{(*position)[0], (*position)[1], (*position)[2]}, rt::normalised(q)};
}

std::vector<std::vector<double>> linesOf(const Json& solid) {
  std::vector<std::vector<double>> lines;
  for (const Json& line : listAt(solid, "outline")) {
    std::vector<double>& numbers = lines.emplace_back();
    for (const Json& number : line) numbers.push_back(number.is_number() ? number.get<double>() : 0);
  }
  return lines;
}

}  // namespace

ClientResult<Json> FixtureWatch::call(const std::string& method, const Json& parameters) {
  if (!link_) {
    auto connected = VarlinkClient::connect(socket_);
    if (!connected) return std::unexpected(connected.error());
    link_.emplace(std::move(*connected));
    link_->interruptBy(interrupt_);
  }
  auto reply = link_->call("io.hapticd.Status." + method, parameters, kSilence);
  // a late reply would be taken for that of the next call
  if (!reply && reply.error().kind != ClientError::Kind::error_reply) link_.reset();
  return reply;
}

bool FixtureWatch::forget() {
  fixtures_ = Json::array();
  surroundings_ = {};
  return false;
}

bool FixtureWatch::refresh() {
  return (askForFixtures() && askForCamera() && askForSolids() && refreshFrames()) || forget();
}

bool FixtureWatch::askForFixtures() {
  const auto reply = call("ListFixtures");
  if (!reply) return false;
  fixtures_ = listAt(*reply, "fixtures");
  return true;
}

bool FixtureWatch::askForCamera() {
  const auto reply = call("GetCalibration");
  if (!reply) return false;
  surroundings_.T_world_camera.reset();
  for (const FixedFrame& frame : fixedFrames(*reply, Json::object(), "")) {
    if (frame.name == "camera") surroundings_.T_world_camera = frame.T_parent_frame;
  }
  return true;
}

/// Each solid once; those that no fixture has any longer are forgotten.
bool FixtureWatch::askForSolids() {
  std::set<std::string> needed;
  for (const Json& fixture : fixtures_) {
    const Json* const solid = fieldAt(fixture, "definition.solid");
    if (solid != nullptr && solid->is_string()) needed.insert(solid->get<std::string>());
  }
  std::erase_if(surroundings_.outlines, [&](const auto& known) { return !needed.contains(known.first); });
  for (const std::string& solid : needed) {
    if (surroundings_.outlines.contains(solid)) continue;
    const auto reply = call("GetSolid", {{"solid", solid}});
    if (reply) {
      surroundings_.outlines[solid] = linesOf(*reply);
    } else if (reply.error().kind != ClientError::Kind::error_reply) {
      return false;
    }
  }
  return true;
}

bool FixtureWatch::refreshFrames() {
  surroundings_.frames.clear();
  if (!anyMoves()) return true;
  const auto reply = call("ListFrames");
  if (!reply) return forget();
  for (const Json& frame : listAt(*reply, "frames")) {
    const auto pose = poseOf(frame);
    if (pose && textAt(frame, "state") != "none") surroundings_.frames[textAt(frame, "name")] = *pose;
  }
  return true;
}

bool FixtureWatch::anyMoves() const {
  return std::ranges::any_of(fixtures_, [](const Json& fixture) {
    const Json* const definition = fieldAt(fixture, "definition");
    return definition != nullptr && isInMovingFrame(*definition);
  });
}

}  // namespace hapticd::tools::ros
