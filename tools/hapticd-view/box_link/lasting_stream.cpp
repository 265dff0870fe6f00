// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/lasting_stream.h"

#include <utility>

namespace hapticd::tools::view {

LastingStream::LastingStream(boost::asio::io_context& context, std::string path, std::string method,
                             Json parameters, std::chrono::milliseconds silence,
                             VarlinkStream::Handler handler)
    : context_(context),
      pause_(context),
      path_(std::move(path)),
      method_(std::move(method)),
      parameters_(std::move(parameters)),
      silence_(silence),
      handler_(std::move(handler)) {}

void LastingStream::open() {
  if (open_) return;
  open_ = true;
  call();
}

void LastingStream::close() {
  open_ = false;
  pause_.cancel();
  if (stream_) stream_->stop();
  stream_.reset();
}

void LastingStream::callAgain() {
  if (!open_) return;
  stream_->stop();
  callAfterPause();
}

void LastingStream::call() {
  stream_ = std::make_shared<VarlinkStream>(context_, silence_);
  const auto on_end = [this](const ClientError& error) {
    callAfterPause();
    handler_.on_end(error);
  };
  stream_->start(path_, method_, parameters_, /*more=*/true, {handler_.on_reply, on_end});
}

void LastingStream::callAfterPause() {
  pause_.expires_after(kPause);
  pause_.async_wait([this](const boost::system::error_code& cancelled) {
    if (!cancelled && open_) call();
  });
}

}  // namespace hapticd::tools::view
