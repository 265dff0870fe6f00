// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/base/descriptor.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {

/// One call to a Varlink service with the flag "more", without blocking: each reply as it comes, until the
/// service or the owner ends it. It does not connect again by itself.
/// Thread: the io_context's. The functions are called from there, never from within start() or after stop().
class VarlinkStream : public std::enable_shared_from_this<VarlinkStream> {
 public:
  struct Handler {
    /// The parameters of a reply, and the descriptor that came with it, if any.
    std::function<void(const Json& parameters, const base::Descriptor& descriptor)> on_reply;
    /// The stream has ended: a last reply came, or an error, or the connection broke.
    std::function<void(const ClientError& error)> on_end;
  };

  /// `silence`: ends the stream when nothing has come for that long; 0: however long.
  VarlinkStream(boost::asio::io_context& context, std::chrono::milliseconds silence);
  ~VarlinkStream();

  /// Connects and calls. `more`: false for a call with a single reply.
  void start(const std::string& path, const std::string& method, const Json& parameters, bool more,
             Handler handler);
  void stop();
  /// From now on the connection stays open after the last reply to a call, for callAgain().
  void keepOpen() { keeps_open_ = true; }
  /// Calls the same method over the connection that was kept open, once the call before has been answered.
  void callAgain(const Json& parameters);

 private:
  using Socket = boost::asio::local::stream_protocol::socket;

  void onConnected(const boost::system::error_code& error);
  void writeCall();
  void waitForInput();
  void read();
  void takeMessages();
  void takeReply(const std::string& message);
  void watchSilence();
  void end(ClientError error);

  Socket socket_;
  boost::asio::steady_timer silence_timer_;
  std::chrono::milliseconds silence_;
  std::string path_;
  std::string method_;
  std::string call_;
  std::string input_;
  std::size_t searched_ = 0;  // of input_, without finding the end of a message
  base::Descriptor received_;
  Handler handler_;
  bool stopped_ = true;
  bool keeps_open_ = false;
};

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
