// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <string>

#include "tools/hapticd-view/box_link/varlink_stream.h"

namespace hapticd::tools::view {

/// A VarlinkStream that is called again one second after it has ended, for as long as it is open.
/// Thread: the io_context's.
class LastingStream {
 public:
  static constexpr std::chrono::seconds kPause{1};

  /// `handler`: its functions are called between open() and close(); on_end before each pause.
  LastingStream(boost::asio::io_context& context, std::string path, std::string method, Json parameters,
                std::chrono::milliseconds silence, VarlinkStream::Handler handler);
  ~LastingStream() { close(); }
  LastingStream(const LastingStream&) = delete;
  LastingStream& operator=(const LastingStream&) = delete;

  /// Does nothing if it is open.
  void open();
  void close();
  /// Ends the present call and calls after a pause, because what it brought is of no use any longer.
  void callAgain();
  bool isOpen() const { return open_; }

 private:
  void call();
  void callAfterPause();

  boost::asio::io_context& context_;
  boost::asio::steady_timer pause_;
  std::string path_;
  std::string method_;
  Json parameters_;
  std::chrono::milliseconds silence_;
  VarlinkStream::Handler handler_;
  std::shared_ptr<VarlinkStream> stream_;
  bool open_ = false;
};

}  // namespace hapticd::tools::view
