// SPDX-License-Identifier: Apache-2.0
// Data from a client of hapticd-view: whatever a header holds, who lacks the token is refused, and no reason
// tells a secret; whatever a message holds, it is a request within its ranges or none.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tests/fuzz/seeds.h"
#include "tools/hapticd-view/live/live_session.h"
#include "tools/hapticd-view/server/access.h"

namespace {

using namespace hapticd::tools::view;

constexpr std::string_view kToken = "0123456789abcdef0123456789abcdef";

/// The fields of a header, each ended by a line feed: method, target, Host, Origin, Sec-Fetch-Site, Cookie.
/// An empty line stands for a field that is absent.
RequestHead headOf(std::string_view bytes) {
  std::array<std::string, 6> lines;
  for (std::string& line : lines) {
    line = bytes.substr(0, bytes.find('\n'));
    bytes.remove_prefix(std::min(line.size() + 1, bytes.size()));
  }
  const auto listOf = [](const std::string& line) {
    return line.empty() ? std::vector<std::string>() : std::vector<std::string>{line};
  };
  return {.method = lines[0],
          .target = lines[1],
          .hosts = listOf(lines[2]),
          .origins = listOf(lines[3]),
          .fetch_sites = listOf(lines[4]),
          .cookies = listOf(lines[5])};
}

void checkAccess(std::string_view bytes) {
  const RequestHead head = headOf(bytes);
  const AccessRules rules{
      .local_address = "127.0.0.1", .hosts = {"box.example"}, .origins = {}, .token = std::string(kToken)};
  const auto refusal = refusalOf(head, rules);
  if (!refusal) {
    require(head.method == "GET" && head.hosts.size() == 1);
    const bool has_token = head.target.find(kToken) != std::string::npos ||
                           (!head.cookies.empty() && head.cookies[0].find(kToken) != std::string::npos);
    require(has_token);
    return;
  }
  require(refusal->status >= 400 && refusal->status < 500 && !refusal->reason.empty());
  for (const char character : refusal->reason) require(static_cast<unsigned char>(character) >= 0x20);
  require(pathOf(head.target).find('?') == std::string::npos);
}

}  // namespace

std::vector<std::string> seeds() {
  const std::string token(kToken);
  return {
      "GET\n/live?token=" + token + "\n127.0.0.1:8765\nhttp://127.0.0.1:8765\nsame-origin\n\n",
      "GET\n/\n[::1]:8765\n\nnone\ntheme=dark; hapticd-view=" + token + "\n",
      "POST\n/?token=1\nevil.example\nnull\ncross-site\nhapticd-view=\n",
      R"({"type":"depth","maxHz":30})",
      R"({"type":"drawn"})",
      R"({"type":"hand","target":[0.1,0,-0.8]})",
  };
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  checkAccess(bytes);
  const auto message = parseClientMessage(bytes);
  const auto* const depth = message ? std::get_if<DepthRate>(&*message) : nullptr;
  require(depth == nullptr || (depth->max_hz >= 0 && depth->max_hz <= 1000));
  return 0;
}
