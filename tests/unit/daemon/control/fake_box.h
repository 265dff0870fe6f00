// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <vector>

#include "daemon/base/box.h"
#include "drivers/depth_region/depth_region.h"

namespace hapticd::daemon::test {

/// A box without a loop: takes over changes at once or when the test says so. Its traces are names only.
/// Thread: any.
class FakeBox final : public Box {
 public:
  FakeBox();

  BoxStatus status() override;
  const config::Settings& settings() const override { return settings_; }
  std::uint64_t apply(const config::Settings& settings) override;
  const config::SceneAdditions& additions() const override { return settings_.additions; }
  AdditionGenerations additionGenerations() const override;
  std::uint64_t applyAdditions(const config::SceneAdditions& additions) override;
  void applyStiffness(const std::vector<config::RegionSettings>& regions) override;
  std::optional<std::size_t> regionAt(const rt::Vec3& position_m_in_world) const override;
  std::uint64_t engage(bool engaged, bool inside) override;
  bool engaged() override;
  std::uint64_t acknowledgedGeneration() override;
  std::future<config::Result<std::string>> startTrace(const TraceRequest& request) override;
  std::future<config::Result<std::string>> stopTrace() override;
  std::future<config::Result<std::string>> dumpTrace() override;
  std::future<config::Result<std::vector<drivers::TraceEntry>>> listTraces() override;
  std::future<config::Result<void>> deleteTrace(const std::string& name) override;
  std::future<config::Result<void>> keepTrace(const std::string& name, bool keep) override;
  std::future<config::Result<void>> noteTrace(const std::string& name, const std::string& text) override;
  std::future<config::Result<SceneSnapshot>> takeSnapshot() override;
  config::Result<SharedDepth> shareDepth() override;
  void hideDepth() override;

  /// From now on changes wait for acknowledge().
  void holdAcknowledgements();
  void acknowledge();
  /// Waits until this many changes have been requested since the start. False after 20 s (so long that a
  /// loaded machine does not fail).
  bool waitForGeneration(std::uint64_t generation);
  int statusCalls() const;
  /// Waits in the same way until status() was called so many times since the start.
  bool waitForStatusCalls(int calls);

  /// From now on, functions that wait for the disk take until finishJobs().
  void holdJobs();
  void finishJobs();
  /// Waits in the same way, or for another time, until so many of them were begun since the start.
  bool waitForJobs(int jobs, std::chrono::seconds patience = std::chrono::seconds(60));

  void setStatus(const BoxStatus& status);
  /// Sets the settings; to be called before the service is created.
  void setSettings(const config::Settings& settings) { settings_ = settings; }
  /// Replaces all traces by this many finished ones.
  void setTraces(int count, const std::string& note = "");
  /// Whether the camera has delivered a frame.
  void setFrame(bool there);
  /// From now on there is no memory for depth frames.
  void failToShareDepth();
  bool sharesDepth() const;
  int timesDepthWasShared() const;
  /// Waits as waitForGeneration() does.
  bool waitUntilDepthIsHidden();
  /// A pixel of the frame that it has delivered.
  static std::uint16_t rawAt(std::size_t pixel) { return static_cast<std::uint16_t>(pixel * 7 % 2048); }
  config::Settings appliedSettings() const;
  /// How often applyStiffness() was called.
  int timesStiffnessWasApplied() const;
  /// Waits as waitForGeneration() does.
  bool waitForStiffness(int times);
  std::uint64_t generation() const;

 private:
  std::uint64_t take(const config::Settings& settings);
  std::uint64_t newGeneration();
  /// Returns the future of a job that is done now or by finishJobs(). `job` is called with the lock held.
  template <typename T>
  std::future<config::Result<T>> begin(std::function<config::Result<T>()> job);
  config::Result<std::string> newTrace(const std::string& label, bool open, bool depth);
  config::Result<std::string> closeTrace();

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  config::Settings settings_;
  BoxStatus status_;
  int status_calls_ = 0;
  AdditionGenerations addition_generations_;
  int times_stiffness_applied_ = 0;
  std::uint64_t generation_ = 0;
  std::uint64_t acknowledged_ = 0;
  bool held_ = false;
  bool jobs_held_ = false;
  int jobs_begun_ = 0;
  std::vector<std::function<void()>> jobs_;
  std::vector<drivers::TraceEntry> traces_;
  bool frame_there_ = true;
  bool no_memory_ = false;
  int times_shared_ = 0;
  std::unique_ptr<drivers::DepthRegionWriter> depth_region_;
};

}  // namespace hapticd::daemon::test
