// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "config/error.h"
#include "drivers/trace/records.h"
#include "rt/fixture.h"
#include "rt/tissue.h"

namespace hapticd::tools {

/// The fixtures and tissue regions that a trace holds, by generation.
class RecordedAdditions {
 public:
  struct Entry {
    drivers::AdditionsRecord record;  ///< without its labels
    std::shared_ptr<const drivers::ByteString> labels;
    drivers::AdditionsRecord whole() const;
  };

  void add(const drivers::AdditionsRecord& record);
  /// Null where the trace does not hold that generation.
  const Entry* ofFixtures(std::uint64_t generation) const;
  const Entry* ofTissue(std::uint64_t generation) const;

 private:
  using Entries = std::map<std::uint64_t, std::shared_ptr<const Entry>>;
  Entries fixtures_;
  Entries tissue_;
  std::shared_ptr<const drivers::ByteString> labels_;  ///< of the newest record: most records share them
};

/// Selects the fixtures and tissue regions of each tick of a trace.  Thread: one.
class AdditionsReplay {
 public:
  /// `T_world_camera`: the camera's pose in that session. `name`: of the trace, for messages.
  AdditionsReplay(RecordedAdditions recorded, const rt::PoseParameters& T_world_camera, std::string name);

  /// Advances to these generations; 0: none. Returns false where the trace does not hold one of them.
  /// Errors: a record that this version cannot read.
  config::Result<bool> goTo(std::uint64_t fixture_generation, std::uint64_t tissue_generation);

  const rt::FixtureSet& fixtures() const { return *fixtures_; }
  const rt::TissueMap& tissue() const { return *tissue_; }

 private:
  RecordedAdditions recorded_;
  rt::PoseParameters T_world_camera_;
  std::string name_;
  std::unique_ptr<rt::FixtureSet> fixtures_;
  std::unique_ptr<rt::TissueMap> tissue_;
};

}  // namespace hapticd::tools
