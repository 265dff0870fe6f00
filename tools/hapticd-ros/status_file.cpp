// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/status_file.h"

#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <system_error>

#include "config/base/whole_file.h"
#include "daemon/trace/ros/message_definitions.h"
#include "rt/base/clock.h"
#include "rt/base/words.h"

namespace hapticd::tools::ros {
namespace {

constexpr const char* kNode = "hapticd_ros";

Json textOrNull(const std::string& text) {
  return text.empty() ? Json() : Json(text);
}

Json peersJson(const std::vector<Peer>& peers) {
  Json all = Json::array();
  for (const Peer& peer : peers) {
    all.push_back(
        {{"name", peer.name}, {"problem", textOrNull(peer.problem)}, {"warning", textOrNull(peer.warning)}});
  }
  return all;
}

}  // namespace

StatusFile::StatusFile(RosGraph graph, StatusSources sources, std::filesystem::path path)
    : graph_(std::move(graph)), sources_(std::move(sources)), path_(std::move(path)) {
  announce();
}

StatusFile::~StatusFile() {
  std::error_code error;
  if (!path_.empty()) std::filesystem::remove(path_, error);
}

void StatusFile::announce() {
  std::vector<dds_entity_t> readers, writers;
  for (const Publisher* publisher : sources_.publishers) writers.push_back(publisher->writer());
  if (sources_.inputs != nullptr) {
    for (const InputState& input : sources_.inputs->states()) readers.push_back(input.reader);
  }
  graph_.announce(sources_.name_space, kNode, readers, writers);
}

void StatusFile::write() {
  if (path_.empty()) return;
  graph_.update();
  const std::string text = content().dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  const auto written = base::writeWholeFile(path_, text, base::IfExists::replace);
  if (written || std::exchange(problem_was_said_, true)) return;
  fmt::print(stderr, "hapticd-ros: {}\n", written.error().text());
}

Json StatusFile::content() {
  const bool answers = sources_.box.answers;
  return {{"version", HAPTICD_VERSION},
          {"writtenUtcNs", rt::realtimeNow_ns()},
          {"namespace", "/" + sources_.name_space},
          {"domain", sources_.network.domain},
          {"interface", sources_.participant.interface()},
          {"isLoopback", sources_.participant.isLoopback()},
          {"mode", answers ? Json(rt::wordOf(sources_.box.mode.load())) : Json()},
          {"published", publishedJson()},
          {"taken", takenJson()}};
}

/// Messages a second since the last call; null: at the first one.
Json StatusFile::rateOf(const std::string& topic, std::uint64_t messages) {
  const std::int64_t now_ns = rt::monotonicNow_ns();
  const Counted before = std::exchange(counted_[topic], {messages, now_ns});
  if (before.time_ns == 0 || now_ns <= before.time_ns) return {};
  return static_cast<double>(messages - before.messages) * 1e9 / static_cast<double>(now_ns - before.time_ns);
}

/// Topics outside the namespace are for all programs.
Json StatusFile::othersOf(const Publisher& publisher) const {
  const bool is_own = publisher.topic().starts_with(sources_.name_space + "/");
  return is_own ? Json(graph_.otherWritersOf(publisher.topic())) : Json::array();
}

Json StatusFile::publishedJson() {
  Json all = Json::array();
  for (const Publisher* publisher : sources_.publishers) {
    all.push_back({{"topic", "/" + publisher->topic()},
                   {"type", trace::ros::fullTypeName(publisher->message())},
                   {"rateHz", rateOf(publisher->topic(), publisher->written())},
                   {"messages", publisher->written()},
                   {"failed", publisher->failed()},
                   {"subscribers", peersJson(graph_.readersOf(*publisher))},
                   {"otherPublishers", othersOf(*publisher)}});
  }
  return all;
}

Json StatusFile::takenJson() {
  Json all = Json::array();
  if (sources_.inputs == nullptr) return all;
  for (const InputState& input : sources_.inputs->states()) {
    all.push_back({{"topic", "/" + input.topic},
                   {"type", trace::ros::fullTypeName(input.message)},
                   {"rateHz", rateOf(input.topic, input.taken + input.refused)},
                   {"taken", input.taken},
                   {"refused", input.refused},
                   {"lastRefusal", textOrNull(input.last_refusal)},
                   {"publishers", peersJson(graph_.writersOf(input.topic, input.reader))}});
  }
  return all;
}

}  // namespace hapticd::tools::ros
