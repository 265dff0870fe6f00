// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tools/hapticd-view/live/source.h"
#include "tools/hapticd-view/recorded/recorded_session.h"

namespace hapticd::tools::view {

/// A recorded session as a source. All viewers look at the same moment of it: any of them may play, pause and
/// move.  Thread: the io_context's.
class TraceSource final : public Source {
 public:
  /// `version`: of this program, for `hello`.
  TraceSource(boost::asio::io_context& context, RecordedSession session, std::string version);

  Json hello() const override;
  void add(Viewer& viewer) override;
  void remove(Viewer& viewer) override;
  void wantsChanged() override;
  void control(const PlaybackRequest& request) override;

 private:
  using Clock = std::chrono::steady_clock;

  void play();
  void pause();
  void seek(double position_s);
  void step(int frames);
  void schedule();
  void advance();
  /// Shows the moment at the position, of which the viewers do not know what was before.
  void showMoment();
  void showTicks(std::span<const rt::Tick> ticks);
  void showDepth();
  void showStatus();
  void showParameters();
  void showAdditions();
  void showPlayback();
  std::optional<std::size_t> frameNow() const;
  Json status() const;
  Json playback() const;
  std::int64_t position_ns() const { return session_.timeAt(position_s_); }

  boost::asio::steady_timer timer_;
  RecordedSession session_;
  std::string version_;
  Json timeline_;
  std::vector<Viewer*> viewers_;

  double position_s_ = 0;
  double factor_ = 1;
  bool playing_ = false;
  Clock::time_point shown_at_;  // when the position was last moved by playing
  Clock::time_point next_status_;
  std::size_t next_event_ = 0;             // the first event after the position
  std::optional<std::size_t> frame_;       // the depth frame that is shown
  std::optional<std::size_t> parameters_;  // the set that is shown
  std::optional<std::size_t> additions_;   // the same for fixtures and regions
};

}  // namespace hapticd::tools::view
