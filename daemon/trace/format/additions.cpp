// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/format/additions.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

namespace hapticd::trace {
namespace {

constexpr const char* kOtherNames = "their names and numbers do not agree";
constexpr const char* kOtherLabels = "the labels do not fit the size of their image";
/// Where attachments that are solids seem to be.
const std::string kAttachedSolids = "solids/";

constexpr const char* kNoNumber = "a number of theirs is missing";

base::Error unreadable(const std::string& name, const std::string& what) {
  return {name, "has fixtures or tissue regions that this version cannot read: " + what,
          "take haptic-replay of the version that wrote it; hapticctl trace info shows which"};
}

/// Reads an unsigned number from the front of `text` and removes it with the blank after it.
template <typename Number>
bool takeNumber(std::string_view& text, Number& number) {
  const char* const end = text.data() + text.size();
  const auto [after, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(after - text.data()));
  if (text.starts_with(' ')) text.remove_prefix(1);
  return true;
}

/// Whether the record names as many of them, in the same order, as its text defines.
bool sameNames(const auto& settings, const auto& recorded) {
  if (settings.size() != recorded.size()) return false;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    if (settings[i].name != recorded[i].first) return false;
  }
  return true;
}

/// The label image of a record; nothing if its size and its labels do not agree.
std::optional<config::LabelImage> labelsOf(const AdditionsRecord& record) {
  const std::string& labels = record.labels.bytes;
  if (labels.empty()) return config::LabelImage{};
  const std::uint32_t width_px = record.label_width_px, height_px = record.label_height_px;
  if (width_px > static_cast<std::uint32_t>(rt::kMaxFrameWidth) ||
      height_px > static_cast<std::uint32_t>(rt::kMaxFrameHeight) ||
      labels.size() != std::size_t{width_px} * height_px) {
    return std::nullopt;
  }
  return config::LabelImage{static_cast<int>(width_px), static_cast<int>(height_px), labels};
}

}  // namespace

AdditionsRecord recordOf(const config::SceneAdditions& additions, const rt::FixtureSet& fixtures,
                         const rt::TissueMap& tissue, const config::SolidTable& solids, double tool_radius_m,
                         std::int64_t time_ns) {
  AdditionsRecord record;
  record.time_ns = time_ns;
  record.fixture_generation = fixtures.generation;
  record.tissue_generation = tissue.generation;
  record.tool_radius_m = tool_radius_m;
  record.text = config::textOf(additions);
  if (tissue.has_labels) {
    const auto labels = tissue.usedLabels();
    record.labels.bytes.assign(labels.begin(), labels.end());
    record.label_width_px = static_cast<std::uint32_t>(tissue.label_width_px);
    record.label_height_px = static_cast<std::uint32_t>(tissue.label_height_px);
  }
  for (std::size_t i = 0; i < additions.fixtures.size() && i < fixtures.count; ++i) {
    const rt::Fixture& fixture = fixtures.fixtures[i];
    record.fixtures.emplace_back(additions.fixtures[i].name,
                                 fmt::format("{} {}", fixture.identity, fixture.definition));
  }
  for (std::size_t i = 0; i < additions.regions.size() && i < tissue.count; ++i) {
    record.regions.emplace_back(additions.regions[i].name, fmt::format("{}", tissue.regions[i].identity));
  }
  for (const config::FixtureSettings& fixture : additions.fixtures) {
    const auto solid = solids.find(fixture.solid);
    if (fixture.kind == rt::FixtureKind::solid && solid != solids.end())
      record.solids.push_back(solid->second);
  }
  return record;
}

PoseRecord recordOf(const rt::FramePose& pose, std::int64_t time_ns) {
  const rt::Quaternion& q = pose.T_world_frame.orientation;
  return {.time_ns = time_ns,
          .number = pose.number,
          .frame = pose.frame,
          .pose_time_ns = pose.time_ns,
          .position_m_in_world = pose.T_world_frame.position_m_in_world,
          .orientation_x = q.x,
          .orientation_y = q.y,
          .orientation_z = q.z,
          .orientation_w = q.w,
          .has_velocity = pose.has_velocity,
          .velocity_m_per_s_in_world = pose.velocity_m_per_s_in_world};
}

rt::FramePose poseOf(const PoseRecord& record) {
  return {.frame = record.frame,
          .number = record.number,
          .T_world_frame = {record.position_m_in_world,
                            {record.orientation_x, record.orientation_y, record.orientation_z,
                             record.orientation_w}},
          .time_ns = record.pose_time_ns,
          .has_velocity = record.has_velocity,
          .velocity_m_per_s_in_world = record.velocity_m_per_s_in_world};
}

std::string attachmentNameOf(const config::Solid& solid) {
  return kAttachedSolids + config::solidFileName(solid.sha256());
}

base::Result<config::SolidTable> solidsIn(const std::vector<TraceAttachment>& attachments,
                                          const std::string& name) {
  config::SolidTable table;
  for (const TraceAttachment& attachment : attachments) {
    if (!attachment.name.starts_with(kAttachedSolids)) continue;
    auto solid = config::solidFrom(attachment.data, fmt::format("{}: {}", name, attachment.name));
    if (!solid) return std::unexpected(solid.error());
    table[(*solid)->sha256()] = std::move(*solid);
  }
  return table;
}

base::Result<void> restore(const AdditionsRecord& record, const rt::PoseParameters& T_world_camera,
                           const std::string& name, const config::SolidTable& solids,
                           rt::FixtureSet& fixtures) {
  const auto additions = config::additionsFromText(record.text, name);
  if (!additions) return std::unexpected(unreadable(name, additions.error().front().error.text()));
  if (!sameNames(additions->fixtures, record.fixtures)) return std::unexpected(unreadable(name, kOtherNames));
  fixtures.count = 0;
  config::toFixtureSet(additions->fixtures, {},
                       {T_world_camera, additions->frames, solids, record.tool_radius_m}, fixtures);
  fixtures.generation = record.fixture_generation;
  for (std::size_t i = 0; i < record.fixtures.size(); ++i) {
    std::string_view numbers = record.fixtures[i].second;
    rt::Fixture& fixture = fixtures.fixtures[i];
    if (!takeNumber(numbers, fixture.identity) || !takeNumber(numbers, fixture.definition)) {
      return std::unexpected(unreadable(name, kNoNumber));
    }
  }
  return {};
}

base::Result<void> restore(const AdditionsRecord& record, const rt::PoseParameters& T_world_camera,
                           const std::string& name, rt::TissueMap& tissue) {
  const auto additions = config::additionsFromText(record.text, name);
  if (!additions) return std::unexpected(unreadable(name, additions.error().front().error.text()));
  if (!sameNames(additions->regions, record.regions)) return std::unexpected(unreadable(name, kOtherNames));
  const auto labels = labelsOf(record);
  if (!labels) return std::unexpected(unreadable(name, kOtherLabels));
  tissue.count = 0;
  config::toTissueMap(additions->regions, {}, *labels, T_world_camera, tissue);
  tissue.generation = record.tissue_generation;
  for (std::size_t i = 0; i < record.regions.size(); ++i) {
    std::string_view numbers = record.regions[i].second;
    if (!takeNumber(numbers, tissue.regions[i].identity)) {
      return std::unexpected(unreadable(name, kNoNumber));
    }
  }
  return {};
}

}  // namespace hapticd::trace
