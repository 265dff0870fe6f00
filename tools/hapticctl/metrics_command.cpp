// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/metrics_command.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>

#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/http_reply.h"
#include "tools/hapticctl/open_metrics.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

constexpr std::chrono::seconds kRequestLimit{5};
const Call kGetStatus{"io.hapticd.Status.GetStatus"};

Json statusIn(const Json& reply) {
  const Json* status = fieldAt(reply, "status");
  return status ? *status : Json::object();
}

/// Reads the head of a request, as much of it as arrives in time.
std::string receiveRequest() {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + kRequestLimit;
  std::string received;
  std::array<char, 1024> bytes;
  while (!isWholeRequest(received) && received.size() < kMaxRequestBytes) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (left.count() <= 0 || ::poll(&input, 1, static_cast<int>(left.count())) <= 0) break;
    const ssize_t count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    if (count <= 0) break;
    received.append(bytes.data(), static_cast<std::size_t>(count));
  }
  return received;
}

}  // namespace

int runMetrics(const CommandOptions& options, MetricsFormat format) {
  return callAndPrint(options, kGetStatus,
                      [format](const Json& reply) { return metricsOf(statusIn(reply), format); });
}

int runMetricsOverHttp(const CommandOptions& options) {
  ::signal(SIGPIPE, SIG_IGN);  // the client may be gone
  const std::string answer = httpReply(receiveRequest(), [&](MetricsFormat format) {
    const auto reply = callOnce(options, kGetStatus);
    return metricsOf(reply ? statusIn(*reply) : Json(), format);
  });
  fmt::print("{}", answer);
  return kOk;
}

}  // namespace hapticd::tools
