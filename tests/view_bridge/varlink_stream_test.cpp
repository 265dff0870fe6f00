// SPDX-License-Identifier: Apache-2.0
// The view's side of the daemon's socket, with a service that never ends its reply.
#include "tools/hapticd-view/box_link/varlink_stream.h"

#include <gtest/gtest.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <memory>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hapticd::tools::view {
namespace {

using boost::asio::local::stream_protocol;
using boost::system::error_code;

/// Sends a text without end to whoever connects, and counts what is taken.
class EndlessService {
 public:
  EndlessService(boost::asio::io_context& context, const std::string& path)
      : acceptor_(context, stream_protocol::endpoint(path)), socket_(context), text_(65536, 'x') {
    acceptor_.async_accept(socket_, [this](const error_code& error) {
      if (!error) send();
    });
  }
  std::size_t sent() const { return sent_; }

 private:
  void send() {
    socket_.async_write_some(boost::asio::buffer(text_), [this](const error_code& error, std::size_t bytes) {
      sent_ += bytes;
      if (!error) send();
    });
  }

  stream_protocol::acceptor acceptor_;
  stream_protocol::socket socket_;
  std::string text_;
  std::size_t sent_ = 0;
};

TEST(VarlinkStream, EndsAReplyThatNeverEnds) {
  const test::TemporaryFolder folder;
  boost::asio::io_context context;
  const std::string path = folder.path() / "Status";
  const EndlessService service(context, path);
  auto stream = std::make_shared<VarlinkStream>(context, std::chrono::seconds(60));
  std::string reason;
  stream->start(path, "io.hapticd.Status.GetStatus", Json::object(), /*more=*/false,
                {[](const Json&, const config::Descriptor&) { ADD_FAILURE() << "there is no reply"; },
                 [&](const ClientError& error) { reason = error.what; }});
  context.run();
  EXPECT_NE(reason.find("a reply is too long"), std::string::npos) << reason;
  EXPECT_LT(service.sent(), std::size_t{4} * 1024 * 1024) << "1 MiB, and what the kernel holds";
}

}  // namespace
}  // namespace hapticd::tools::view
