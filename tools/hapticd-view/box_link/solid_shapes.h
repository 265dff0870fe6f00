// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>

#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "tools/hapticd-view/box_link/varlink_stream.h"

namespace hapticd::tools::view {

/// Asks a box for the shape of each solid that its fixtures have, once for each, one call at a time.
/// Thread: the io_context's.
class SolidShapes {
 public:
  /// Receives all shapes that are known, SHA-256 to the reply of io.hapticd.Status.GetSolid.
  using OnChange = std::function<void(const Json& shapes)>;

  /// `socket`: path of io.hapticd.Status. `on_change`: called when no call is under way and something is
  /// known that was not known before; not from within follow().
  SolidShapes(boost::asio::io_context& context, std::string socket, OnChange on_change);
  ~SolidShapes() { forget(); }
  SolidShapes(const SolidShapes&) = delete;
  SolidShapes& operator=(const SolidShapes&) = delete;

  /// The fixtures of the box have changed: entries of io.hapticd.Status.ListFixtures. What no fixture has any
  /// longer is forgotten; what the box could not show until now is asked for again.
  void follow(const Json& fixtures);
  /// Ends what is under way; nothing is known afterwards.
  void forget();
  const Json& shapes() const { return shapes_; }

 private:
  void askNext();

  boost::asio::io_context& context_;
  const std::string socket_;
  const OnChange on_change_;
  std::deque<std::string> waiting_;
  std::shared_ptr<VarlinkStream> call_;
  bool changed_ = false;
  Json shapes_ = Json::object();
};

}  // namespace hapticd::tools::view
