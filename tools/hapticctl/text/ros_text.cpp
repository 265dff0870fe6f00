// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/ros_text.h"

#include <fmt/format.h>

#include <cmath>

#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

std::string rateText(const Json& topic) {
  const double rate_hz = numberAt(topic, "rateHz");
  return std::isnan(rate_hz) ? "-" : fmt::format("{:.1f} Hz", rate_hz);
}

/// The names of those whom messages pass to or from; "-" for none.
std::string peersText(const Json& topic, const char* peers) {
  std::string text;
  for (const Json& peer : listAt(topic, peers)) {
    if (textAt(peer, "problem") == "-") text += (text.empty() ? "" : ", ") + textAt(peer, "name");
  }
  return text.empty() ? "-" : text;
}

/// peers: the member with them, "subscribers", which is also the title of their column.
std::string tableText(const Json& topics, const char* title, const char* peers, std::size_t columns) {
  Table table({{title}, {"type"}, {"rate", true}, {peers}});
  for (const Json& topic : topics)
    table.add({textAt(topic, "topic"), textAt(topic, "type"), rateText(topic), peersText(topic, peers)});
  return table.text(columns);
}

/// What is wrong with a topic, a line for each. `passes`: "does not reach" or "does not come from".
std::string problemsText(const Json& topic, const char* peers, const char* passes) {
  const std::string name = textAt(topic, "topic");
  std::string text;
  for (const Json& peer : listAt(topic, peers)) {
    if (const std::string problem = textAt(peer, "problem"); problem != "-")
      text += fmt::format("! {} {} {}: {}\n", name, passes, textAt(peer, "name"), problem);
    if (const std::string warning = textAt(peer, "warning"); warning != "-")
      text += fmt::format("! {} with {}: {}\n", name, textAt(peer, "name"), warning);
  }
  for (const Json& other : listAt(topic, "otherPublishers"))
    text += fmt::format("! {} is published by {}, too: subscribers cannot tell the messages apart\n", name,
                        valueText(other));
  if (numberAt(topic, "failed") > 0)
    text += fmt::format("! {}: {} messages could not be written\n", name, countAt(topic, "failed"));
  if (numberAt(topic, "refused") > 0)
    text += fmt::format("! {}: {} messages were refused, {} taken; the last one because {}\n", name,
                        countAt(topic, "refused"), countAt(topic, "taken"), textAt(topic, "lastRefusal"));
  return text;
}

}  // namespace

std::string rosStatusText(const Json& status, std::size_t columns) {
  const std::string mode = textAt(status, "mode");
  std::string text = fmt::format(
      "hapticd-ros {} publishes {}/... in domain {} at {}{}\nhapticd {}\n\n", textAt(status, "version"),
      textAt(status, "namespace"), countAt(status, "domain"), textAt(status, "interface"),
      flagAt(status, "isLoopback") ? ": only programs of this computer see it" : "",
      mode == "-" ? "does not answer it" : "is " + mode);
  const Json& published = listAt(status, "published");
  const Json& taken = listAt(status, "taken");
  text += tableText(published, "published", "subscribers", columns) + "\n";
  text += taken.empty() ? "Nothing is taken from the network (hapticd-ros --take).\n"
                        : tableText(taken, "taken", "publishers", columns);
  std::string problems;
  for (const Json& topic : published) problems += problemsText(topic, "subscribers", "does not reach");
  for (const Json& topic : taken) problems += problemsText(topic, "publishers", "does not come from");
  if (!problems.empty()) text += "\n" + fitted(problems, columns);
  return text;
}

}  // namespace hapticd::tools
