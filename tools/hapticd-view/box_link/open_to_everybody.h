// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/hapticd-view/box_link/varlink_stream.h"

namespace hapticd::tools::view {

/// Asks a box whether it shows its depth image to everybody (control.depth_for_everyone).
/// Thread: the io_context's.
class OpenToEverybody {
 public:
  using Answer = std::function<void(bool)>;

  OpenToEverybody(boost::asio::io_context& context, std::string socket);

  /// Answers at once if the box was asked within the last seconds, else when it has answered; false where it
  /// does not.
  void ask(Answer answer);

 private:
  void answerAll();

  boost::asio::io_context& context_;
  std::string socket_;
  std::vector<Answer> waiting_;
  std::shared_ptr<VarlinkStream> call_;
  std::chrono::steady_clock::time_point asked_{};
  bool known_ = false;
  bool is_open_ = false;
};

}  // namespace hapticd::tools::view
