// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/hapticd-view/box_link/additions_fetch.h"
#include "tools/hapticd-view/box_link/depth_frames.h"
#include "tools/hapticd-view/box_link/lasting_stream.h"
#include "tools/hapticd-view/live/recent_events.h"
#include "tools/hapticd-view/live/source.h"

namespace hapticd::tools::view {

/// A running box as a source, through the daemon's reading socket. It is connected only while there are
/// viewers, and fetches only what one of them wants.  Thread: the io_context's.
class BoxSource final : public Source {
 public:
  /// `socket`: path of io.hapticd.Status. `version`: of this program, for `hello`.
  BoxSource(boost::asio::io_context& context, const std::string& socket, std::string version);

  Json hello() const override;
  void add(Viewer& viewer) override;
  void remove(Viewer& viewer) override;
  void wantsChanged() override;

 private:
  void onStatus(const Json& reply);
  void onTicks(const Json& reply);
  void onEvent(const Json& reply);
  void onDepthShared(const config::Descriptor& memory);
  void setBox(bool reachable, const std::string& reason);
  void setDepth(bool available, const std::string& reason);
  void setAdditions(const Json& additions);
  void fetchParameters();
  void onParameters(const Json& reply);
  void forget();

  boost::asio::io_context& context_;
  std::string socket_;
  std::string version_;
  std::vector<Viewer*> viewers_;

  LastingStream monitor_;
  LastingStream ticks_;
  LastingStream events_;
  LastingStream depth_;
  AdditionsFetch additions_fetch_;
  std::shared_ptr<VarlinkStream> parameters_call_;
  bool parameters_changed_ = false;  // since parameters_call_ was sent

  // what a viewer that comes later is shown at once
  std::optional<bool> reachable_;
  std::string reason_;
  std::optional<bool> depth_available_;
  std::string depth_reason_;
  Json status_;
  Json parameters_;
  Json additions_;
  RecentEvents past_events_;
  std::shared_ptr<const DepthPicture> picture_;

  std::uint64_t ticks_lost_ = 0;  // as the stream of ticks counts them
  std::optional<DepthFrames> frames_;
};

}  // namespace hapticd::tools::view
