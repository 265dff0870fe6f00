// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/base/box.h"
#include "daemon/base/reloads.h"

namespace hapticd::daemon::test {

/// Reloads that end at once, as a test sets them up. Thread: any.
class FakeReloads final : public Reloads {
 public:
  explicit FakeReloads(Box& box) : box_(box) {}

  /// From now on this waits for confirmation, as number 7.
  void holdBack(std::vector<config::Loosening> loosenings) {
    const std::lock_guard lock(mutex_);
    pending_ = PendingReload{7, std::move(loosenings)};
  }
  void fail() {
    const std::lock_guard lock(mutex_);
    fails_ = true;
  }

  std::uint64_t request() override { return 1; }
  std::optional<Outcome> outcome(std::uint64_t) const override {
    const std::lock_guard lock(mutex_);
    if (fails_) return std::unexpected(std::vector{base::Error{"hapticd.yaml", "is empty", "restore it"}});
    return done();
  }
  const std::optional<PendingReload>& pending() const override { return pending_; }
  Outcome confirm() override {
    const std::lock_guard lock(mutex_);
    pending_.reset();
    return done();
  }

 private:
  ReloadReport done() const {
    return {box_.acknowledgedGeneration(),
            {"sets force.radius_m from 0.04 to 0.03"},
            {"loop.priority"},
            {"fixture a"}};
  }

  Box& box_;
  mutable std::mutex mutex_;
  std::optional<PendingReload> pending_;
  bool fails_ = false;
};

}  // namespace hapticd::daemon::test
