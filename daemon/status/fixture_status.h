// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "rt/base/fields.h"
#include "rt/base/vec3.h"
#include "rt/fixtures/fixture_state.h"
#include "rt/fixtures/moving_frame.h"
#include "rt/tracking/solid_tracker.h"

namespace hapticd::daemon {

/// Nothing for an empty text.
inline std::optional<std::string> ifNotEmpty(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

/// What one virtual fixture does.
struct FixtureConduct {
  std::string name{};
  double configured_n_per_m = 0;
  double stiffness_n_per_m = 0;
  double force_n = 0;
  double distance_m = std::numeric_limits<double>::quiet_NaN();
  std::optional<rt::FixtureStage> stage{};
  std::uint64_t warnings = 0;
  rt::Breach breach{};
  rt::BreachTotals breaches{};
  double lag_m = 0;
};
template <std::same_as<FixtureConduct> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(name, "Its name"),
      HAPTICD_FIELD(distance_m,
                    "From the interaction point to its boundary, negative inside a forbidden region, or to "
                    "path or point; null: not known, as of a fixture that is disabled, or that has ended "
                    "because the camera is lost, or of a stand-off where no surface is seen"),
      HAPTICD_FIELD(
          force_n,
          "Magnitude of the force that it exerts, before handle.force_scale; 0 while the box is not engaged"),
      HAPTICD_FIELD(stiffness_n_per_m,
                    "Stiffness in effect: at most the configured one, less where guidance or stability limit "
                    "it (docs/fixtures.md); 0: it does not act, or only slows the interaction point"),
      HAPTICD_FIELD(configured_n_per_m, "As it is configured").named("configuredStiffnessNPerM"),
      HAPTICD_FIELD(
          stage,
          "How near the interaction point is to the forbidden region: nearer than its warning_m, in "
          "its soft layer, behind its boundary, or deeper than its breach_m; null: not known, or it "
          "is guidance")
          .states("fixture_stage"),
      HAPTICD_FIELD(
          warnings,
          "Times that the interaction point came nearer than the warning_m of the forbidden region, "
          "since the fixture was added or enabled")
          .counter("fixture_warnings"),
      HAPTICD_FIELD(breach.number,
                    "Times that the interaction point has been inside the forbidden region and left it, "
                    "since the fixture was added or enabled; each is an event of the kind breach")
          .named("breaches")
          .counter("fixture_breaches"),
      HAPTICD_FIELD(breaches.duration_s, "Time that it was inside in all of these, together")
          .named("breachedS")
          .counter("fixture_breach_seconds"),
      HAPTICD_FIELD(breaches.depth_m, "Largest depth that it reached in any of them; 0: there was none")
          .named("deepestBreachM")
          .gauge("fixture_deepest_breach_metres"),
      HAPTICD_FIELD(lag_m,
                    "How far its region, next to the interaction point, is behind its moving frame: it gives "
                    "way to a hand that it is pressed against (docs/fixtures.md)")};
}

