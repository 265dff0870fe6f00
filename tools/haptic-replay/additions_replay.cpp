// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/additions_replay.h"

#include <utility>

#include "drivers/trace/additions.h"

namespace hapticd::tools {

drivers::AdditionsRecord RecordedAdditions::Entry::whole() const {
  drivers::AdditionsRecord copy = record;
  copy.labels = *labels;
  return copy;
}

void RecordedAdditions::add(const drivers::AdditionsRecord& record) {
  if (!labels_ || labels_->bytes != record.labels.bytes) {
    labels_ = std::make_shared<const drivers::ByteString>(record.labels);
  }
  Entry entry{record, labels_};
  entry.record.labels = {};
  const auto shared = std::make_shared<const Entry>(std::move(entry));
  fixtures_[record.fixture_generation] = shared;
  tissue_[record.tissue_generation] = shared;
}

const RecordedAdditions::Entry* RecordedAdditions::ofFixtures(std::uint64_t generation) const {
  const auto found = fixtures_.find(generation);
  return found == fixtures_.end() ? nullptr : found->second.get();
}

const RecordedAdditions::Entry* RecordedAdditions::ofTissue(std::uint64_t generation) const {
  const auto found = tissue_.find(generation);
  return found == tissue_.end() ? nullptr : found->second.get();
}

AdditionsReplay::AdditionsReplay(RecordedAdditions recorded, const rt::PoseParameters& T_world_camera,
                                 std::string name)
    : recorded_(std::move(recorded)),
      T_world_camera_(T_world_camera),
      name_(std::move(name)),
      fixtures_(std::make_unique<rt::FixtureSet>()),
      tissue_(std::make_unique<rt::TissueMap>()) {}

config::Result<bool> AdditionsReplay::goTo(std::uint64_t fixture_generation,
                                           std::uint64_t tissue_generation) {
  if (fixture_generation != fixtures_->generation) {
    const auto* const entry = recorded_.ofFixtures(fixture_generation);
    if (entry == nullptr) return false;
    const auto restored = drivers::restore(entry->record, T_world_camera_, name_, *fixtures_);
    if (!restored) return std::unexpected(restored.error());
  }
  if (tissue_generation != tissue_->generation) {
    const auto* const entry = recorded_.ofTissue(tissue_generation);
    if (entry == nullptr) return false;
    const auto restored = drivers::restore(entry->whole(), T_world_camera_, name_, *tissue_);
    if (!restored) return std::unexpected(restored.error());
  }
  return true;
}

}  // namespace hapticd::tools
