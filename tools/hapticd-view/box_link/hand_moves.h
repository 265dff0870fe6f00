// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "rt/base/vec3.h"
#include "tools/hapticd-view/box_link/varlink_stream.h"
#include "tools/hapticd-view/live/source.h"

namespace hapticd::tools::view {

/// Leads the hand of a box with a simulated handle for one viewer at a time, through its control socket, with
/// the rights of the user who runs this program. Calls nothing else there, over one connection and one call
/// at a time; of the targets that come meanwhile only the newest is sent.  Thread: the io_context's.
class HandMoves {
 public:
  using Clock = std::chrono::steady_clock;
  using Now = std::function<Clock::time_point()>;

  /// A viewer keeps the hand until it is silent for that long, or has left.
  static constexpr std::chrono::milliseconds kTurn{2000};
  /// After a refusal by the box, nothing is sent for that long.
  static constexpr std::chrono::milliseconds kPause{500};

  /// `socket`: path of io.hapticd.Control.
  HandMoves(boost::asio::io_context& context, std::string socket, Now now = Clock::now)
      : context_(context), socket_(std::move(socket)), now_(std::move(now)) {}
  ~HandMoves();
  HandMoves(const HandMoves&) = delete;
  HandMoves& operator=(const HandMoves&) = delete;

  /// `viewer` leads the hand to a finite target. It is told by onHandAnswer() that it leads the hand or why
  /// it does not, each time that this changes, and each time that another one leads it.
  void request(Viewer& viewer, const rt::Vec3& target_m_in_world);
  /// The viewer is gone.
  void forget(const Viewer& viewer);

 private:
  void send();
  void onEnd(const ClientError& error);
  void tell(const std::string& problem);

  boost::asio::io_context& context_;
  const std::string socket_;
  const Now now_;
  std::shared_ptr<VarlinkStream> call_;  // open between calls; null: not connected
  bool waits_ = false;                   // for the answer to a call
  std::optional<rt::Vec3> next_;         // in metres in the world, for when it has come
  Viewer* owner_ = nullptr;              // null: nobody leads the hand, or who did is gone
  Clock::time_point heard_{};            // from the owner
  Clock::time_point again_{};            // nothing is sent before
  std::optional<std::string> told_;      // to the owner
};

}  // namespace hapticd::tools::view
