// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/stiffness_feed.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/base/label_image.h"
#include "rt/shape.h"

namespace hapticd::daemon {
namespace {

/// After this long without a sample of a region the next one begins a feed, which is logged.
constexpr std::chrono::seconds kPause{10};
/// A position is seen by the pixels whose rays come this near.
constexpr double kRayDistance_m = 0.002;

/// The mean with one more value; `past_weight` is the weight of the mean, and grows up to the limit.
double mean(double past, double& past_weight, double value, double weight) {
  const double result = (past * past_weight + value * weight) / (past_weight + weight);
  past_weight = std::min(past_weight + weight, StiffnessFeed::kMostPastWeight);
  return result;
}

std::string membersOf(const StiffnessFeed::Sample& sample) {
  std::string text = fmt::format(R"({{"stiffness_n_per_m": {})", sample.stiffness_n_per_m);
  if (sample.damping_n_s_per_m)
    text += fmt::format(R"(, "damping_n_s_per_m": {})", *sample.damping_n_s_per_m);
  return text + "}";
}

}  // namespace

StiffnessFeed::StiffnessFeed(Box& box) : box_(box), map_(std::make_unique<rt::TissueMap>()) {}

bool StiffnessFeed::isTooFast(Clock::time_point now) {
  if (now - second_ >= std::chrono::seconds(1)) {
    second_ = now;
    samples_ = 0;
  }
  return ++samples_ > kMostPerSecond;
}

/// Reads the regions again where another call has changed them; a region that it has changed begins a new
/// mean.
void StiffnessFeed::followBox() {
  const std::uint64_t generation = box_.additionGenerations().regions;
  if (known_ && generation == generation_) return;
  const config::SceneAdditions& additions = box_.additions();
  std::erase_if(means_, [&](const auto& entry) {
    const auto old_region = std::ranges::find(regions_, entry.first, &config::RegionSettings::name);
    const auto region = std::ranges::find(additions.regions, entry.first, &config::RegionSettings::name);
    return old_region == regions_.end() || region == additions.regions.end() || *old_region != *region;
  });
  regions_ = additions.regions;
  generation_ = generation;
  known_ = true;
  waits_ = false;
  const config::CameraSettings& camera = box_.settings().camera;
  config::toTissueMap(regions_, {}, labelsOf(additions), camera.pose, *map_);
  if (map_->has_labels && !depth_model_)
    depth_model_ = std::make_unique<rt::DepthModel>(camera.effectiveDepthModel(), camera.pose);
}

std::uint8_t StiffnessFeed::labelAt(const rt::Vec3& position_m_in_world) const {
  if (!map_->has_labels || depth_model_->positionInCamera(position_m_in_world).z >= 0) return 0;
  const rt::PixelWindow pixels = depth_model_->pixelsOfBall(position_m_in_world, kRayDistance_m);
  if (pixels.empty()) return 0;
  const auto column = static_cast<std::size_t>((pixels.column_first + pixels.column_last) / 2);
  const auto row = static_cast<std::size_t>((pixels.row_first + pixels.row_last) / 2);
  return map_->labels[row * rt::kFrameWidth + column];
}

std::optional<std::size_t> StiffnessFeed::regionAt(const rt::Vec3& position_m_in_world) const {
  const std::uint8_t label = labelAt(position_m_in_world);
  for (std::size_t i = map_->count; i-- > 0;) {
    const rt::TissueRegion& region = map_->regions[i];
    const bool inside = region.place == rt::TissuePlace::label
                            ? label != 0 && region.label == label
                            : rt::distanceFrom(region.shape, position_m_in_world).distance_m <= 0;
    if (inside) return i;
  }
  return std::nullopt;
}

auto StiffnessFeed::take(const Sample& sample, Clock::time_point now) -> std::expected<Accepted, Refusal> {
  if (isTooFast(now)) {
    ++status_.limited;
    return std::unexpected(TooFast{});
  }
  followBox();
  const auto place = regionAt(sample.position_m_in_world);
  if (!place) {
    ++status_.outside;
    return std::unexpected(Outside{});
  }
  config::RegionSettings& region = regions_[*place];
  const auto checked = config::changed(region, membersOf(sample));
  if (!checked) return std::unexpected(checked.error());
  const auto [found, is_new] = means_.try_emplace(region.name);
  Mean& past = found->second;
  const bool begins = is_new || now - past.newest >= kPause;
  past.newest = now;
  region.stiffness_n_per_m =
      mean(region.stiffness_n_per_m, past.stiffness_weight, sample.stiffness_n_per_m, sample.weight);
  if (sample.damping_n_s_per_m) {
    region.damping_n_s_per_m =
        mean(region.damping_n_s_per_m, past.damping_weight, *sample.damping_n_s_per_m, sample.weight);
  }
  waits_ = true;
  ++status_.accepted;
  return Accepted{region.name, region.stiffness_n_per_m, begins};
}

void StiffnessFeed::periodic(Clock::time_point now) {
  if (!waits_ || now - changed_ < kChangeInterval) return;
  changed_ = now;
  flush();
}

void StiffnessFeed::flush() {
  followBox();
  if (std::exchange(waits_, false)) box_.applyStiffness(regions_);
}

}  // namespace hapticd::daemon
