// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "rt/loop/loop_state.h"
#include "tools/hapticd-view/live/message_sink.h"
#include "tools/hapticd-view/live/source.h"

namespace hapticd::tools::view {

/// The client wants at most that many depth frames a second; 0: none.
struct DepthRate {
  double max_hz = 30;
};

/// The client has drawn the newest depth frame that it got.
struct Drawn {};

/// The client leads the hand of a simulated handle.
struct HandTarget {
  rt::Vec3 target_m_in_world;  ///< finite
};

/// What a client of `/live` may ask for.
using ClientMessage = std::variant<DepthRate, Drawn, FixtureRequest, HandTarget>;

/// Parses a text message from a client; nothing: it is none of these, or a number is out of range.
std::optional<ClientMessage> parseClientMessage(std::string_view text);

/// Sums up ticks for one message `window`: the newest tick as it is, of the others the largest values, so
/// that no peak is lost however few messages a client takes.  Thread: one at a time.
class TickSummary {
 public:
  void add(const rt::Tick& tick);
  void addLost(std::uint64_t ticks) { lost_ += ticks; }

  bool empty() const { return ticks_ == 0 && lost_ == 0; }
  /// The message, JSON. A number that is not finite is null.
  std::string message() const;
  void clear() { *this = TickSummary(); }

 private:
  rt::Tick newest_;
  std::uint64_t ticks_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t contact_ticks_ = 0;
  std::uint32_t fixture_contacts_ = 0;  // bit n: fixture n acted
  double max_force_n_ = 0;
  double max_penetration_m_ = 0;
  bool has_penetration_ = false;  // a law with a proxy was in use
  std::int64_t max_scene_age_ns_ = 0;
  std::int64_t max_wakeup_latency_ns_ = 0;
};

/// One client of `/live`, the protocol of the page (tools/hapticd-view/README.md). Thread: the io_context's.
class LiveSession final : public Session {
 public:
  using Clock = std::chrono::steady_clock;
  using Now = std::function<Clock::time_point()>;

  static constexpr double kWindowsPerSecond = 60;

  /// `source` and `sink` outlive the session. Sends `hello`. `on_refused`: logs why a change of fixtures was
  /// refused.
  LiveSession(Source& source, MessageSink& sink, Now now = Clock::now,
              std::function<void(const std::string& problem)> on_refused = {});

  void onTick(const rt::Tick& tick) override { summary_.add(tick); }
  void onTicksLost(std::uint64_t ticks) override { summary_.addLost(ticks); }
  void onBatchEnd() override;
  void onStatus(const Json& status) override;
  void onParameters(const Json& parameters) override;
  void onAdditions(const Json& additions) override;
  void onSolids(const Json& shapes) override;
  void onEvent(const Json& event) override;
  void onDepth(const std::shared_ptr<const DepthPicture>& picture) override;
  void onDepthState(bool available, const std::string& reason) override;
  void onBox(bool reachable, const std::string& reason) override;
  void onFixtureAnswer(const std::string& name, const std::string& problem) override;
  void onHandAnswer(const std::string& problem) override;
  bool wantsTicks() const override { return true; }
  bool wantsDepth() const override { return depth_max_hz_ > 0; }

  void onText(std::string_view message) override;

 private:
  void sendPicture(const std::shared_ptr<const DepthPicture>& picture);

  Source& source_;
  MessageSink& sink_;
  Now now_;
  std::function<void(const std::string& problem)> on_refused_;
  TickSummary summary_;
  Clock::time_point next_window_{};
  Clock::time_point next_depth_{};
  double depth_max_hz_ = 30;
  bool reports_drawn_ = false;                        // the client reports which frames it has drawn
  bool drawing_ = false;                              // it has not yet drawn the newest one
  std::shared_ptr<const DepthPicture> next_picture_;  // for when it has
};

}  // namespace hapticd::tools::view
