// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/commands.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>

#include "tools/hapticctl/text/error_text.h"
#include "tools/hapticctl/text/open_metrics.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

struct Request {
  std::string_view method;
  std::string_view path;
};

/// The request in the first line; an empty method if it is not HTTP.
Request requestIn(std::string_view received) {
  const std::string_view line = received.substr(0, received.find_first_of("\r\n"));
  const std::size_t path_begin = line.find(' ');
  const std::size_t path_end = line.rfind(' ');
  if (path_begin == std::string_view::npos || path_begin == path_end ||
      !line.substr(path_end + 1).starts_with("HTTP/1.")) {
    return {};
  }
  std::string_view path = line.substr(path_begin + 1, path_end - path_begin - 1);
  path = path.substr(0, path.find('?'));
  return {line.substr(0, path_begin), path};
}

/// Returns the form selected by the header Accept.
MetricsFormat acceptedFormat(std::string_view received) {
  std::string head(received);
  std::ranges::transform(head, head.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::size_t begin = head.find("\naccept:");
  if (begin == std::string::npos) return MetricsFormat::open_metrics;
  const std::string accepted = head.substr(begin, head.find('\n', begin + 1) - begin);
  const bool any =
      accepted.find("openmetrics") != std::string::npos || accepted.find("*/*") != std::string::npos;
  return any ? MetricsFormat::open_metrics : MetricsFormat::prometheus;
}

std::string reply(std::string_view status, std::string_view type, std::string_view body, bool with_body,
                  std::string_view more_head = "") {
  return fmt::format("HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n{}\r\n{}",
                     status, type, body.size(), more_head, with_body ? body : "");
}

std::string refusal(std::string_view status, std::string_view text, std::string_view more_head = "") {
  return reply(status, "text/plain; charset=utf-8", text, true, more_head);
}

}  // namespace

bool isWholeRequest(std::string_view received) {
  return received.find("\r\n\r\n") != std::string_view::npos ||
         received.find("\n\n") != std::string_view::npos;
}

std::string httpReply(std::string_view received,
                      const std::function<std::string(MetricsFormat format)>& metrics) {
  const Request request = requestIn(received);
  if (request.method.empty() || !isWholeRequest(received)) {
    return refusal("400 Bad Request", "this is not an HTTP/1 request\n");
  }
  if (request.method != "GET" && request.method != "HEAD") {
    return refusal("405 Method Not Allowed", "only GET and HEAD\n", "Allow: GET, HEAD\r\n");
  }
  if (request.path != "/metrics") return refusal("404 Not Found", "there is only /metrics\n");
  const MetricsFormat format = acceptedFormat(received);
  const char* const type = format == MetricsFormat::prometheus ? kPrometheusType : kOpenMetricsType;
  return reply("200 OK", type, metrics(format), request.method == "GET");
}

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
  const auto reply = callOnce(options, kGetStatus);
  if (!reply) return report(reply.error(), options.json);
  const std::string text = metricsOf(statusIn(*reply), format);
  if (options.json) {
    printJson(
        {{"format", format == MetricsFormat::prometheus ? "prometheus" : "openmetrics"}, {"text", text}});
  } else {
    fmt::print("{}", text);
  }
  return kOk;
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