/// The virtual fixtures, as people see them.
struct FixtureStatus {
  std::uint64_t generation = 0;
  std::uint64_t count = 0;
  std::uint64_t enabled = 0;
  std::vector<std::string> in_contact;
  std::string nearest;
  double distance_m = std::numeric_limits<double>::infinity();
  bool warning = false;
  double force_n = 0;
  double guidance_force_n = 0;
  std::vector<FixtureConduct> each;
};
template <std::same_as<FixtureStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(generation, "Generation of the set"),
      HAPTICD_FIELD(count, "Virtual fixtures").gauge("fixtures"),
      HAPTICD_FIELD(enabled, "Virtual fixtures that are enabled").gauge("fixtures_enabled"),
      HAPTICD_FIELD(in_contact,
                    "Names of those that exert a force: they hold the interaction point back or guide it; "
                    "none while the box is not engaged"),
      HAPTICD_FIELD(nearest, "Name of the nearest enabled forbidden region; null: there is none")
          .shownAs([](const auto& fixtures) { return ifNotEmpty(fixtures.nearest); }),
      HAPTICD_FIELD(distance_m,
                    "From the interaction point to the boundary of the nearest forbidden region, negative "
                    "inside it; null: there is none")
          .gauge("fixture_distance_metres"),
      HAPTICD_FIELD(
          warning,
          "Whether that distance is below proximity.warning_m, or the stage of a fixture is warning or soft"),
      HAPTICD_FIELD(force_n,
                    "Magnitude of the force that all forbidden regions exert, before handle.force_scale; 0 "
                    "while the box is not engaged")
          .gauge("fixture_force_newtons"),
      HAPTICD_FIELD(guidance_force_n,
                    "Magnitude of the force that all guidance fixtures exert, before handle.force_scale; 0 "
                    "while the box is not engaged")
          .gauge("guidance_force_newtons"),
      HAPTICD_FIELD(
          each,
          "Each of them, in their order; empty for the moment until the force loop has taken over a change")};
}

/// Says in words why a pose is not used, and where the cause may be.
constexpr std::string_view reasonOf(rt::PoseFault fault) {
  switch (fault) {
    case rt::PoseFault::none:
      break;
    case rt::PoseFault::not_finite:
      return "the position must be within 10 m of the world's origin (send metres)";
    case rt::PoseFault::not_unit:
      return "the length of the quaternion must be 1 within 1 % (send x, y, z, w of a rotation)";
    case rt::PoseFault::older:
      return "its time must be later than that of the pose before (send each one once, when it was measured)";
    case rt::PoseFault::future:
      return "its time must be within 20 ms from now (synchronise the clocks, or send its age)";
    case rt::PoseFault::jump:
      return "it is farther away than the frame can have moved (does the tracker take two bodies for one, or "
             "is max_speed_m_per_s too small?)";
    case rt::PoseFault::repeated:
      return "it is the pose before to the last bit, and those of this source have noise (is the marker in "
             "view?)";
    case rt::PoseFault::identity:
      return "it is exactly the world's axes, as trackers report what they do not see (is the marker in "
             "view?)";
  }
  return "";
}

