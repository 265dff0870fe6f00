// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/box_link/varlink_stream.h"

#include <fmt/format.h>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>

#include <array>
#include <cerrno>
#include <utility>

#include "tools/lib/client/reply_reader.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {
namespace {

using boost::system::error_code;
using std::placeholders::_1;

/// Four times the longest reply of the daemon.
constexpr std::size_t kMaxReplyBytes = 1024 * 1024;
constexpr const char* kSeeService = "see 'systemctl status hapticd'";

ClientError brokenLink(const std::string& what, int error = 0) {
  return {ClientError::Kind::no_connection, what, kSeeService, {}, error};
}

ClientError connectError(const std::string& path, const error_code& error) {
  switch (error.value()) {
    case ENOENT:
    case ECONNREFUSED:
      return {ClientError::Kind::no_connection,
              fmt::format("hapticd is not running (nothing listens on {})", path),
              "start it with 'systemctl start hapticd'",
              {},
              error.value()};
    case EACCES:
    case EPERM:
      return {ClientError::Kind::no_connection,
              fmt::format("no permission to use {}", path),
              "see the mode of the socket in 'systemctl cat hapticd-status.socket'",
              {},
              error.value()};
    case EAGAIN:
      return {ClientError::Kind::no_answer,
              fmt::format("{}: too many clients wait to be connected", path),
              kSeeService,
              {},
              error.value()};
    default:
      return brokenLink(fmt::format("cannot connect to {}: {}", path, error.message()), error.value());
  }
}

/// A call as it is sent.
std::string callText(const std::string& method, const Json& parameters, bool more) {
  Json call{{"method", method}, {"parameters", parameters}};
  if (more) call["more"] = true;
  return call.dump(-1, ' ', false, Json::error_handler_t::replace) + '\0';
}

ClientError errorReply(const Json& reply) {
  ClientError error{ClientError::Kind::error_reply, reply["error"].get<std::string>(), "", Json::object(), 0};
  if (const Json* parameters = fieldAt(reply, "parameters"); parameters && parameters->is_object())
    error.parameters = *parameters;
  return error;
}

}  // namespace

VarlinkStream::VarlinkStream(boost::asio::io_context& context, std::chrono::milliseconds silence)
    : socket_(context), silence_timer_(context), silence_(silence) {}

VarlinkStream::~VarlinkStream() = default;

void VarlinkStream::start(const std::string& path, const std::string& method, const Json& parameters,
                          bool more, Handler handler) {
  path_ = path;
  method_ = method;
  handler_ = std::move(handler);
  stopped_ = false;
  call_ = callText(method, parameters, more);
  watchSilence();
  const auto self = shared_from_this();
  if (path.empty() || path.size() >= sizeof(sockaddr_un::sun_path)) {
    boost::asio::post(socket_.get_executor(), [self] {
      self->onConnected(
          error_code(self->path_.empty() ? ENOENT : ENAMETOOLONG, boost::system::system_category()));
    });
    return;
  }
  socket_.async_connect(boost::asio::local::stream_protocol::endpoint(path),
                        [self](const error_code& error) { self->onConnected(error); });
}

void VarlinkStream::stop() {
  stopped_ = true;
  error_code ignored;
  socket_.close(ignored);
  silence_timer_.cancel();
}

void VarlinkStream::onConnected(const error_code& error) {
  if (stopped_) return;
  if (error) return end(connectError(path_, error));
  socket_.native_non_blocking(true);
  writeCall();
  waitForInput();
}

void VarlinkStream::callAgain(const Json& parameters) {
  if (stopped_) return;
  call_ = callText(method_, parameters, /*more=*/false);
  watchSilence();
  writeCall();
}

void VarlinkStream::writeCall() {
  // a service that refuses closes its end after the reason, which is still to be read
  boost::asio::async_write(socket_, boost::asio::buffer(call_),
                           [self = shared_from_this()](const error_code&, std::size_t) {});
}

