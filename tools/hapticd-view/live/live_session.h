// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "tools/hapticd-view/live/message_sink.h"
#include "tools/hapticd-view/live/source.h"
#include "tools/hapticd-view/live/tick_summary.h"

namespace hapticd::tools::view {

/// One client of `/live`, the protocol of the page (tools/hapticd-view/README.md). Thread: the io_context's.
class LiveSession final : public Session {
 public:
  using Clock = std::chrono::steady_clock;
  using Now = std::function<Clock::time_point()>;

  static constexpr double kWindowsPerSecond = 60;

  /// `source` and `sink` outlive the session. Sends `hello`.
  LiveSession(Source& source, MessageSink& sink, Now now = Clock::now);

  void onTick(const rt::Tick& tick) override { summary_.add(tick); }
  void onTicksLost(std::uint64_t ticks) override { summary_.addLost(ticks); }
  void onBatchEnd() override;
  void onStatus(const Json& status) override;
  void onParameters(const Json& parameters) override;
  void onAdditions(const Json& additions) override;
  void onEvent(const Json& event) override;
  void onDepth(const std::shared_ptr<const DepthPicture>& picture) override;
  void onDepthState(bool available, const std::string& reason) override;
  void onBox(bool reachable, const std::string& reason) override;
  bool wantsTicks() const override { return true; }
  bool wantsDepth() const override { return depth_max_hz_ > 0; }

  void onText(std::string_view message) override;

 private:
  void sendPicture(const std::shared_ptr<const DepthPicture>& picture);

  Source& source_;
  MessageSink& sink_;
  Now now_;
  TickSummary summary_;
  Clock::time_point next_window_{};
  Clock::time_point next_depth_{};
  double depth_max_hz_ = 30;
  bool reports_drawn_ = false;                        // the client reports which frames it has drawn
  bool drawing_ = false;                              // it has not yet drawn the newest one
  std::shared_ptr<const DepthPicture> next_picture_;  // for when it has
};

}  // namespace hapticd::tools::view