/// What one moving frame does.
struct FrameStatus {
  std::string name{};
  rt::FrameState state = rt::FrameState::none;
  bool used = false;
  std::optional<rt::PoseFault> refusal{};
  double age_s = 0;
  double lag_m = 0;
  double lag_rad = 0;
  rt::Vec3 position_m_in_world{};
  std::uint64_t accepted = 0;
  std::uint64_t not_finite = 0;
  std::uint64_t not_unit = 0;
  std::uint64_t older = 0;
  std::uint64_t future = 0;
  std::uint64_t jumps = 0;
  std::uint64_t repeated = 0;
  std::uint64_t identity = 0;
  std::uint64_t limited = 0;
  std::uint64_t losses = 0;
  std::uint64_t returns = 0;
  std::uint64_t relocations = 0;
  rt::Quaternion orientation{};
  std::string tracks{};  ///< fixture by which the depth camera finds it; empty: its poses are fed
  std::optional<rt::TrackingVerdict> tracking{};
  double tracking_error_m = 0;
  double tracking_share = 0;
};
template <std::same_as<FrameStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(name, "Its name"),
      HAPTICD_FIELD(
          state,
          "none: no usable pose yet; live: it follows its poses; held: they are late, and it stays; "
          "lost: they are missing; catching_up: it is on its way to where they say that it is"),
      HAPTICD_FIELD(used, "Whether an enabled fixture is defined in it"),
      HAPTICD_FIELD(
          refusal,
          "Why its newest pose was not used, as the counters below name it; null: it was, or none comes"),
      HAPTICD_FIELD(age_s, "Age of its newest usable pose; null: there is none")
          .shownAs([](const auto& frame) {
            return frame.state == rt::FrameState::none ? std::nullopt : std::optional(frame.age_s);
          }),
      HAPTICD_FIELD(lag_m, "From where it is to where its poses say that it is"),
      HAPTICD_FIELD(lag_rad, "The same of its orientation"),
      HAPTICD_FIELD(position_m_in_world, "Where its origin is, metres, world frame; null: not known")
          .shownAs([](const auto& frame) {
            return frame.state == rt::FrameState::none ? std::nullopt
                                                       : std::optional(frame.position_m_in_world);
          }),
      HAPTICD_FIELD(orientation,
                    "How it is turned, as a unit quaternion x, y, z, w that maps vectors in the frame to the "
                    "world; null: not known")
          .named("orientationXyzw")
          .shownAs([](const auto& frame) {
            const rt::Quaternion& q = frame.orientation;
            return frame.state == rt::FrameState::none ? std::nullopt
                                                       : std::optional(std::vector{q.x, q.y, q.z, q.w});
          }),
      HAPTICD_FIELD(accepted, "Poses used"),
      HAPTICD_FIELD(not_finite, "Poses dropped because a number was not finite or outside +-10 m"),
      HAPTICD_FIELD(not_unit,
                    "Poses dropped because their quaternion was longer or shorter than 1 by over 1 %"),
      HAPTICD_FIELD(older, "Poses dropped because they were not newer than the newest"),
      HAPTICD_FIELD(future, "Poses dropped because their time was more than 20 ms from now"),
      HAPTICD_FIELD(jumps, "Poses dropped because the frame cannot have moved so far"),
      HAPTICD_FIELD(
          repeated,
          "Poses dropped because they repeated the newest to the last bit, from a source that had noise"),
      HAPTICD_FIELD(identity,
                    "Poses dropped because they were exactly the world's axes, and none before was"),
      HAPTICD_FIELD(limited, "Poses refused because they came faster than 500 per second"),
      HAPTICD_FIELD(losses, "Times that it was lost"),
      HAPTICD_FIELD(returns, "Times that it was found, the first one included"),
      HAPTICD_FIELD(relocations, "Jumps that were believed, because three poses agreed on them"),
      HAPTICD_FIELD(tracks, "Fixture by which the depth camera finds it").hidden(),
      HAPTICD_FIELD(tracking,
                    "What the depth camera finds of the solid that it tracks: tracked, or why not; null: it "
                    "tracks none"),
      HAPTICD_FIELD(
          tracking_error_m,
          "Expected error of the tracked solid next to the interaction point, three standard deviations"),
      HAPTICD_FIELD(tracking_share, "Share of the pixels that should show the solid that does, 0..1")};
}

/// Counters of the measured stiffness that estimators feed.
struct FeedStatus {
  std::uint64_t accepted = 0;
  std::uint64_t limited = 0;
  std::uint64_t outside = 0;
};
template <std::same_as<FeedStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(accepted, "Samples of measured stiffness applied to a region")
          .counter("tissue_feed_accepted_samples"),
      HAPTICD_FIELD(limited,
                    "Samples of measured stiffness refused because they came faster than 200 per second")
          .counter("tissue_feed_limited_samples"),
      HAPTICD_FIELD(outside,
                    "Samples of measured stiffness refused because no region contains their position")
          .counter("tissue_feed_outside_samples")};
}

/// The tissue regions, as people see them.
struct TissueStatus {
  std::uint64_t generation = 0;
  std::uint64_t count = 0;
  std::string in_contact;
  FeedStatus feed;
};
template <std::same_as<TissueStatus> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(generation, "Generation of the map"),
      HAPTICD_FIELD(count, "Regions of the stiffness map").gauge("tissue_regions"),
      HAPTICD_FIELD(in_contact,
                    "Name of the region with the largest share of the contact; null: none is in contact")
          .shownAs([](const auto& tissue) { return ifNotEmpty(tissue.in_contact); }),
      HAPTICD_FIELD(feed, "Measured stiffness")};
}

}  // namespace hapticd::daemon