void VarlinkStream::waitForInput() {
  if (stopped_) return;
  const auto self = shared_from_this();
  socket_.async_wait(Socket::wait_read, [self](const error_code& error) {
    if (self->stopped_) return;
    if (error) return self->end(brokenLink(self->path_ + ": " + error.message(), error.value()));
    self->read();
  });
}

void VarlinkStream::read() {
  static thread_local std::array<char, 65536> chunk;
  const ssize_t count = receiveSome(socket_.native_handle(), chunk, received_);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return waitForInput();
  if (count <= 0) return end(brokenLink(path_ + ": hapticd has closed the connection"));
  input_.append(chunk.data(), static_cast<std::size_t>(count));
  const auto self = shared_from_this();  // a handler may drop its pointer
  takeMessages();
  if (stopped_) return;
  if (input_.size() > kMaxReplyBytes) return end(brokenLink(path_ + ": a reply is too long"));
  watchSilence();
  waitForInput();
}

void VarlinkStream::takeMessages() {
  std::size_t begin = 0;
  for (std::size_t nul = input_.find('\0', searched_); nul != std::string::npos && !stopped_;
       nul = input_.find('\0', begin)) {
    takeReply(input_.substr(begin, nul - begin));
    begin = nul + 1;
  }
  input_.erase(0, begin);
  searched_ = input_.size();
}

void VarlinkStream::takeReply(const std::string& message) {
  const Json reply = Json::parse(message, nullptr, /*allow_exceptions=*/false);
  if (!reply.is_object()) return end(brokenLink(path_ + ": the answer is not a Varlink reply"));
  if (const auto error = reply.find("error"); error != reply.end() && error->is_string())
    return end(errorReply(reply));
  const Json* parameters = fieldAt(reply, "parameters");
  static const Json none = Json::object();
  const base::Descriptor descriptor = std::exchange(received_, base::Descriptor());
  handler_.on_reply(parameters && parameters->is_object() ? *parameters : none, descriptor);
  if (!stopped_ && !keeps_open_ && !flagAt(reply, "continues"))
    end(brokenLink(path_ + ": hapticd has ended the stream"));
}

void VarlinkStream::watchSilence() {
  if (silence_ == std::chrono::milliseconds(0)) return;
  silence_timer_.expires_after(silence_);
  const auto self = shared_from_this();
  silence_timer_.async_wait([self](const error_code& error) {
    if (error || self->stopped_ || self->silence_timer_.expiry() > std::chrono::steady_clock::now()) return;
    self->end({ClientError::Kind::no_answer, "hapticd does not answer", kSeeService, {}, 0});
  });
}

void VarlinkStream::end(ClientError error) {
  if (stopped_) return;
  stop();
  const Handler handler = std::exchange(handler_, {});
  handler.on_end(error);
}

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

namespace {

constexpr const char* kParameter = "control.depth_for_everyone";
constexpr std::chrono::seconds kSilence{1};
/// So long an answer holds, so that clients without a token cannot keep the daemon busy.
constexpr std::chrono::seconds kHolds{2};

}  // namespace

OpenToEverybody::OpenToEverybody(boost::asio::io_context& context, std::string socket)
    : context_(context), socket_(std::move(socket)) {}

void OpenToEverybody::ask(Answer answer) {
  const auto now = std::chrono::steady_clock::now();
  if (!call_ && known_ && now - asked_ < kHolds) return answer(is_open_);
  waiting_.push_back(std::move(answer));
  if (call_) return;
  asked_ = now;
  is_open_ = false;
  call_ = std::make_shared<VarlinkStream>(context_, kSilence);
  call_->start(socket_, "io.hapticd.Status.GetParameters", {{"names", Json::array({kParameter})}},
               /*more=*/false,
               {[this](const Json& reply, const base::Descriptor&) {
                  const Json& rows = listAt(reply, "parameters");
                  is_open_ = rows.size() == 1 && flagAt(rows[0], "value");
                },
                [this](const ClientError&) { answerAll(); }});
}

void OpenToEverybody::answerAll() {
  call_.reset();
  known_ = true;
  for (const Answer& answer : std::exchange(waiting_, {})) answer(is_open_);
}

}  // namespace hapticd::tools::view
