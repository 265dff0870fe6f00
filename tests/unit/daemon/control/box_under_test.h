// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/running_box.h"

namespace hapticd::daemon::test {

/// The daemon's own box, which a test can slow down: changes and work on the disk seem to take as long as the
/// test wants. Its camera sees a wall, its handle rests half a metre in front of it.
/// Thread: any, unlike a RunningBox.
class BoxUnderTest final : public Box {
 public:
  explicit BoxUnderTest(const std::filesystem::path& state_folder);

  /// Replaces the settings of a box that does not run yet.
  void setSettings(const config::Settings& settings);
  /// Starts the box and waits until it could be engaged.
  void start();
  /// What the control thread of the daemon does with its box in each period, without the ticks.
  void periodic();

  BoxStatus status() override;
  const config::Settings& settings() const override { return box_->settings(); }
  std::uint64_t apply(const config::Settings& settings) override;
  const config::SceneAdditions& additions() const override { return box_->additions(); }
  AdditionGenerations additionGenerations() const override;
  std::uint64_t applyAdditions(const config::SceneAdditions& additions) override;
  void setMeasuredStiffness(const std::vector<MeasuredStiffness>& measured) override;
  std::optional<std::size_t> regionAt(const rt::Vec3& position_m_in_world) const override;
  bool feedPose(const rt::FramePose& pose) override;
  bool feedForce(const rt::ExternalForce& force) override;
  void moveHand(const rt::Vec3& target_m_in_world) override;
  std::uint64_t engage(bool engaged, bool inside) override;
  bool engaged() override;
  bool knowsSolid(const std::string& sha256) const override { return box_->knowsSolid(sha256); }
  std::future<base::Result<StoredSolid>> storeSolid(base::Descriptor memory) override {
    return box_->storeSolid(std::move(memory));
  }
  base::Result<void> takeSolid(StoredSolid stored) override { return box_->takeSolid(std::move(stored)); }
  std::shared_ptr<const config::Solid> solid(const std::string& sha256) const override {
    return box_->solid(sha256);
  }
  bool readsSolids() const override { return box_->readsSolids(); }
  std::string solidProblem(const std::vector<config::FixtureSettings>& fixtures) const override {
    return box_->solidProblem(fixtures);
  }
  std::uint64_t acknowledgedGeneration() override;
  std::future<base::Result<std::string>> startTrace(const TraceRequest& request) override;
  std::future<base::Result<std::string>> stopTrace() override;
  std::future<base::Result<std::string>> dumpTrace() override;
  std::future<base::Result<std::vector<trace::TraceEntry>>> listTraces() override;
  std::future<base::Result<void>> deleteTrace(const std::string& name) override;
  std::future<base::Result<void>> keepTrace(const std::string& name, bool keep) override;
  std::future<base::Result<void>> noteTrace(const std::string& name, const std::string& text) override;
  std::future<base::Result<SceneSnapshot>> takeSnapshot() override;
  base::Result<SharedDepth> shareDepth() override;
  void hideDepth() override;

  /// From now on no change is acknowledged until acknowledge().
  void holdAcknowledgements();
  void acknowledge();
  /// How many changes were requested since the start.
  std::uint64_t changes() const;
  /// Waits until so many were; false after a time that only a failing test reaches.
  bool waitForChanges(std::uint64_t changes);
  int statusCalls() const;
  bool waitForStatusCalls(int calls);

  /// From now on what waits for the disk or the camera begins only at finishJobs().
  void holdJobs();
  void finishJobs();
  /// How many such jobs were requested since the start.
  int jobs() const;
  bool waitForJobs(int jobs);

  /// From now on `amend` changes each status: for faults that no box has on request.
  void amendStatus(std::function<void(BoxStatus&)> amend);
  /// Warnings from outside the box.
  void setNotices(const std::vector<std::string>& notices);
  /// From now on there is no memory for depth frames.
  void failToShareDepth();
  bool sharesDepth() const;
  int timesDepthWasShared() const;
  bool waitUntilDepthIsHidden();
  config::Settings appliedSettings() const;

 private:
  void notify() const { changed_.notify_all(); }
  template <typename Condition>
  bool waitUntil(Condition condition) const;
  std::uint64_t counted(std::uint64_t generation);
  /// Returns the future of a job that is begun now, or by finishJobs().
  template <typename T>
  std::future<T> begin(std::function<std::future<T>()> job);

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::unique_ptr<RunningBox> box_;
  std::function<void(BoxStatus&)> amend_;
  int status_calls_ = 0;
  std::uint64_t changes_ = 0;
  std::optional<std::uint64_t> held_;  // what was acknowledged when the test began to hold back
  bool jobs_held_ = false;
  int jobs_requested_ = 0;
  std::vector<std::function<void()>> jobs_;
  bool no_memory_ = false;
  bool shares_depth_ = false;
  int times_shared_ = 0;
};

}  // namespace hapticd::daemon::test
