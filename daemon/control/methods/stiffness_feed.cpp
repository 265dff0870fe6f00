// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/methods/stiffness_feed.h"

#include <algorithm>
#include <utility>

#include "config/additions/addition_json.h"
#include "config/additions/addition_reader.h"
#include "daemon/control/server/varlink_message.h"

namespace hapticd::daemon {
namespace {

/// After this long without a sample of a region the next one begins a feed, which is logged.
constexpr std::chrono::seconds kPause{10};
/// The mean with one more value; `past_weight` is the weight of the mean, and grows up to the limit.
double mean(double past, double& past_weight, double value, double weight) {
  const double result = (past * past_weight + value * weight) / (past_weight + weight);
  past_weight = std::min(past_weight + weight, StiffnessFeed::kMaxPastWeight);
  return result;
}

Json membersOf(const StiffnessFeed::Sample& sample) {
  Json members = {{"stiffness_n_per_m", sample.stiffness_n_per_m}};
  if (sample.damping_n_s_per_m) members["damping_n_s_per_m"] = *sample.damping_n_s_per_m;
  return members;
}

}  // namespace

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
}

auto StiffnessFeed::take(const Sample& sample, Clock::time_point now) -> std::expected<Accepted, Refusal> {
  if (!rate_.allows(now)) {
    ++status_.limited;
    return std::unexpected(TooFast{});
  }
  followBox();
  const auto place = box_.regionAt(sample.position_m_in_world);
  if (!place || *place >= regions_.size()) {
    ++status_.outside;
    return std::unexpected(Outside{});
  }
  config::RegionSettings& region = regions_[*place];
  const auto checked = config::changed(region, config::nodeOf(membersOf(sample)));
  if (!checked) return std::unexpected(checked.error().front());
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
  if (!std::exchange(waits_, false)) return;
  const std::vector<config::RegionSettings>& in_use = box_.additions().regions;
  std::vector<MeasuredStiffness> measured;
  for (std::size_t i = 0; i < regions_.size(); ++i) {
    const config::RegionSettings& region = regions_[i];
    if (region != in_use[i]) measured.push_back({i, region.stiffness_n_per_m, region.damping_n_s_per_m});
  }
  if (!measured.empty()) box_.setMeasuredStiffness(measured);
}

}  // namespace hapticd::daemon
