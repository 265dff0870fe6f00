// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <set>
#include <string>

#include "tools/hapticd-view/box_link/varlink_stream.h"
#include "tools/hapticd-view/live/source.h"

namespace hapticd::tools::view {

/// Adds fixtures to a box for viewers, through its control socket, with the rights of the user who runs this
/// program; and removes those again. It calls nothing else there, and one call at a time. Thread: the
/// io_context's.
class FixtureChanges {
 public:
  using Clock = std::chrono::steady_clock;
  /// `problem`: why nothing was changed and what to do, for people; empty: it was done.
  using Answer = std::function<void(const std::string& problem)>;

  /// Requests of all viewers together: a person makes fewer.
  static constexpr std::chrono::milliseconds kPause{500};

  /// `socket`: path of io.hapticd.Control.
  FixtureChanges(boost::asio::io_context& context, std::string socket)
      : context_(context), socket_(std::move(socket)) {}
  ~FixtureChanges();
  FixtureChanges(const FixtureChanges&) = delete;
  FixtureChanges& operator=(const FixtureChanges&) = delete;

  /// Answers at once where the request is refused here, else when the box has answered.
  void request(const FixtureRequest& request, Answer answer);

 private:
  void finish(const std::string& problem);

  boost::asio::io_context& context_;
  const std::string socket_;
  std::set<std::string> added_;  // names that may be removed
  std::shared_ptr<VarlinkStream> call_;
  FixtureRequest requested_;
  Answer answer_;
  Clock::time_point last_{};
};

}  // namespace hapticd::tools::view
