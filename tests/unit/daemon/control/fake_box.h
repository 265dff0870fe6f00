#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>

#include "daemon/box.h"

namespace hapticd::daemon::test {

/// A box without a loop: takes over changes at once or when the test says so.
/// Thread: any.
class FakeBox final : public Box {
 public:
  FakeBox();

  BoxStatus status() override;
  const config::Settings& settings() const override { return settings_; }
  std::uint64_t apply(const config::Settings& settings) override;
  std::uint64_t engage(bool engaged, bool inside) override;
  std::uint64_t acknowledgedGeneration() override;
  std::future<config::Result<std::string>> startTrace(const TraceRequest& request) override;
  std::future<config::Result<std::string>> stopTrace() override;
  std::future<config::Result<std::string>> dumpTrace() override;
  std::future<config::Result<std::vector<drivers::TraceEntry>>> listTraces() override;
  std::future<config::Result<void>> deleteTrace(const std::string& name) override;
  std::future<config::Result<SceneSnapshot>> takeSnapshot() override;

  /// From now on changes wait for acknowledge().
  void holdAcknowledgements();
  void acknowledge();
  /// Waits until so many changes were asked for since the start. False after 20 s (so long that a loaded
  /// machine does not fail).
  bool waitForGeneration(std::uint64_t generation);
  /// Waits in the same way until status() was called so many times since the start.
  bool waitForStatusCalls(int calls);

  void setStatus(const BoxStatus& status);
  config::Settings appliedSettings() const;
  std::uint64_t generation() const;

 private:
  std::uint64_t newGeneration();

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  config::Settings settings_;
  BoxStatus status_;
  int status_calls_ = 0;
  std::uint64_t generation_ = 0;
  std::uint64_t acknowledged_ = 0;
  bool held_ = false;
};

}  // namespace hapticd::daemon::test
